"""Passes in OpenCL C through pyopencl, on GPUs, CPUs (PoCL) and accelerators.

Read in this order: ``backend``, ``storage``, ``pixel`` and ``opencl_c`` (the printer), ``raster`` and ``draw_source``,
``transfers``.  :mod:`passgraph.hosts` works on a caller's queue.
"""

from passgraph.backends.opencl.backend import OpenCLBackend

__all__ = ["OpenCLBackend"]
