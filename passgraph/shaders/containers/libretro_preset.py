"""What a libretro preset says (``.glslp``): ``key = value`` lines for passes, textures and parameters."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from passgraph.errors import InputError
from passgraph.graph.formulas import Formula
from passgraph.graph.targets import MAX_SIDE
from passgraph.shaders.containers.text import shader_text

MAX_PASSES, MAX_TEXTURES, MAX_REFERENCES = 64, 32, 16
#: How far above the preset's own folder its files may lie: trees of presets share shaders and pictures.
MAX_CLIMB = 4
#: Largest factor of a size.
MAX_SCALE = 64.0
#: What the player calls the rule for reads outside of a picture → what it is called here.
_BORDERS = {
    "clamp_to_border": "zero", "clamp_to_edge": "clamp", "repeat": "repeat", "mirrored_repeat": "mirror",
}  # fmt: skip
_SCALES = ("source", "viewport", "absolute")
_TRUTH = {"true": True, "1": True, "false": False, "0": False}
_NAME = re.compile(r"[A-Za-z_]\w{0,63}")
#: The last quotation mark may be missing.
_ENTRY = re.compile(r"""\s*([A-Za-z_]\w*)\s*=\s*(?:"([^"]*)"?|'([^']*)'?|(.*))""")
_REFERENCE = re.compile(r"""\s*#reference\s+(?:"([^"]+)"|(\S+))""")
Read = TypeVar("Read")


@dataclass(frozen=True)
class Side:
    """One side of a pass: ``by`` so many times the source's or the viewport's, or so many pixels."""

    type: str
    by: float

    def formula(self, source: Formula, viewport: Formula) -> Formula:
        """Its pixels."""
        if self.type == "absolute":
            return self.by
        whole = source if self.type == "source" else viewport
        return whole if self.by == 1 else ("floor", ("mul", whole, self.by))


@dataclass(frozen=True)
class PresetPass:
    """One pass, and how it and whoever else reads the picture that it starts from reads it.

    Attributes
    ----------
    shader : its file
    sides : None where nothing is said: as large as its source, the last pass as the viewport
    format : of its target
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
    """A picture that the preset brings."""

    path: Path
    filter: str
    border: str
    mipmaps: bool


@dataclass(frozen=True)
class Preset:
    """A preset that was read; ``overrides`` are the numbers that it has for names which may be parameters."""

    passes: tuple[PresetPass, ...]
    textures: Mapping[str, PresetTexture]
    feedback_pass: int | None
    overrides: Mapping[str, float]


def is_preset(text: str) -> bool:
    """Whether a text counts shaders or refers to another preset."""
    return re.search(r"""^\s*(?:shaders\s*=\s*["']?\d|#reference\s)""", text, re.MULTILINE) is not None


def read_preset(text: str, path: Path) -> Preset:
    """What a preset says, once the presets that it refers to are read.

    Raises
    ------
    InputError
        For what is wrong, missing, or leads out of the tree.
    """
    values = _Values(path, {})
    values.read(text, path, ())
    count = values.number("shaders", _whole, None, 1, MAX_PASSES)
    passes = tuple(_pass(values, i) for i in range(count))
    names = [name.strip() for name in values.text("textures", "").split(";") if name.strip()]
    if len(names) > MAX_TEXTURES:
        raise InputError(f"{path}: a preset has at most {MAX_TEXTURES} textures, got {len(names)}")
    textures = {name: _texture(values, name) for name in names}
    feedback = values.number("feedback_pass", int, -1, -1, count - 1)
    return Preset(passes, textures, None if feedback < 0 else feedback, values.overrides())


class _Values:
    """Keys with their values, and the file that each stands in."""

    def __init__(self, path: Path, entries: dict[str, tuple[str, Path]]) -> None:
        self.path, self.entries = path, entries
        self.root = path.resolve().parent
        for _ in range(MAX_CLIMB):  # never the root of a file system: all files lie there
            self.root = self.root.parent if self.root.parent.parent != self.root.parent else self.root

    def read(self, text: str, path: Path, within: tuple[Path, ...]) -> None:
        """Add what a text says; it goes before what the presets that it refers to say."""
        own = path.resolve()
        if own in within or len(within) >= MAX_REFERENCES:
            raise InputError(f"{path}: presets refer to one another in a circle, or deeper than {MAX_REFERENCES}")
        said: dict[str, tuple[str, Path]] = {}
        for line in text.splitlines():
            if match := _REFERENCE.match(line):
                at = self.file(match[1] or match[2], path, "#reference")
                told = shader_text(at, "a preset")
                self.read(told, at, (*within, own))
            elif not line.lstrip().startswith(("#", "//")) and (match := _ENTRY.match(line)):
                plain = re.split(r"\s+//|\s+#|;\s*$", match[4] or "")[0]
                said[match[1]] = ((match[2] or match[3] or plain).strip(), path)
        self.entries |= said

    def file(self, name: str, beside: Path, what: str) -> Path:
        """A file that a preset names, in the tree around it."""
        plain = name.replace("\\", "/")
        full = (beside.resolve().parent / plain).resolve() if "\0" not in plain else Path("/")
        if Path(plain).is_absolute() or re.match(r"[A-Za-z]:", plain) or not full.is_relative_to(self.root):
            raise InputError(
                f"{beside}: {what} names {name!r}, which lies outside of {self.root}; files of a preset lie at most "
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
            found = kind(text)
        except ValueError:
            found = None
        if found is None or not low <= found <= high:  # type: ignore[operator]
            raise InputError(f"{self.path}: {key} is a number from {low:g} to {high:g}, got {text!r}")
        return found

    def one_of(self, key: str, known: Mapping[str, Read], default: str) -> Read:
        text = self.text(key, default) or default
        if text.lower() not in known:
            raise InputError(f"{self.path}: {key} is one of {', '.join(known)}, got {text!r}")
        return known[text.lower()]

    def overrides(self) -> dict[str, float]:
        """Whatever is a number: only who has read the shaders knows which of it are parameters."""
        found = {}
        for key, (text, _) in self.entries.items():
            try:
                number = float(text)
            except ValueError:
                continue
            if math.isfinite(number):
                found[key] = number
        return found


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
        values.number(f"frame_count_mod{i}", _whole, 0, 0, 1 << 24),
        values.one_of(f"mipmap_input{i}", _TRUTH, "false"),
    )


def _sides(values: _Values, i: int) -> tuple[Side, Side] | None:
    if not any(key in values.entries for key in (f"scale_type{i}", f"scale_type_x{i}", f"scale_type_y{i}")):
        return None
    sides = []
    for axis in "xy":
        known = {name: name for name in _SCALES}
        type_ = values.one_of(f"scale_type_{axis}{i}", known, values.text(f"scale_type{i}", "source"))
        key = f"scale_{axis}{i}" if f"scale_{axis}{i}" in values.entries else f"scale{i}"
        if type_ == "absolute":
            sides.append(Side(type_, float(values.number(key, _whole, None, 1, MAX_SIDE))))
        else:
            sides.append(Side(type_, values.number(key, float, 1.0, 1 / MAX_SCALE, MAX_SCALE)))
    return sides[0], sides[1]


def _whole(text: str) -> int:
    """A whole number, which presets write as 800.0 and as 1_ too: the player stops where digits end."""
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
