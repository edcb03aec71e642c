"""Backends in a host program's context: an engine's OpenGL context, or a caller's OpenCL queue."""
