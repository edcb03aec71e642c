"""Passes in OpenCL C through pyopencl, on graphics processors, CPUs (PoCL) and accelerators.

Read in this order: ``backend``, ``storage``, ``pixel`` and ``opencl_c`` (the printer), ``raster`` and ``draw_source``,
``transfers`` and ``moves``.  On a caller's queue: ``host``, ``pictures`` (what their memory holds), ``borrowed``.
"""

from passgraph.backends.opencl.backend import OpenCLBackend
from passgraph.backends.opencl.host import Host

__all__ = ["Host", "OpenCLBackend"]
