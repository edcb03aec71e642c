"""Passes in OpenCL C through pyopencl, on graphics processors, CPUs (PoCL) and accelerators."""

from passgraph.backends.opencl.backend import OpenCLBackend
from passgraph.backends.opencl.host import Host

__all__ = ["Host", "OpenCLBackend"]
