"""Passes in a context that belongs to a host program: an engine's OpenGL context, a caller's OpenCL queue."""
