"""Random kernels, graphs and draws, and rewritten kernels that must mean the same: backends held against each other.

The generators are hypothesis strategies, so that whatever fails is shrunk to the least that fails.  A case is plain
data (:mod:`passgraph.verify.fuzz.cases`): the text of a kernel or the description of a graph, parsed, never executed.
Needs ``pip install 'passgraph[fuzz]'``.
"""
