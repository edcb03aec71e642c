"""A shader file as an effect: from pictures and parameters to a target."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.glsl import Shader
from passgraph.glsl.unit import Note
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import Target, TargetSpec, target
from passgraph.language.types import ImageType, Struct, Type, component_count, element_of
from passgraph.language.uniform_layout import components
from passgraph.reading import read_bytes
from passgraph.shaders.containers.shader_images import read_behind, shown_beside

#: Most bytes of a file, with the textures in mpv files.
MAX_BYTES = 4 << 20
_COMMENT = re.compile(r"//[^\n]*|/\*(?:.*?\*/|.*)", re.DOTALL)


def shader_text(path: Path, what: str) -> str:
    """Return a file's text; bytes that are not UTF-8 become replacement characters, since comments have any encoding.

    Raises
    ------
    InputError
        For a file that cannot be read or is too large; ``what`` describes it in the message.
    """
    return read_bytes(path, what, MAX_BYTES).decode("utf-8", errors="replace")


#: A function from pictures and values by name, and the target to write into, to the last pass's target.
Build: TypeAlias = Callable[[Mapping[str, Target], Mapping[str, Any], TargetSpec], Target]


@dataclass(frozen=True)
class ShaderParameter:
    """A user parameter of a shader.

    Attributes
    ----------
    name : as in the shader
    type : a scalar or vector of the kernel language
    default : number or tuple; 0 if the shader has none
    low, high : ends of its range, a number or one for each component; None if the file has no range
    label : the label in the file; empty if there is none
    choices : choices of an int, label → number
    is_frame_time : True if it is the duration of a frame in seconds, which callers with a frame rate can set
    """

    name: str
    type: Type
    default: Any
    low: Any = None
    high: Any = None
    label: str = ""
    choices: Mapping[str, int] = field(default_factory=dict)
    is_frame_time: bool = False


@dataclass(frozen=True, eq=False)
class ShaderEffect:
    """The effect of a shader file, returned by `passgraph.load_shader`.

    Call it with a picture (a target or input) for each of ``images``, in order or by name, and with parameters by name:
    numbers, or `passgraph.Value` handles for values that change from run to run. Omitted pictures, after the first, are
    black and transparent.

    Attributes
    ----------
    name : the name, from the file's
    kind : the format: "ISF", "gl-transition", "Shadertoy", "mpv", "libretro", "GLSL"
    summary : the file's own description, a line
    credit : the author in the file
    images : names of its pictures; the first is the frame (none for generators)
    parameters : parameters by name
    notes : parts that depend on the driver, each with its line
    constants : parameters that sizes of passes depend on; they must be numbers, not a `passgraph.Value`
    signals : "keyboard" and "audio", if the shader reads them: inputs of its graph that are black unless a run sets
        them
    """

    name: str
    kind: str
    summary: str
    credit: str
    images: tuple[str, ...]
    parameters: Mapping[str, ShaderParameter]
    notes: tuple[Note, ...]
    file: str
    build: Build = field(repr=False)
    constants: frozenset[str] = frozenset()
    signals: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if "into" in (*self.images, *self.parameters):
            raise InputError(
                f"{self.file}: calls a parameter or picture 'into', as effects call the target that they draw into; "
                "give it another name"
            )

    def __call__(self, /, *pictures: Target, into: TargetSpec | None = None, **parameters: Any) -> Target:
        """Build the graph of the shader's passes.

        Raises
        ------
        passgraph.InputError
            For too many pictures, an unknown parameter, a value outside its range or of another shape, and a
            `passgraph.Value` for one of ``constants``.
        """
        if len(pictures) > len(self.images):
            takes = ", ".join(self.images) or "none"
            raise InputError(f"{self.file}: takes {len(self.images)} picture(s) ({takes}), got {len(pictures)}")
        named = dict(zip(self.images, pictures, strict=False))
        for name in [name for name in parameters if name in self.images]:
            if name in named:
                raise InputError(f"{self.file}: picture {name!r} is given twice")
            named[name] = parameters.pop(name)
        if self.images and self.images[0] not in named:
            raise InputError(f"{self.file}: picture {self.images[0]!r} is missing")
        for name, picture in named.items():
            arguments.instance(picture, Target, f"{self.file}: picture {name!r}", "a target or pg.Input", InputError)
        values = {name: parameter.default for name, parameter in self.parameters.items()}
        for name, value in parameters.items():
            if name not in self.parameters:
                near = arguments.near(name, list(self.parameters))
                known = ", ".join(self.parameters) or "none"
                raise InputError(f"{self.file}: there is no parameter {name!r}{near}; there are {known}")
            values[name] = value if isinstance(value, (Value, Derived)) else checked(self, name, value)
        for name in sorted(self.constants & values.keys()):
            if not isinstance(values[name], (int, float)):
                got = arguments.shown(values[name])
                raise InputError(
                    f"{self.file}: parameter {name!r}, which sizes of passes come from, must be a number that is known "
                    f"when the graph is made, got {got}"
                )
        written = target(self.name, "rgba16f", scale=1.0) if into is None else into
        output = self.build(named, values, written)
        frame = named.get(self.images[0]) if self.images else None
        if frame is None or frame.spec in read_behind(output):
            return output
        # A shader that never samples its input still produces an output of the input's size.
        output = self.build(named, values, replace(written, name=f"{written.name}.drawn"))
        # Some formats define the size of the result.
        return shown_beside(
            output, [frame], written if output.spec.size == written.size else replace(written, size=None)
        )


def checked(effect: ShaderEffect, name: str, value: Any) -> Any:
    """Check a number or vector against the file's range; choices may be given by label too."""
    parameter, where = effect.parameters[name], f"{effect.file}: parameter {name!r}"
    if isinstance(value, str):
        if value not in parameter.choices:
            known = ", ".join(parameter.choices) or "a number"
            raise InputError(f"{where} is one of {known}; got {arguments.shown(value)}")
        return parameter.choices[value]
    flat = components(value, parameter.type, where).tolist()
    for low, high, number in zip(_spread(parameter.low, flat), _spread(parameter.high, flat), flat, strict=True):
        if (low is not None and number < low) or (high is not None and number > high):
            raise InputError(f"{where} is from {parameter.low} to {parameter.high}, got {value}")
    return value


def _spread(limit: Any, flat: list[float]) -> list[Any]:
    return list(limit) if isinstance(limit, (list, tuple)) else [limit] * len(flat)


def notes_of(shaders: Iterable[Shader]) -> tuple[Note, ...]:
    """Return the notes of several shaders, each once: passes share their text."""
    notes = {(note.span.file, note.span.line, note.text): note for shader in shaders for note in shader.notes}
    return tuple(notes.values())


def without_comments(text: str) -> str:
    """Blank out comments of GLSL; lines and columns keep their numbers."""
    return _COMMENT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def uniforms_of(shader: Shader) -> tuple[list[str], dict[str, ShaderParameter]]:
    """Return the names of a shader's pictures, and its other uniforms as parameters."""
    images = [u.name for u in shader.uniforms if isinstance(u.type, ImageType)]
    parameters = {
        u.name: ShaderParameter(u.name, u.type, u.default if u.has_default else zero_of_type(u.type))
        for u in shader.uniforms
        if not isinstance(u.type, (ImageType, Struct))
    }
    return images, parameters


def zero_of_type(type_: Type) -> Any:
    """Return 0 in the host's representation of a type."""
    zero: Any = {"bool": False, "int": 0, "float": 0.0}.get(element_of(type_).name, 0)
    count = component_count(type_)
    return zero if count == 1 else (zero,) * count


def name_of(path: Path) -> str:
    """Return a name for targets and passes, from a file's name.

    >>> name_of(Path("My Shader.v2.fs"))
    'My Shader.v2'
    """
    return path.stem or path.name
