"""Shadertoy: a file with ``mainImage``, or the passes of a shader as the site exports them (JSON).

Buffers hold float32. A pass reads this frame's picture of earlier buffers, and last frame's of the others and of
itself.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.glsl import Shader, parse
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Relative, Target, TargetSpec, previous, target
from passgraph.language.types import VEC4
from passgraph.reading import parsed_json
from passgraph.shaders.containers.clock import PRELUDE, SECONDS, clock_parameters, clock_uniforms
from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter, name_of, notes_of, without_comments
from passgraph.shaders.containers.shader_images import handle_or_black, shown_with_kept
from passgraph.shaders.containers.signals import KINDS, SIGNALS, declared_signals, signal

CHANNELS = tuple(f"iChannel{i}" for i in range(4))
MAX_PASSES = 8
_BEFORE = f"""{PRELUDE}
uniform vec4 iMouse;
{"".join(f"uniform sampler2D {channel};" for channel in CHANNELS)}
float iChannelTime[4];
vec3 iChannelResolution[4];
"""
#: Values that the site sets; it counts months from 0.
_VALUES = {
    "iResolution": "vec3(pg_output_size, 1.0)", "iTime": SECONDS, "iGlobalTime": SECONDS, "iTimeDelta": "pg_step",
    "iFrame": "pg_frame", "iFrameRate": "1.0 / pg_step", "iDate": "pg_date - vec4(0.0, 1.0, 0.0, 0.0)",
    "iSampleRate": "44100.0",
}  # fmt: skip
_BORDERS = {"clamp": "clamp", "repeat": "repeat"}
#: Filters of a channel, with True for mipmaps.
_FILTERS = {"nearest": ("nearest", False), "linear": ("linear", False), "mipmap": ("linear", True)}
#: Filters of signals whose file names none.
_FILTER_OF = {"keyboard": "nearest", "audio": "linear"}
#: Kinds of inputs that are pictures from outside.
_OUTSIDE = ("texture", "image", "video", "webcam")
#: Entry functions of passes; only ``mainImage`` is supported.
_ENTRY = re.compile(r"\b(?:void\s+(mainImage|mainCubemap|mainVR)|vec2\s+(mainSound))\s*\(")
#: A shader with a function of this name calls its ``mainImage`` itself.
_MAIN = re.compile(r"\bvoid\s+main\s*\(")
_ORDER = ("Buffer A", "Buffer B", "Buffer C", "Buffer D", "Image")


@dataclass(frozen=True)
class _Source:
    """The source of a channel: a buffer (by the number of its pass), an input picture or a signal by its name, and its
    filter, by default the picture's."""

    buffer: int | None
    picture: str
    border: str
    filter: str | None = None

    def reading(self, picture: Target) -> Target:
        """Return the picture with the channel's filter and border."""
        if self.filter is None:
            return picture.border(self.border)
        rule, levels = _FILTERS[self.filter]
        read = picture.border(self.border).filter(rule)
        return read.mipmaps() if levels else read


@dataclass(frozen=True)
class _Pass:
    name: str
    kernel: PixelKernel[Target]
    channels: Mapping[str, _Source]


def is_shadertoy(text: str) -> bool:
    """Return True if a text has a function that Shadertoy calls, and no ``main`` of its own."""
    if text.lstrip().startswith(("{", "[")):
        return False
    code = without_comments(text)
    return _ENTRY.search(code) is not None and _MAIN.search(code) is None


def is_shadertoy_export(text: str) -> bool:
    """Return True if a text is JSON with passes."""
    return text.lstrip().startswith(("{", "[")) and '"renderpass"' in text


def read_shadertoy(text: str, path: Path) -> ShaderEffect:
    """Read a file with ``mainImage`` as an effect; its channels are pictures, or the signals that it declares.

    Raises
    ------
    InputError
        For a shader with only sound or cube maps, with the line of its function.
    KernelError
        For an unsupported shader, with file, line and caret.
    """
    entries = {match[match.lastindex or 0]: match for match in _ENTRY.finditer(without_comments(text))}
    if "mainImage" not in entries:
        name, entry = next(iter(entries.items()))
        line = text.count("\n", 0, entry.start())
        shown = text.split("\n")[line]
        raise InputError(f"{path}:{line + 1}: {name} makes no picture, and is not read here; mainImage is\n    {shown}")
    declared, text = declared_signals(text, without_comments(text), path)
    channels = {name: _Source(None, name, "repeat") for name in CHANNELS}
    channels |= {name: _Source(None, kind, "clamp", _FILTER_OF[kind]) for name, kind in declared.items()}
    return _effect([(path.stem, text, channels)], "", path, f"{path.stem}: a Shadertoy shader", "")


def read_export(text: str, path: Path) -> ShaderEffect:
    """Read an export as an effect: its passes, with the buffers and borders of their channels.

    Raises
    ------
    InputError
        For an invalid export, and for cube maps, volumes and sound.
    KernelError
        For an unsupported pass, with its name, line and caret.
    """
    file = str(path)
    try:
        export = parsed_json(text)
    except ValueError as error:
        raise InputError(f"{file}: is no JSON: {error}") from None
    while isinstance(export, list) and export:
        export = export[0]
    export = export.get("Shader", export) if isinstance(export, dict) else export
    passes = export.get("renderpass") if isinstance(export, dict) else None
    if not isinstance(passes, list) or not all(isinstance(one, dict) for one in passes) or len(passes) > MAX_PASSES:
        raise InputError(f"{file}: renderpass must be a list of at most {MAX_PASSES} passes, got {shown(passes)}")
    common = "\n".join(_code(one, file) for one in passes if one.get("type") == "common")
    drawn = [one for one in passes if one.get("type") in ("buffer", "image")]
    for one in passes:
        if one.get("type") not in ("buffer", "image", "common", "sound"):
            raise InputError(f"{file}: pass {shown(one.get('name'))}: a {shown(one.get('type'))} is not read here")
    drawn.sort(key=lambda one: _ORDER.index(_name(one)) if _name(one) in _ORDER else len(_ORDER))
    if not drawn or drawn[-1].get("type") != "image":
        raise InputError(f"{file}: has no pass of type image")
    buffers = {_output(one): number for number, one in enumerate(drawn)}
    sources = [(_name(one), _code(one, file), _channels(one, buffers, file)) for one in drawn]
    info = export.get("info") if isinstance(export.get("info"), dict) else {}
    summary = str(info.get("name") or path.stem)
    return _effect(sources, common, path, summary, str(info.get("username") or ""))


def _name(one: Mapping[str, Any]) -> str:
    return str(one.get("name") or "Image")


def _code(one: Mapping[str, Any], file: str) -> str:
    if not isinstance(one.get("code"), str):
        raise InputError(f"{file}: pass {_name(one)!r} has no code")
    return str(one["code"])


def _output(one: Mapping[str, Any]) -> str:
    outputs = one.get("outputs")
    first = outputs[0] if isinstance(outputs, list) and outputs and isinstance(outputs[0], dict) else {}
    return str(first.get("id", ""))


def _channels(one: Mapping[str, Any], buffers: Mapping[str, int], file: str) -> dict[str, _Source]:
    channels: dict[str, _Source] = {}
    inputs = one.get("inputs") or []
    for entry in inputs if isinstance(inputs, list) else []:
        where = f"{file}: pass {_name(one)!r}"
        channel = entry.get("channel") if isinstance(entry, dict) else None
        if type(channel) is not int or not 0 <= channel <= 3:
            raise InputError(f"{where}: an input's channel is 0 to 3, got {shown(channel)}")
        kind = str(entry.get("ctype") or entry.get("type"))
        name, key = CHANNELS[channel], str(entry.get("id", ""))
        sampler = entry.get("sampler") if isinstance(entry.get("sampler"), dict) else {}
        border = _BORDERS.get(str(sampler.get("wrap", "clamp")), "clamp")
        filter_name = str(sampler.get("filter", "linear"))
        filter = filter_name if filter_name in _FILTERS else "linear"
        if kind == "buffer":
            if key not in buffers:
                raise InputError(f"{where}: {name} reads a buffer that no pass writes")
            channels[name] = _Source(buffers[key], "", border, filter)
        elif kind in KINDS:
            channels[name] = _Source(None, KINDS[kind], border, filter)
        elif kind in _OUTSIDE:
            channels[name] = _Source(None, f"picture_{key or channel}", border, filter)
        else:
            raise InputError(f"{where}: {name} is a {kind}, which is not read here")
    return channels


def _effect(
    sources: list[tuple[str, str, dict[str, _Source]]], common: str, path: Path, summary: str, credit: str
) -> ShaderEffect:
    passes: list[_Pass] = []
    shaders: list[Shader] = []
    for name, code, channels in sources:
        several = len(sources) > 1
        shader = parse(
            code, name=name_of(path) if not several else f"{name_of(path)} {name}", file=f"{path} ({name})" if several
            else str(path), entry="pg_main", prelude=_BEFORE + common + "\n", postlude=_behind(code + common),
            values=_VALUES,
        )  # fmt: skip
        shaders.append(shader)
        passes.append(_Pass(name, PixelKernel[Target].of_shader(shader), channels))
    used = {parameter.name for one in passes for parameter in one.kernel.parameters}
    sources_used = dict.fromkeys(
        one.channels[channel].picture
        for one in passes
        for channel in CHANNELS
        if channel in one.channels
        and one.channels[channel].buffer is None
        and channel in {p.name for p in one.kernel.parameters}
    )
    parameters = clock_parameters(used)
    if "iMouse" in used:
        parameters["iMouse"] = ShaderParameter("iMouse", VEC4, (0.0,) * 4, label="pixels from the bottom left")

    signals = tuple(name for name in sources_used if name in SIGNALS)

    def build(inputs_: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        if signals and into.size is None:
            into = replace(into, size=Relative())  # not the size of a signal that it reads
        return _built(passes, inputs_, values, into)

    pictures = tuple(name for name in sources_used if name not in SIGNALS)
    return ShaderEffect(
        name_of(path), "Shadertoy", summary, credit, pictures, parameters, notes_of(shaders), str(path), build,
        signals=signals,
    )  # fmt: skip


def _behind(text: str) -> str:
    """Return the entry function, with the sizes of the channels that the text uses."""
    sizes = ""
    for i, name in enumerate(CHANNELS):
        reads_size = re.search(rf"\biChannelResolution\s*\[\s*{i}\s*\]", text) is not None
        if reads_size or ("iChannelResolution" in text and re.search(rf"\b{name}\b", text)):
            sizes += f"iChannelResolution[{i}] = vec3(textureSize({name}, 0), 1.0); "
    drawn = "vec4 pg_color = vec4(0.0); mainImage(pg_color, gl_FragCoord.xy); gl_FragColor = pg_color;"
    return f"void pg_main() {{ {sizes}{drawn} }}"


def _built(passes: list[_Pass], pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
    specs = [target(f"{into.name}.{one.name}", "rgba32f", scale=1.0) for one in passes[:-1]]
    return shown_with_kept(
        lambda last: _drawn(passes, pictures, values, [*specs, last]), f"{into.name}.{passes[-1].name}", into
    )


def _drawn(
    passes: list[_Pass], pictures: Mapping[str, Target], values: Mapping[str, Any], specs: list[TargetSpec]
) -> list[Target]:
    uniforms = clock_uniforms(values) | dict(values)
    drawn: list[Target] = []
    for number, one in enumerate(passes):
        named: dict[str, Any] = {}
        for parameter in one.kernel.parameters:
            name = parameter.name
            if name in uniforms:
                named[name] = uniforms[name]
                continue
            source = one.channels.get(name)
            if source is None or source.buffer is None:
                outside = "" if source is None else source.picture
                picture = signal(outside) if outside in SIGNALS else pictures.get(outside)
            else:
                picture = drawn[source.buffer] if source.buffer < number else previous(specs[source.buffer])
            black = handle_or_black(picture)
            named[name] = black if source is None else source.reading(black)
        drawn.append(one.kernel.called(named, specs[number]))
    return drawn
