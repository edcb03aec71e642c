"""Graph serialization: graphs as plain data without Python functions, for files, web pages and workers."""

from passgraph.serialize.decode import from_data
from passgraph.serialize.encode import to_data

__all__ = ["from_data", "to_data"]
