"""libretro presets and shaders: chains of passes with textures, earlier frames and feedback.

Rows count from the top, as in the player's chain.  The picture is as large as the output that a graph is compiled for;
the viewport is ``output_scale`` times that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from passgraph.errors import InputError
from passgraph.formats import format_named
from passgraph.graph.calls import PixelKernel
from passgraph.graph.formulas import Formula
from passgraph.graph.targets import Computed, Target, TargetSpec, previous, target
from passgraph.graph.values import FRAME_INDEX
from passgraph.language.types import FLOAT, ImageType
from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter, name_of, notes_of, zero_of_type
from passgraph.shaders.containers.libretro_preset import Preset, PresetPass, PresetTexture, read_preset
from passgraph.shaders.containers.libretro_shader import is_libretro, read_shader, shader_parameters
from passgraph.shaders.containers.pictures import loaded, small_kernel
from passgraph.shaders.containers.text import shader_text
from passgraph.shaders.glsl import Shader

#: Earlier frames by the samplers that hold them, → how many runs ago.
_EARLIER = {"Prev": 1} | {f"Prev{i}": i + 1 for i in range(1, 7)}
#: Sizes of passes come from it.
_CONSTANTS = frozenset({"output_scale"})
_COPIED = "uniform sampler2D t; void main() { gl_FragColor = texelFetch(t, ivec2(gl_FragCoord.xy), 0); }"


@dataclass(frozen=True)
class _Step:
    """One pass with its kernel, and which sampler reads what: a number (0 is the frame, n what pass n made), or a
    word for earlier frames and feedback."""

    told: PresetPass
    shader: Shader
    kernel: PixelKernel[Target]
    names: Mapping[str, int]


def read_libretro_preset(text: str, path: Path) -> ShaderEffect:
    """The effect of a preset.

    Raises
    ------
    InputError
        For a preset that is wrong, and files that are missing or lie outside of its tree.
    KernelError
        For a shader that is refused, with file, line and caret.
    """
    return _effect(read_preset(text, path), {}, path)


def read_libretro_shader(text: str, path: Path) -> ShaderEffect:
    """The effect of a shader by itself: one pass as large as the viewport."""
    return _effect(Preset((PresetPass(path),), {}, None, {}), {path: text}, path)


def _effect(preset: Preset, texts: dict[Path, str], path: Path) -> ShaderEffect:
    file = str(path)
    parameters: dict[str, ShaderParameter] = {}
    steps: list[_Step] = []
    for number, told in enumerate(preset.passes, 1):
        if told.shader not in texts:
            read = shader_text(told.shader, f"shader{number - 1} of {file}")
            texts[told.shader] = read.replace("\r\n", "\n")
        text = texts[told.shader]
        if not is_libretro(text):
            raise InputError(f"{told.shader}: has not both halves, #if defined(VERTEX) and FRAGMENT")
        names = _pictures_of(preset, number)
        for name, found in shader_parameters(text, str(told.shader)).items():
            parameters.setdefault(name, replace(found, default=preset.overrides.get(name, found.default)))
        shader = read_shader(text, told.shader, f"{name_of(path)}.{number}", [*names, *_EARLIER, "Feedback"])
        steps.append(_Step(told, shader, PixelKernel[Target].of_shader(shader), names))
    parameters["output_scale"] = ShaderParameter("output_scale", FLOAT, 4.0, 0.0625, 16.0, "viewport by the frame")
    textures = {
        name: _read_as(loaded(f"{file}:{name}", one.path, f"texture {name!r} of {file}"), one)
        for name, one in preset.textures.items()
    }
    notes = notes_of(step.shader for step in steps)
    build = partial(_built, preset, steps, textures)
    summary = f"{path.stem}: a libretro chain of {len(steps)} pass{'es' if len(steps) > 1 else ''}"
    return ShaderEffect(name_of(path), "libretro", summary, "", ("frame",), parameters, notes, file, build, _CONSTANTS)


def _pictures_of(preset: Preset, number: int) -> dict[str, int]:
    """What the samplers of pass ``number``, counted from 1, may be called, → whose picture it is; 0 is the frame."""
    found = {"": number - 1, "Orig": 0, f"PassPrev{number}": 0}
    for i, told in enumerate(preset.passes[: number - 1], 1):
        found |= {f"Pass{i}": i, f"PassPrev{number - i}": i}
        if told.alias:
            found[told.alias] = i
    return found


def _built(
    preset: Preset, steps: list[_Step], textures: Mapping[str, Target],
    pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec,
) -> Target:  # fmt: skip
    """The graph of a preset's passes."""
    specs = _specs(steps, float(values["output_scale"]), into)
    frame = pictures["frame"]
    if any(f"{name}Texture" in _samplers(step) for name in _EARLIER for step in steps):
        copy = small_kernel("frame", _COPIED)
        frame = copy(
            t=frame, into=TargetSpec(f"{into.name}.frame", format_named("rgba32f"), Computed("width", "height"))
        )
    made = [_read_as(frame, steps[0].told)]
    for number, (step, spec) in enumerate(zip(steps, specs, strict=True), 1):
        held = {f"{name}Texture": made[i] for name, i in step.names.items()} | dict(textures)
        for name in _samplers(step):
            base = name.removesuffix("Texture")
            if name in held:
                continue
            if base in _EARLIER:
                held[name] = _read_as(previous(frame, _EARLIER[base]), steps[0].told)
            elif name == "FeedbackTexture" and preset.feedback_pass is not None:
                at = preset.feedback_pass
                held[name] = _read_as(previous(specs[at]), steps[at + 1].told if at + 1 < len(steps) else None)
            else:
                held[name] = made[number - 1]  # a sampler that nobody sets reads the first unit
        given: dict[str, Any] = {}
        for parameter in step.kernel.parameters:
            name = parameter.name
            if isinstance(parameter.type, ImageType):
                given[name] = held[name]
            elif name == "FrameCount":
                most = step.told.frame_count_mod
                given[name] = FRAME_INDEX.map(partial(_begun_again, most)) if most else FRAME_INDEX
            elif name == "FrameDirection":
                given[name] = 1
            else:
                given[name] = values.get(
                    name, parameter.default if parameter.has_default else zero_of_type(parameter.type)
                )
        result = step.kernel.called(given, spec)
        made.append(_read_as(result, steps[number].told) if number < len(steps) else result)
    return made[-1]


def _begun_again(most: int, frame: int) -> int:
    return frame % most


def _samplers(step: _Step) -> list[str]:
    return [p.name for p in step.kernel.parameters if isinstance(p.type, ImageType)]


def _read_as(picture: Target, reader: PresetPass | PresetTexture | None) -> Target:
    """A pass says how the picture that it starts from is read, by later ones too."""
    told = reader or PresetPass(Path())
    read = picture.border(told.border).filter(told.filter)
    return read.mipmaps() if told.mipmaps else read


def _specs(steps: list[_Step], scale: float, into: TargetSpec) -> list[TargetSpec]:
    """A target for each pass; the last one's has the caller's name and format."""
    viewport: tuple[Formula, Formula] = (("mul", "width", scale), ("mul", "height", scale))
    size: tuple[Formula, Formula] = ("width", "height")
    specs = []
    for number, step in enumerate(steps, 1):
        last, sides = number == len(steps), step.told.sides
        if sides is not None:
            size = (sides[0].formula(size[0], viewport[0]), sides[1].formula(size[1], viewport[1]))
        elif last:
            size = viewport
        made = into if last else target(f"{into.name}.{number}", step.told.format)
        specs.append(replace(made, size=Computed(*size)))
    return specs
