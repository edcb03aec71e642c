"""The ``passgraph`` command: `entry` names the subcommands, each of which has a file of its own."""

from passgraph.commands.entry import main

__all__ = ["main"]
