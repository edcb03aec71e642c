"""Rows of vectors and matrices, which :mod:`.expand` expands.

Functions are names of this module; imports have an underscore, so that ``from … import *`` takes only the functions.
Examples write vectors as tuples, matrices as tuples of columns.
"""

from __future__ import annotations

import math as _math
from functools import partial as _partial

import numpy as _np

from passgraph.language import meanings as _of
from passgraph.language.operation import row as _any_row

_row = _partial(_any_row, "expanded")
_NAN = _math.nan

# fmt: off
dot = _row("dot", "V V -> f", "sum of products, first component first", _of.dot, ((1, 2, 3), (4, 5, 6), 32), ulp=4,
           of_terms=True)
cross = _row("cross", "v3 v3 -> v3", "vector product", _np.cross, ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
             ulp=3, of_terms=True)
length = _row("length", "V -> f", "Euclidean length", _of.length, ((3, 4), 5), ulp=5)
distance = _row("distance", "V V -> f", "length(a - b)", _of.distance, ((1, 1), (4, 5), 5), ulp=6)
normalize = _row("normalize", "V -> V", "the vector at length 1; zero stays zero", _of.normalize,
                 ((0, 3, 4), (0, 0.6, 0.8)), ((0, 0, 0), (0, 0, 0)), ulp=8)
faceforward = _row("faceforward", "V V V -> V",
                   "(n, incident, reference): n where dot(reference, incident) < 0, else -n", _of.faceforward,
                   ((0, 1), (0, -1), (0, 1), (0, 1)), ((0, 1), (0, 1), (0, 1), (0, -1)))
reflect = _row("reflect", "V V -> V", "incident mirrored by a unit normal", _of.reflect, ((1, -1), (0, 1), (1, 1)),
               ulp=8, of_terms=True, tame=((-2, 2), (-1, 1)))
refract = _row("refract", "V V f -> V", "incident refracted at a unit normal; zero on total reflection", _of.refract,
               ((0, -1), (0, 1), 0.5, (0, -1)), ((1, 0), (0, 1), 2.0, (0, 0)), ulp=16, of_terms=True)
_row("any", "B -> b", "whether one component holds", _of.any_of, ((True, False), True), ((False, False), False))
_row("all", "B -> b", "whether every component holds", _of.all_of, ((True, False), False), ((True, True), True))
_row("matmul", "M * -> *", "matrix product, columns as in GLSL: as many columns on the left as rows on the right",
     _of.matmul, (((1, 2), (3, 4)), (5, 6), (23, 34)),
     ((5, 6), ((1, 2), (3, 4)), (17, 39)), (((1, 2), (3, 4)), ((0, 1), (1, 0)), ((3, 4), (1, 2))),
     written=("a * b", "a @ b"), ulp=6, of_terms=True)
transpose = _row("transpose", "M -> M", "rows and columns swapped", _of.transpose,
                 (((1, 2), (3, 4)), ((1, 3), (2, 4))))
determinant = _row("determinant", "Q -> f", "determinant", _np.linalg.det, (((1, 2), (3, 4)), -2),
                   ulp=32, of_terms=True)
inverse = _row("inverse", "Q -> Q", "inverse; NaN where the determinant is 0, of columns brought near 1", _of.inverse,
               (((2, 0), (0, 4)), ((0.5, 0), (0, 0.25))), (((1, 2), (2, 4)), ((_NAN, _NAN), (_NAN, _NAN))), ulp=64,
               of_terms=True)
outer = _row("outer", "V V -> M", "column vector times row vector, of any two sizes (GLSL outerProduct)", _of.outer,
             ((1, 2), (3, 4), ((3, 6), (4, 8))), ulp=0.5)
# fmt: on

#: Names that kernels call; `python -m passgraph.language.stubs` writes stubs for type checkers.
__all__ = [name for name in vars() if "a" <= name[0] <= "z" and name != "annotations"]
