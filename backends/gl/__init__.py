"""OpenGL 3.3 and OpenGL ES 3.0: kernels as shaders, draws on the hardware rasterizer.

Read in this order: ``backend`` (storages, transfers), ``passes``, ``glsl`` (the printer) and ``dialect``, ``programs``,
``state``, ``textures``, ``context``, ``gl_functions``, ``capabilities``.  ``es`` is the ``gles`` backend.

:mod:`passgraph.hosts` uses it in an engine's context.
"""

from __future__ import annotations

from passgraph.backends.gl.backend import GLBackend

__all__ = ["GLBackend"]
