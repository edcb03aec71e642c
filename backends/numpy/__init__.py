"""The default backend: NumPy arrays, kernels as vector code through LLVM, a tiled rasterizer.  Needs no driver.

Four rooms, each of which imports from those before it only: ``machine``, ``vector``, then ``pixels`` and ``raster``.
"""

from passgraph.backends.numpy.backend import NumpyBackend

__all__ = ["NumpyBackend"]
