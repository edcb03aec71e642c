"""Words of other stages: what is refused by the name of the stage that it belongs to."""

from __future__ import annotations

import re

_STAGES = {
    "compute": re.compile(
        r"local_size_[xyz](_id)?|shared|gl_(Global|Local)Invocation(ID|Index)|gl_WorkGroup(ID|Size)|gl_NumWorkGroups"
        r"|barrier|(groupM|m)emoryBarrier\w*|[iu]?image(1D|2D|3D|Cube|2DRect|Buffer|1DArray|2DArray|CubeArray|2DMS)"
        r"|image(Load|Store|Size|Atomic\w+)|atomic(_uint|Counter\w*|Add|Min|Max|And|Or|Xor|Exchange|CompSwap)"
    ),
    "geometry": re.compile(r"EmitVertex|EndPrimitive|(Emit|End)Stream\w+|gl_PrimitiveIDIn|max_vertices"),
    "tessellation": re.compile(r"gl_Tess\w+|gl_PatchVerticesIn|patch"),
    "vertex": re.compile(r"gl_(Position|PointSize|VertexID|InstanceID|Vertex|MultiTexCoord\d)|ftransform"),
}


def elsewhere(word: str) -> str | None:
    """Why a word that nobody declared has no meaning here, where it has one in another stage.

    >>> elsewhere("imageStore")
    'imageStore belongs to compute shaders, which are not read here: a fragment shader gives its own pixel a colour'
    >>> elsewhere("texture")
    """
    for stage, words in _STAGES.items():
        if words.fullmatch(word):
            reason = "which are not read here: a fragment shader gives its own pixel a colour"
            return f"{word} belongs to {stage} shaders, {reason}"
    return None
