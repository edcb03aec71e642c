"""The command line: ``passgraph render | apply | compare | backends | plan``."""

from passgraph.commands.entry import main

__all__ = ["main"]
