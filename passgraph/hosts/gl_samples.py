"""Multisampled pictures of a host: resolved at pixel centers, and written only where an effect changes them.

OpenGL's own blit averages colors as they are stored, and takes the depth of some sample, off the pixel's center. For
engines that resolve colors in another space, see ``sample_gamma`` (`passgraph.hosts.gl.HostPicture`).
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.gl.programs import LinkedProgram
from passgraph.backends.gl.textures import Texture
from passgraph.hosts.gl_host_pictures import HostPicture

_SAMPLE_POSITION = 0x8E50
#: Fewest samples for fitting a plane, since fewer fit its three unknowns (depth and slopes) exactly; and most samples.
FEWEST_FITTED, _MOST_SAMPLES = 4, 32
#: Tolerances for samples on one plane: the rounding of 24 bits, and a share of their range for curved surfaces.
_ROUNDED, _BENT = 2.0**-22, 1.0 / 16.0
#: A little less than half a step between the numbers of a format.
_HALF_STEP = 0.49

_COLOR = """
uniform highp sampler2DMS samples; uniform ivec2 origin; uniform int count; uniform float gamma;
out vec4 resolved;
void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy) + origin;
    resolved = texelFetch(samples, at, 0);
    bool differ = false;
    for (int k = 1; k < count; k++)
        differ = differ || texelFetch(samples, at, k) != resolved;
    // a loop, since drivers on the CPU leave it where no pixel of a group takes part, and go through an if
    vec4 sum = vec4(0.0);
    for (int k = 0; differ && k < count; k++) {
        vec4 one = texelFetch(samples, at, k);
        sum += vec4(pow(one.rgb, vec3(gamma)), one.a) / float(count);
        if (k == count - 1) resolved = vec4(pow(sum.rgb, vec3(1.0 / gamma)), sum.a);
    }
}
"""
_DEPTH = f"""
uniform highp sampler2DMS samples; uniform ivec2 origin; uniform int count;
uniform vec4 places[{_MOST_SAMPLES}]; uniform vec4 weights[{_MOST_SAMPLES}];
out vec4 resolved;
void main()
{{
    ivec2 at = ivec2(gl_FragCoord.xy) + origin;
    float first = texelFetch(samples, at, 0).r, low = first, high = first, off = 0.0;
    vec3 plane = vec3(0.0);
    for (int k = 0; k < count; k++) {{
        float one = texelFetch(samples, at, k).r;
        plane += weights[k].xyz * (one - first);
        low = min(low, one);
        high = max(high, one);
    }}
    for (int k = 0; k < count; k++)
        off = max(off, abs(texelFetch(samples, at, k).r - first - dot(plane, vec3(1.0, places[k].xy))));
    resolved = vec4(off <= {_ROUNDED!r} + {_BENT!r} * (high - low) ? first + plane.x : first);
}}
"""
_KEEP = """
uniform highp sampler2D result; uniform highp sampler2D before; uniform ivec2 origin;
uniform ivec2 place; uniform int height; uniform int channels; uniform float same;
out vec4 written;
void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy) - origin;
    written = texelFetch(result, ivec2(at.x, height < 0 ? at.y : height - 1 - at.y), 0);
    vec4 off = abs(written - texelFetch(before, at + place, 0));
    bool is_same = off.r <= same;
    if (channels > 1) is_same = is_same && off.g <= same;
    if (channels > 2) is_same = is_same && off.b <= same;
    if (channels > 3) is_same = is_same && off.a <= same;
    if (is_same) discard;
}
"""


class Samples:
    """Multisample handling of a host."""

    def __init__(self, host: GLBackend) -> None:
        self.host = host
        self._programs: dict[str, LinkedProgram] = {}

    def resolve(self, picture: HostPicture, name: int, framebuffer: int, places: NDArray[np.float32] | None) -> None:
        """Resolve the picture's part of a multisample texture into a framebuffer, at its corner.

        ``places`` are the positions of depth samples relative to the pixel's center, (n, 2); None for color.
        """
        gl, program = self.host.context.gl, self._use("color" if places is None else "depth", framebuffer, picture)
        gl.ActiveTexture(g.TEXTURE0)
        gl.BindTexture(g.TEXTURE_2D_MULTISAMPLE, name)
        self._set("origin", gl.Uniform2i, program, *picture.region[:2])
        self._set("count", gl.Uniform1i, program, picture.samples)
        if places is None:
            self._set("gamma", gl.Uniform1f, program, picture.sample_gamma)
        else:
            fitted = np.c_[np.ones(len(places)), places]
            for uniform, rows in (("places", places), ("weights", np.linalg.pinv(fitted).T)):
                padded = np.zeros((len(rows), 4), np.float32)
                padded[:, : rows.shape[1]] = rows
                self._set(uniform, gl.Uniform4fv, program, len(rows), padded.tobytes())
        gl.DrawArrays(g.TRIANGLES, 0, 3)
        gl.BindTexture(g.TEXTURE_2D_MULTISAMPLE, 0)
        self._end(f"resolving {picture}")

    def write_changes(self, result: Texture, before: Texture, picture: HostPicture, destination: Texture) -> None:
        """Write a result to all samples of the pixels that it changes; other pixels keep their samples."""
        host, gl = self.host, self.host.context.gl
        framebuffer = host.objects.framebuffer((destination,), None)
        program = self._use("keep", framebuffer, picture, picture.region[:2])
        fixed.bind_images(gl, host.context.bound, (result, before))
        steps = picture.format.steps
        self._set("result", gl.Uniform1i, program, 0)
        self._set("before", gl.Uniform1i, program, 1)
        self._set("origin", gl.Uniform2i, program, *picture.region[:2])
        self._set("place", gl.Uniform2i, program, *before.origin)
        self._set("height", gl.Uniform1i, program, picture.size[1] if picture.origin == "bottom" else -1)
        self._set("channels", gl.Uniform1i, program, min(result.format.channels, picture.format.channels))
        self._set("same", gl.Uniform1f, program, _HALF_STEP / steps if steps else 0.0)
        gl.DrawArrays(g.TRIANGLES, 0, 3)
        self._end(f"writing {picture}")

    def places(self, count: int) -> NDArray[np.float32]:
        """Return the sample positions of the bound draw framebuffer, from the pixel's center, (count, 2)."""
        gl, pair, positions = self.host.context.gl, (ctypes.c_float * 2)(), []
        for k in range(count):
            gl.GetMultisamplefv(_SAMPLE_POSITION, k, pair)
            positions.append((pair[0] - 0.5, pair[1] - 0.5))
        return np.array(positions, np.float32)

    def _use(
        self, name: str, framebuffer: int, picture: HostPicture, origin: tuple[int, int] = (0, 0)
    ) -> LinkedProgram:
        host, gl = self.host, self.host.context.gl
        if name not in self._programs:
            text = {"color": _COLOR, "depth": _DEPTH, "keep": _KEEP}[name]
            self._programs[name] = host.programs.from_text(f"{name} of several samples", text)
        program = self._programs[name]
        fixed.set_pixel_pass(gl, host.context.bound, framebuffer, picture.size, origin)
        fixed.use(gl, host.context.bound, program.name, host.no_vertices)
        return program

    def _set(self, name: str, call: Any, program: LinkedProgram, *values: Any) -> None:
        call(self.host.context.gl.GetUniformLocation(program.name, name.encode()), *values)

    def _end(self, doing: str) -> None:
        self.host.unbind()
        self.host.context.gl.check(doing)
