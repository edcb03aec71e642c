"""The default backend: NumPy arrays, kernels compiled by numba, a tiled rasteriser.  Needs no driver."""

from passgraph.backends.numpy.backend import NumpyBackend

__all__ = ["NumpyBackend"]
