"""Targets and passes: the graph that calls of kernels build."""
