"""Targets and passes: the graph that kernel calls build."""
