"""Fuzzing: random kernels, graphs and draws, and equivalent rewritten kernels, compared between backends.

The generators are hypothesis strategies, so failures are shrunk to the smallest failing case.  A case is plain data
(:mod:`passgraph.verify.fuzz.cases`): the text of a kernel or the description of a graph, parsed, never executed. Needs
``pip install 'passgraph[fuzz]'``.
"""
