"""Graphs as plain data: what `passgraph.compile` takes, without Python functions, for files, pages and workers."""

from passgraph.travel.decode import from_data
from passgraph.travel.encode import to_data

__all__ = ["from_data", "to_data"]
