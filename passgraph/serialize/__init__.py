"""Graph serialization: graphs as plain data without Python functions, for files, web pages and workers."""

from passgraph.serialize.decode import from_data
from passgraph.serialize.encode import to_data
from passgraph.serialize.graph_file import load_graph, save_graph

__all__ = ["from_data", "load_graph", "save_graph", "to_data"]
