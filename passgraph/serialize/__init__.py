"""Graphs as plain data: what `passgraph.compile` takes, without Python functions, for files, pages and workers."""

from passgraph.serialize.decode import from_data
from passgraph.serialize.encode import to_data

__all__ = ["from_data", "to_data"]
