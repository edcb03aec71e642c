"""libretro presets and shaders: chains of passes with textures, earlier frames and feedback.

Rows count from the top, as in the player's chain. The picture has the size of the graph's output; the viewport is
``output_scale`` times that.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from passgraph.errors import InputError
from passgraph.formats import format_named
from passgraph.glsl import Shader, parse
from passgraph.glsl import syntax as g
from passgraph.glsl.preprocess import preprocessed
from passgraph.graph.calls import PixelKernel
from passgraph.graph.run_values import FRAME_INDEX, Formula
from passgraph.graph.targets import MAX_SIDE, Computed, Target, TargetSpec, previous, target
from passgraph.language.source import fail
from passgraph.language.types import FLOAT, ImageType
from passgraph.shaders.containers.effect import (
    ShaderEffect,
    ShaderParameter,
    name_of,
    notes_of,
    shader_text,
    zero_of_type,
)
from passgraph.shaders.containers.shader_images import loaded, small_kernel
from passgraph.shaders.containers.vertex_stage import Inputs, vertex_stage

MAX_PASSES, MAX_TEXTURES, MAX_REFERENCES = 64, 32, 16
#: Most parent folders above the preset's for its files, since trees of presets share shaders and pictures.
MAX_CLIMB = 4
#: Largest factor of a size.
MAX_SCALE = 64.0
#: The player's names of border rules → ours.
_BORDERS = {
    "clamp_to_border": "zero",
    "clamp_to_edge": "clamp",
    "repeat": "repeat",
    "mirrored_repeat": "mirror",
}
_SCALES = ("source", "viewport", "absolute")
_TRUTH = {"true": True, "1": True, "false": False, "0": False}
_NAME = re.compile(r"[A-Za-z_]\w{0,63}")
#: The last quotation mark may be missing.
_ENTRY = re.compile(r"""\s*([A-Za-z_]\w*)\s*=\s*(?:"([^"]*)"?|'([^']*)'?|(.*))""")
_REFERENCE = re.compile(r"""\s*#reference\s+(?:"([^"]+)"|(\S+))""")
Read = TypeVar("Read")


@dataclass(frozen=True)
class Side:
    """A side of a pass: ``by`` times the source's or the viewport's, or a number of pixels."""

    type: str
    by: float

    def formula(self, source: Formula, viewport: Formula) -> Formula:
        """Return its length in pixels as a formula."""
        if self.type == "absolute":
            return self.by
        reference = source if self.type == "source" else viewport
        return reference if self.by == 1 else ("floor", ("mul", reference, self.by))


@dataclass(frozen=True)
class PresetPass:
    """A pass, with the filter and border for reading its source picture, also by later passes.

    Attributes
    ----------
    shader : its file
    sides : None for the default: the source's size, and for the last pass the viewport's
    format : the format of its target
    """

    shader: Path
    alias: str = ""
    filter: str = "nearest"
    border: str = "zero"
    sides: tuple[Side, Side] | None = None
    format: str = "rgba8"
    frame_count_mod: int = 0
    mipmaps: bool = False


@dataclass(frozen=True)
class PresetTexture:
    """A picture file of the preset."""

    path: Path
    filter: str
    border: str
    mipmaps: bool


@dataclass(frozen=True)
class Preset:
    """A parsed preset; ``overrides`` are its numbers for names that may be parameters."""

    passes: tuple[PresetPass, ...]
    textures: Mapping[str, PresetTexture]
    feedback_pass: int | None
    overrides: Mapping[str, float]


def is_preset(text: str) -> bool:
    """Return True if a text has a number of shaders, or refers to another preset."""
    return re.search(r"""^\s*(?:shaders\s*=\s*["']?\d|#reference\s)""", text, re.MULTILINE) is not None


def read_preset(text: str, path: Path) -> Preset:
    """Read a preset and the presets that it refers to.

    Raises
    ------
    InputError
        For invalid entries, missing files, and paths outside of the tree.
    """
    values = _Values(path, {})
    values.read(text, path, ())
    count = values.number("shaders", _integer, None, 1, MAX_PASSES)
    passes = tuple(_pass(values, i) for i in range(count))
    names = [name.strip() for name in values.text("textures", "").split(";") if name.strip()]
    if len(names) > MAX_TEXTURES:
        raise InputError(f"{path}: a preset has at most {MAX_TEXTURES} textures, got {len(names)}")
    textures = {name: _texture(values, name) for name in names}
    feedback = values.number("feedback_pass", int, -1, -1, count - 1)
    return Preset(passes, textures, None if feedback < 0 else feedback, values.overrides())


class _Values:
    """Keys with their values, and the file of each."""

    def __init__(self, path: Path, entries: dict[str, tuple[str, Path]]) -> None:
        self.path, self.entries = path, entries
        self.root = path.resolve().parent
        for _ in range(MAX_CLIMB):  # never the root of a file system
            self.root = self.root.parent if self.root.parent.parent != self.root.parent else self.root

    def read(self, text: str, path: Path, within: tuple[Path, ...]) -> None:
        """Add the entries of a text, which take precedence over those of the presets that it refers to."""
        own = path.resolve()
        if own in within or len(within) >= MAX_REFERENCES:
            raise InputError(f"{path}: presets refer to one another in a circle, or deeper than {MAX_REFERENCES}")
        entries: dict[str, tuple[str, Path]] = {}
        for line in text.splitlines():
            if match := _REFERENCE.match(line):
                at = self.file(match[1] or match[2], path, "#reference")
                included = shader_text(at, "a preset")
                self.read(included, at, (*within, own))
            elif not line.lstrip().startswith(("#", "//")) and (match := _ENTRY.match(line)):
                plain = re.split(r"\s+//|\s+#|;\s*$", match[4] or "")[0]
                entries[match[1]] = ((match[2] or match[3] or plain).strip(), path)
        self.entries |= entries

    def file(self, name: str, preset: Path, what: str) -> Path:
        """Return the path of a file that a preset names, inside its tree."""
        plain = name.replace("\\", "/")
        full = (preset.resolve().parent / plain).resolve() if "\0" not in plain else Path("/")
        if Path(plain).is_absolute() or re.match(r"[A-Za-z]:", plain) or not full.is_relative_to(self.root):
            raise InputError(
                f"{preset}: {what} names {name!r}, which lies outside of {self.root}; files of a preset lie at most "
                f"{MAX_CLIMB} folders above it"
            )
        return full

    def text(self, key: str, default: str | None) -> str:
        if key not in self.entries and default is None:
            raise InputError(f"{self.path}: {key} is missing")
        return self.entries[key][0] if key in self.entries else default or ""

    def path_of(self, key: str) -> Path:
        return self.file(self.text(key, None), self.entries[key][1], key)

    def number(self, key: str, kind: Callable[[str], Read], default: Read | None, low: float, high: float) -> Read:
        text = self.text(key, None if default is None else str(default))
        try:
            number = kind(text)
        except ValueError:
            number = None
        if number is None or not low <= number <= high:  # type: ignore[operator]
            raise InputError(f"{self.path}: {key} is a number from {low:g} to {high:g}, got {text!r}")
        return number

    def one_of(self, key: str, known: Mapping[str, Read], default: str) -> Read:
        text = self.text(key, default) or default
        if text.lower() not in known:
            raise InputError(f"{self.path}: {key} is one of {', '.join(known)}, got {text!r}")
        return known[text.lower()]

    def overrides(self) -> dict[str, float]:
        """Return all numbers; the shaders decide which of them are parameters."""
        overrides = {}
        for key, (text, _) in self.entries.items():
            try:
                number = float(text)
            except ValueError:
                continue
            if math.isfinite(number):
                overrides[key] = number
        return overrides


def _pass(values: _Values, i: int) -> PresetPass:
    alias = values.text(f"alias{i}", "")
    if alias and not _NAME.fullmatch(alias):
        raise InputError(f"{values.path}: alias{i} is a name, got {alias!r}")
    srgb = values.one_of(f"srgb_framebuffer{i}", _TRUTH, "false")
    float_ = values.one_of(f"float_framebuffer{i}", _TRUTH, "false")
    return PresetPass(
        values.path_of(f"shader{i}"),
        alias,
        "linear" if values.one_of(f"filter_linear{i}", _TRUTH, "false") else "nearest",
        values.one_of(f"wrap_mode{i}", _BORDERS, "clamp_to_border"),
        _sides(values, i),
        "rgba32f" if float_ else "rgba8_srgb" if srgb else "rgba8",
        values.number(f"frame_count_mod{i}", _integer, 0, 0, 1 << 24),
        values.one_of(f"mipmap_input{i}", _TRUTH, "false"),
    )


def _sides(values: _Values, i: int) -> tuple[Side, Side] | None:
    if not any(key in values.entries for key in (f"scale_type{i}", f"scale_type_x{i}", f"scale_type_y{i}")):
        return None
    sides = []
    for axis in "xy":
        # The entry of both axes wins over one of its own, as in the player (RetroArch, video_shader_parse.c).
        known = {name: name for name in _SCALES}
        type_key = f"scale_type{i}" if f"scale_type{i}" in values.entries else f"scale_type_{axis}{i}"
        type_ = values.one_of(type_key, known, "source")
        key = f"scale{i}" if f"scale{i}" in values.entries else f"scale_{axis}{i}"
        if type_ == "absolute":
            sides.append(Side(type_, float(values.number(key, _integer, None, 1, MAX_SIDE))))
        else:
            sides.append(Side(type_, values.number(key, float, 1.0, 1 / MAX_SCALE, MAX_SCALE)))
    return sides[0], sides[1]


def _integer(text: str) -> int:
    """Parse an integer; presets also write 800.0 and 1_, since the player ignores the text after the digits."""
    match = re.fullmatch(r"\s*([+-]?\d{1,9})(?:\.0*)?_?\s*", text)
    if match is None:
        raise ValueError
    return int(match[1])


def _texture(values: _Values, name: str) -> PresetTexture:
    if not _NAME.fullmatch(name):
        raise InputError(f"{values.path}: textures are names, got {name!r}")
    linear = values.one_of(f"{name}_linear", _TRUTH, "false")
    border = values.one_of(f"{name}_wrap_mode", _BORDERS, "clamp_to_border")
    mipmaps = values.one_of(f"{name}_mipmap", _TRUTH, "false")
    return PresetTexture(values.path_of(name), "linear" if linear else "nearest", border, mipmaps)


#: Version 120, since from 130 on some shaders declare an output but write gl_FragColor.
_DEFINES = {"PARAMETER_UNIFORM": "1", "__VERSION__": "120"}
_HALVES = re.compile(r"^[ \t]*#[ \t]*(?:el)?if.*\b(VERTEX|FRAGMENT)\b", re.MULTILINE)
_PARAMETER = re.compile(
    r'^[ \t]*#pragma[ \t]+parameter[ \t]+(\w+)[ \t]+"([^"\n]*)"[ \t]+(\S+)(?:[ \t]+(\S+)[ \t]+(\S+))?', re.MULTILINE
)
#: Declarations of uniforms that the player sets for each pass, which are variables of the prelude here.
_SET = re.compile(r"\buniform\s+(?:\w+\s+)??(?:vec2\s+(?P<names>\w+(?:\s*,\s*\w+)*)|mat4\s+MVPMatrix)\s*;")
_SIZE = re.compile(r"\w*(?:TextureSize|InputSize)|OutputSize")
_SAMPLER_OF = re.compile(r"(\w*?)(?:TextureSize|InputSize)")
#: The matrix from positions to clip space, both with (0, 0) and (1, 1) at corners of the picture.
_MATRIX = (
    "const mat4 MVPMatrix = mat4(2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, -1.0, 0.0, 1.0);"
)
#: Statements, without spaces, of vertex shaders that do not move the picture.
_STAYS = {
    "MVPMatrix*VertexCoord",
    "+".join(f"VertexCoord.{axis}*MVPMatrix[{i}]" for i, axis in enumerate("xyzw")),
}


def is_libretro(text: str) -> bool:
    """Return True if a text has a vertex and a fragment part."""
    return {match[1] for match in _HALVES.finditer(text)} == {"VERTEX", "FRAGMENT"}


def shader_parameters(text: str, file: str) -> dict[str, ShaderParameter]:
    """Parse ``#pragma parameter NAME "label" default low high step`` lines."""
    parameters = {}
    for name, label, *numbers in (match.groups() for match in _PARAMETER.finditer(text)):
        try:
            default, low, high = (None if number is None else float(number) for number in numbers)
        except ValueError:
            raise InputError(f"{file}: #pragma parameter {name} has a default and a range, got {numbers}") from None
        if default is None or not all(math.isfinite(number or 0.0) for number in (default, low, high)):
            raise InputError(f"{file}: #pragma parameter {name} has finite numbers, got {numbers}")
        if low is not None and high is not None and low > high:
            low = high = None  # some files swap them
        parameters[name] = ShaderParameter(name, FLOAT, default, low, high, label.strip())
    return parameters


def read_shader(text: str, path: Path, name: str, pictures: Iterable[str]) -> Shader:
    """Parse a shader; ``pictures`` are the names of samplers whose sizes it may read.

    Raises
    ------
    KernelError
        For invalid or unsupported GLSL, with file and line.
    """
    file, known = str(path), {f"{picture}Texture" for picture in pictures}
    sizes: dict[str, str] = {}
    for size in (size for match in _SET.finditer(text) for size in _sizes(match)):
        own = _SAMPLER_OF.fullmatch(size)
        if own is not None:
            sampler = f"{own[1]}Texture"
            if sampler not in known:
                raise InputError(f"{file}: {size} is the size of no picture that this pass has")
            sizes[size] = sampler
    plain = _SET.sub(_without, text)
    tokens, _ = preprocessed([(plain, file)], {**_DEFINES, "VERTEX": "1"}, path.parent)
    declared = ["vec2 OutputSize = pg_output_size;", _MATRIX]
    declared += [f"uniform sampler2D {sampler};" for sampler in sorted(set(sizes.values()))]
    declared += [f"vec2 {size} = vec2(textureSize({sampler}, 0));" for size, sampler in sizes.items()]
    prelude = f"{' '.join(declared)} {vertex_stage(tokens, file, _INPUTS).text}"
    return parse(
        plain, name=name, file=file, prelude=prelude, prelude_file=f"{file}, vertex half",
        defines={**_DEFINES, "FRAGMENT": "1"}, folder=path.parent, rows_up=False,
    )  # fmt: skip


def _sizes(declared: re.Match[str]) -> list[str]:
    """Return the names in a declaration that are sizes of pictures."""
    return [name for name in re.findall(r"\w+", declared["names"] or "") if _SIZE.fullmatch(name)]


def _without(declared: re.Match[str]) -> str:
    """Replace a declaration of the player's uniforms by spaces, so that the rest keeps its line and column."""
    text, names = declared[0], _sizes(declared)
    if len(names) == len(re.findall(r"\w+", declared["names"] or "")):
        return re.sub(r"\S", " ", text)
    for name in names:
        text = re.sub(rf"\b{name}\s*,|,\s*{name}\b", lambda match: re.sub(r"\S", " ", match[0]), text, count=1)
    return text


def _corner_value(variable: g.Variable) -> str:
    """Return the value of an attribute at a corner: a position, or white."""
    type_, name = variable.type.name, variable.name
    if type_ in ("vec2", "vec4") and name.endswith("Coord"):
        return "pg_corner" if type_ == "vec2" else "vec4(pg_corner, 0.0, 1.0)"
    if type_ == "vec4" and name.lower() == "color":
        return "vec4(1.0)"
    fail(variable.span, f"{name} has no value in a pass over a picture; VertexCoord, TexCoord and COLOR have")


_INPUTS = Inputs(_corner_value, keeps_place=lambda value, _: value in _STAYS)

#: Samplers of earlier frames → how many runs ago.
_EARLIER = {"Prev": 1} | {f"Prev{i}": i + 1 for i in range(1, 7)}
#: Parameters that sizes of passes depend on.
_CONSTANTS = frozenset({"output_scale"})
_COPIED = "uniform sampler2D t; void main() { gl_FragColor = texelFetch(t, ivec2(gl_FragCoord.xy), 0); }"


@dataclass(frozen=True)
class _Step:
    """A pass with its kernel, and the source of each sampler: a number (0 is the frame, n the result of pass n), or a
    word for earlier frames and feedback."""

    settings: PresetPass
    shader: Shader
    kernel: PixelKernel[Target]
    names: Mapping[str, int]


def read_libretro_preset(text: str, path: Path) -> ShaderEffect:
    """Read a preset as an effect.

    Raises
    ------
    InputError
        For an invalid preset, and for files that are missing or outside of its tree.
    KernelError
        For an unsupported shader, with file, line and caret.
    """
    return _effect(read_preset(text, path), {}, path)


def read_libretro_shader(text: str, path: Path) -> ShaderEffect:
    """Read a single shader as an effect: one pass as large as the viewport."""
    return _effect(Preset((PresetPass(path),), {}, None, {}), {path: text}, path)


def _effect(preset: Preset, texts: dict[Path, str], path: Path) -> ShaderEffect:
    file = str(path)
    parameters: dict[str, ShaderParameter] = {}
    steps: list[_Step] = []
    for number, preset_pass in enumerate(preset.passes, 1):
        if preset_pass.shader not in texts:
            read = shader_text(preset_pass.shader, f"shader{number - 1} of {file}")
            texts[preset_pass.shader] = read.replace("\r\n", "\n")
        text = texts[preset_pass.shader]
        if not is_libretro(text):
            raise InputError(f"{preset_pass.shader}: has not both halves, #if defined(VERTEX) and FRAGMENT")
        names = _pictures_of(preset, number)
        for name, parameter in shader_parameters(text, str(preset_pass.shader)).items():
            parameters.setdefault(name, replace(parameter, default=preset.overrides.get(name, parameter.default)))
        shader = read_shader(text, preset_pass.shader, f"{name_of(path)}.{number}", [*names, *_EARLIER, "Feedback"])
        steps.append(_Step(preset_pass, shader, PixelKernel[Target].of_shader(shader), names))
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
    """Map the sampler names of pass ``number``, counted from 1, to the picture that each reads; 0 is the frame."""
    numbers = {"": number - 1, "Orig": 0, f"PassPrev{number}": 0}
    for i, preset_pass in enumerate(preset.passes[: number - 1], 1):
        numbers |= {f"Pass{i}": i, f"PassPrev{number - i}": i}
        if preset_pass.alias:
            numbers[preset_pass.alias] = i
    return numbers


def _built(
    preset: Preset, steps: list[_Step], textures: Mapping[str, Target],
    pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec,
) -> Target:  # fmt: skip
    """Build the graph of a preset's passes."""
    specs = _specs(steps, float(values["output_scale"]), into)
    frame = pictures["frame"]
    if any(f"{name}Texture" in _samplers(step) for name in _EARLIER for step in steps):
        copy = small_kernel("frame", _COPIED)
        frame = copy(
            t=frame, into=TargetSpec(f"{into.name}.frame", format_named("rgba32f"), Computed("width", "height"))
        )
    results = [_read_as(frame, steps[0].settings)]
    for number, (step, spec) in enumerate(zip(steps, specs, strict=True), 1):
        samplers = {f"{name}Texture": results[i] for name, i in step.names.items()} | dict(textures)
        for name in _samplers(step):
            base = name.removesuffix("Texture")
            if name in samplers:
                continue
            if base in _EARLIER:
                samplers[name] = _read_as(previous(frame, _EARLIER[base]), steps[0].settings)
            elif name == "FeedbackTexture" and preset.feedback_pass is not None:
                at = preset.feedback_pass
                samplers[name] = _read_as(previous(specs[at]), steps[at + 1].settings if at + 1 < len(steps) else None)
            else:
                samplers[name] = results[number - 1]  # a sampler that is not set reads the first texture unit
        arguments: dict[str, Any] = {}
        for parameter in step.kernel.parameters:
            name = parameter.name
            if isinstance(parameter.type, ImageType):
                arguments[name] = samplers[name]
            elif name == "FrameCount":
                most = step.settings.frame_count_mod
                arguments[name] = FRAME_INDEX.map(partial(_begun_again, most)) if most else FRAME_INDEX
            elif name == "FrameDirection":
                arguments[name] = 1
            else:
                arguments[name] = values.get(
                    name, parameter.default if parameter.has_default else zero_of_type(parameter.type)
                )
        result = step.kernel.called(arguments, spec)
        results.append(_read_as(result, steps[number].settings) if number < len(steps) else result)
    return results[-1]


def _begun_again(most: int, frame: int) -> int:
    return frame % most


def _samplers(step: _Step) -> list[str]:
    return [p.name for p in step.kernel.parameters if isinstance(p.type, ImageType)]


def _read_as(picture: Target, reader: PresetPass | PresetTexture | None) -> Target:
    """Return a picture with the filter and border that a pass sets for its source, which hold for later passes too."""
    read_as = reader or PresetPass(Path())
    read = picture.border(read_as.border).filter(read_as.filter)
    return read.mipmaps() if read_as.mipmaps else read


def _specs(steps: list[_Step], scale: float, into: TargetSpec) -> list[TargetSpec]:
    """Return a target for each pass; the last one's has the caller's name and format."""
    viewport: tuple[Formula, Formula] = (("mul", "width", scale), ("mul", "height", scale))
    size: tuple[Formula, Formula] = ("width", "height")
    specs = []
    for number, step in enumerate(steps, 1):
        last, sides = number == len(steps), step.settings.sides
        if sides is not None:
            size = (sides[0].formula(size[0], viewport[0]), sides[1].formula(size[1], viewport[1]))
        elif last:
            size = viewport
        spec = into if last else target(f"{into.name}.{number}", step.settings.format)
        specs.append(replace(spec, size=Computed(*size)))
    return specs
