"""Benchmarks: time against error.

For shadow methods, against ray tracing: `scenes` defines the scenes and `methods` the methods; `truth` traces the
ground truth, `metrics` compares, and `measure` runs everything.  For a user's graph, against an exact version of it:
`versions`.  Both run frames in turn (`timing`), compare pictures perceptually (`likeness`), and show the Pareto front
(`pareto`, `charts`); `tables` and `report` write the report folder for shadow methods.
"""
