"""Functions of the language that are written in the language: image reads beyond one texel."""

from __future__ import annotations

import ast
from functools import lru_cache
from pathlib import Path

from passgraph.errors import PassgraphError
from passgraph.language.scope import TEXT_NAMES, FunctionSource, Scope
from passgraph.language.source import Source

_LIBRARY = '''
def pixel_uv() -> vec2:
    """The centre of this pixel, 0 to 1; (0, 0) is the top left corner of the picture."""
    return (vec2(pixel()) + 0.5) / vec2(output_size())

def sample(image: Image, position: vec2) -> vec4:
    """Bilinear, with weights computed here in float32, so that every backend filters alike."""
    # Farther out the next texel's number would not fit into an int; 2**30 lies beyond every picture.
    p = clamp(position * vec2(image.size) - 0.5, -1073741824.0, 1073741824.0)
    base = floor(p)
    f = p - base
    corner = ivec2(base)
    top = mix(image.texel(corner), image.texel(corner + ivec2(1, 0)), f.x)
    bottom = mix(image.texel(corner + ivec2(0, 1)), image.texel(corner + ivec2(1, 1)), f.x)
    return mix(top, bottom, f.y)

def texel_upward(image: Image, position: ivec2) -> vec4:
    """A texel whose row is counted from the bottom up, as OpenGL does."""
    return image.texel(ivec2(position.x, image.size.y - 1 - position.y))

def sample_upward(image: Image, position: vec2) -> vec4:
    """As sample, with (0, 0) the bottom left corner: texels and their weights are those that OpenGL takes."""
    p = clamp(position * vec2(image.size) - 0.5, -1073741824.0, 1073741824.0)
    base = floor(p)
    f = p - base
    corner = ivec2(base.x, image.size.y - 1 - int(base.y))
    lower = mix(image.texel(corner), image.texel(corner + ivec2(1, 0)), f.x)
    upper = mix(image.texel(corner - ivec2(0, 1)), image.texel(corner + ivec2(1, -1)), f.x)
    return mix(lower, upper, f.y)
'''


def functions_of(source: Source, extra: dict[str, object] | None = None) -> dict[str, FunctionSource]:
    """Every function defined in a text; they see each other and the language."""
    names: dict[str, object] = dict(extra or {})
    functions: dict[str, FunctionSource] = {}
    scope = Scope(
        lambda name: functions[name] if name in functions else names[name] if name in names else TEXT_NAMES[name]
    )
    for node in source.parse().body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = FunctionSource(node.name, source, node, scope)
    return functions


@lru_cache(maxsize=1)
def _library() -> dict[str, FunctionSource]:
    return functions_of(Source("<passgraph library>", _LIBRARY))


@lru_cache(maxsize=1)
def _prelude() -> dict[str, FunctionSource]:
    file = Path(__file__).with_name("prelude.py")
    return functions_of(Source("<passgraph prelude>", file.read_text(encoding="utf-8")))


def library_function(name: str) -> FunctionSource:
    return _library()[name]


def prelude_function(name: str) -> FunctionSource:
    """A scalar function of :mod:`.prelude`."""
    functions = _prelude()
    if name not in functions:
        raise PassgraphError(f"the prelude has no function {name}")
    return functions[name]
