"""The default backend: NumPy arrays, kernels as vector code through LLVM, a tiled rasterizer.  Needs no driver.

Four subpackages, each of which imports only from earlier ones: ``machine``, ``vector``, then ``pixels`` and ``raster``.
"""

from passgraph.backends.numpy.backend import NumpyBackend

__all__ = ["NumpyBackend"]
