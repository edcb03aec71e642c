"""Shaders that count bins: a compute shader, and the pass that writes its counts."""

from __future__ import annotations

from dataclasses import replace

from passgraph.backends.gl.dialect import Dialect
from passgraph.backends.gl.glsl import NAMES, region_name
from passgraph.backends.gl.textures import Placement

#: Headers for shader storage buffers and compute shaders as extensions.  A fragment shader requests buffers only:
#: NVIDIA's compiler takes a shader that requests compute shaders for one, and rejects its outputs.
_BUFFERS = "#version 420 core\n#extension GL_ARB_shader_storage_buffer_object : require"
_COMPUTE = f"{_BUFFERS}\n#extension GL_ARB_compute_shader : require"

#: One group per row; rows below the picture count nothing.  Four texels per iteration save a fifth on llvmpipe.
_MAIN = """layout(local_size_x = GROUP) in;
uniform sampler2D IMAGE;
layout(std430) buffer Counts { uint pg_counts[]; };
const int bins = BINS;
shared uint table[bins + 1];
// The entry of a number's bin; 0 for what is in none.
int pg_bin(float number)
{
    bool inside = number >= 1.0 && number <= float(bins);
    int entry = int(inside ? number : 0.0);
    return float(entry) == number ? entry : 0;
}
int pg_entry(int x, int y) { return pg_bin(texelFetch(IMAGE, AT, 0).r); }
void pg_add(int entry) { if (entry > 0) { atomicAdd(table[entry], 1u); } }
void main()
{
    int me = int(gl_LocalInvocationID.x), y = int(gl_WorkGroupID.x);
    int width = y < pg_output_size.y ? pg_output_size.x : 0;
    int whole = width - width % (4 * GROUP), x = me;
    for (int i = me; i <= bins; i += GROUP) { table[i] = 0u; }
    barrier();
    for (; x < whole; x += 4 * GROUP) {
        int a = pg_entry(x, y), b = pg_entry(x + GROUP, y);
        int c = pg_entry(x + 2 * GROUP, y), d = pg_entry(x + 3 * GROUP, y);
        pg_add(a);
        pg_add(b);
        pg_add(c);
        pg_add(d);
    }
    for (; x < width; x += GROUP) { pg_add(pg_entry(x, y)); }
    barrier();
    for (int i = me; i < bins; i += GROUP) { pg_counts[y * bins + i] = table[i + 1]; }
}
"""

_SUMS = """layout(std430) readonly buffer Counts { uint pg_counts[]; };
layout(location = 0) out vec4 pg_out0;
UNIFORMS
void main()
{
    ivec2 at = PLACE;
    int i = at.y * BINS + 4 * at.x;
    pg_out0 = vec4(pg_counts[i], pg_counts[i + 1], pg_counts[i + 2], pg_counts[i + 3]);
}
"""


def counts_text(bins: int, group: int, picture: Placement, dialect: Dialect) -> str:
    """Return the compute shader."""
    uniforms, at, image = ["uniform ivec2 pg_output_size;"], "ivec2(x, y)", NAMES["pixel"].image
    if picture.bottom_up:
        at = "ivec2(x, pg_output_size.y - 1 - y)"
    if picture.is_part:
        region = region_name(image, 0)
        uniforms.append(f"uniform ivec4 {region};")
        at = f"{region}.xy + {at}"
    text = _MAIN.replace("GROUP", str(group)).replace("BINS", str(bins)).replace("AT", at).replace("IMAGE", f"{image}0")
    return "\n".join([dialect.header, *uniforms, text])


def sums_text(bins: int, output: Placement, dialect: Dialect) -> str:
    """Return the fragment shader that writes the counts."""
    uniforms, place = [], "ivec2(gl_FragCoord.xy)"
    if output.is_part:
        uniforms.append("uniform ivec2 pg_output_origin;")
        place = f"({place} - pg_output_origin)"
    if output.bottom_up:
        uniforms.append("uniform ivec2 pg_output_size;")
        place = f"ivec2({place}.x, pg_output_size.y - 1 - {place}.y)"
    text = _SUMS.replace("BINS", str(bins)).replace("PLACE", place).replace("UNIFORMS", "\n".join(uniforms))
    return f"{dialect.header}\n{text}"


def counting_dialect(dialect: Dialect, is_core: bool, stage: str) -> Dialect:
    """Return the same GLSL for a ``"compute"`` or ``"fragment"`` shader with buffers: 4.3, or 4.2 with extensions;
    in OpenGL ES 3.1 or newer."""
    if dialect.version.endswith("es"):
        return replace(dialect, version=max(dialect.version, "#version 310 es"))
    extended = _COMPUTE if stage == "compute" else _BUFFERS
    return replace(dialect, version="#version 430 core" if is_core else extended)
