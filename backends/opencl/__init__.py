"""Passes in OpenCL C through pyopencl, on graphics processors, CPUs (PoCL) and accelerators."""

from passgraph.backends.opencl.backend import OpenCLBackend

__all__ = ["OpenCLBackend"]
