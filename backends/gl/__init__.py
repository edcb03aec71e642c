"""OpenGL 3.3 and OpenGL ES 3.0: kernels as shaders, draws by the hardware's rasteriser.

Read in this order: ``backend`` (storages, transfers), ``passes``, ``glsl`` (the printer) and ``dialect``,
``programs``, ``state`` and ``bound``, ``textures``, ``objects``, ``context``, ``functions``, ``capabilities``.

In an engine's context: ``host``, then ``host_context``, ``sibling`` and ``guard`` (the two ways to leave its state
alone), ``foreign`` and ``surfaces`` (what its pictures are), ``placement`` (how they lie), ``copies``.
"""

from __future__ import annotations

from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.gl.host import Host, HostFramebuffer, HostPicture

__all__ = ["GLBackend", "Host", "HostFramebuffer", "HostPicture"]
