"""OpenGL 3.3: kernels as GLSL 3.30 shaders, draws by the hardware's rasteriser.

Read in this order: ``backend`` (storages, transfers), ``passes``, ``glsl`` (the printer), ``programs``,
``state`` and ``bound``, ``textures``, ``objects``, ``context``, ``functions``.
"""

from __future__ import annotations

from passgraph.backends.gl.backend import GLBackend

__all__ = ["GLBackend"]
