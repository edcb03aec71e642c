"""``python -m passgraph``."""

from passgraph.commands import main

if __name__ == "__main__":
    main()
