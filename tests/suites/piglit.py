"""Tests of piglit (repository Igalia/piglit): ``.shader_test`` files that draw rectangles.

The fragment shader runs here as a pixel kernel. If it reads outputs of the vertex shader, that runs at the corners, as
that of a pair of files does. Nothing of the suite is kept in this repository.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.errors import PassgraphError
from passgraph.glsl import parse
from passgraph.glsl.preprocess import EXTENSIONS, preprocessed
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Target
from passgraph.shaders.containers.vertex_stage import vertex_stage
from passgraph.shaders.containers.viewer_inputs import viewer_inputs
from tests.suites.judgment import Backends, Judgment, arguments_of

#: Pixels along each side of piglit's window.
WINDOW = 250
#: piglit's tolerance of a channel (``tests/util/piglit-util-gl.c``: 8-bit framebuffers, and 0.01 at most).
ALLOWED = 0.01
_SECTION = re.compile(r"^\[(.*)\]\s*$", re.MULTILINE)
_SECTIONS = {"require", "fragment shader", "test", "vertex shader", "vertex shader passthrough"}
#: What a fragment shader may take from a vertex shader.
_FROM_VERTEX = re.compile(
    r"\b(varying|gl_TexCoord|gl_Color|gl_SecondaryColor)\b|^\s*(?:smooth|centroid)?\s*in\b", re.MULTILINE
)
#: What no pass over a picture has: lights and matrices of fixed functions, clipping, ints of vertices.
_BEYOND = re.compile(
    r"\bsampler|\bgl_(ClipDistance|ClipVertex|CullDistance|Light\w*|ModelView\w*Inverse\w*|Texture\w*|FrontMaterial"
    r"|BackColor|FrontLight\w*|Fog\w*|PointSize|PointCoord|FragDepth|Point|SampleID|Layer)\b"
    r"|^\s*(flat|noperspective)\b",
    re.MULTILINE,
)
#: Extensions whose language is read, besides those that the preprocessor names.
_READ = {
    *EXTENSIONS, "GL_ARB_gpu_shader5", "GL_MESA_shader_integer_functions", "GL_EXT_shader_integer_mix",
    "GL_ARB_shading_language_420pack", "GL_ARB_shader_precision", "GL_MAX_FRAGMENT_UNIFORM_COMPONENTS",
    "GL_MAX_VERTEX_UNIFORM_COMPONENTS", "GL_ARB_explicit_uniform_location", "GL_EXT_gpu_shader4",
    "GL_ARB_ES3_compatibility",
}  # fmt: skip
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_TYPE = re.compile(r"float|int|uint|[iu]?vec[234]|mat[234](x[234])?")

#: Where a color is expected, or a rectangle drawn: x, y, width and height in pixels.
Area: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True)
class Clear:
    color: tuple[float, ...]


@dataclass(frozen=True)
class Draw:
    area: Area
    uniforms: dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Probe:
    area: Area
    color: tuple[float, ...]


@dataclass
class Case:
    """A test: its shaders (no vertex shader if the other takes nothing from it), and what it does, in order."""

    name: str
    fragment: str
    vertex: str = ""
    has_matrix: bool = True  # True if vertices go through the matrix that ``ortho`` sets, to pixels
    steps: list[Clear | Draw | Probe] = field(default_factory=list)


def cases_of(suite: Path) -> Iterator[Case]:
    """Yield the tests in reach, of a checkout of the suite."""
    for file in sorted((suite / "tests").rglob("*.shader_test")):
        text = file.read_text(errors="replace")
        parts = _SECTION.split(text)
        names = [name.lower() for name in parts[1::2]]
        if len(set(names)) < len(names):
            continue  # shaders that are linked
        case = _case(file.relative_to(suite / "tests").as_posix(), dict(zip(names, parts[2::2], strict=True)))
        if case is not None:
            yield case


def texts_of(suite: Path) -> Iterator[tuple[str, str, bool]]:
    """Yield name, text and True if it is valid, of the fragment shaders that are only compiled: GLSL, no extension."""
    for file in sorted((suite / "tests").rglob("*.frag")):
        text = file.read_text(errors="replace")
        result = re.search(r"expect_result:\s*(pass|fail)", text)
        needs = re.search(r"(require_extensions:\s*\S|check_link:\s*true|glsl_version:\s*4)", text)
        if result is not None and needs is None:
            yield file.relative_to(suite / "tests").as_posix(), text, result[1] == "pass"


def judge_text(text: str, is_valid: bool) -> Judgment:
    """Return how a text that is only compiled went."""
    try:
        pg.kernel(glsl=text, name="suite")
    except PassgraphError as error:
        return Judgment.refused(error) if is_valid else Judgment("right")
    return Judgment("right" if is_valid else "accepted")


def _case(name: str, sections: dict[str, str]) -> Case | None:
    """Return a test, or None if it needs more than a picture that two shaders and no texture make."""
    fragment, vertex = sections.get("fragment shader"), sections.get("vertex shader", "")
    if fragment is None or "test" not in sections or not sections.keys() <= _SECTIONS:
        return None
    required = {line.split()[0].lstrip("!") for line in sections.get("require", "").splitlines() if line.strip()}
    if any(word.startswith(("GL_", "SIZE", "depthbuffer", "fbo")) and word not in _READ for word in required):
        return None
    takes = _FROM_VERTEX.search(fragment) is not None or re.search(r"\buniform [^;]*=", vertex) is not None
    takes = takes or ("gl_FragCoord" in fragment and "gl_Position.w" in vertex)
    if _BEYOND.search(fragment) or (takes and (not vertex or _BEYOND.search(vertex))):
        return None
    has_matrix = "vertex shader" not in sections or re.search("ModelViewProjection|ftransform", vertex) is not None
    case = Case(name, fragment, vertex if takes else "", has_matrix and "vertex shader passthrough" not in sections)
    return case if _read_steps(case, sections["test"]) else None


def _read_steps(case: Case, text: str) -> bool:
    """Read the commands of a test; return False for one that is not known, and for a test that expects nothing."""
    color: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    uniforms: dict[str, tuple[float, ...]] = {}
    links, ortho = False, False
    for line in (line.split("#")[0].strip() for line in text.splitlines()):
        numbers = tuple(map(float, _NUMBER.findall(re.sub(r"\b[a-z]\w*", " ", line))))
        if line.startswith("clear color"):
            color = numbers
        elif line == "clear":
            case.steps.append(Clear(color))
        elif re.match(r"draw rect (ortho )?[-\d.]", line) and len(numbers) == 4:
            x, y, width, height = numbers
            area = (x, y, width, height) if ortho or "ortho" in line else _pixels(x, y, width, height)
            whole = area == (0.0, 0.0, WINDOW, WINDOW)
            if min(area[2:]) < 0 or (case.vertex and not whole):
                return False  # its back, or vertices elsewhere
            case.steps.append(Draw(area, dict(uniforms)))
        elif re.match(r"(relative )?probe (all |rect )?(rgba?|red) ", line):
            case.steps.append(_probe(line, numbers))
        elif line.startswith("uniform "):
            if not _read_uniform(uniforms, line):
                return False
        elif line == "link success":
            links = True
        elif line == "ortho":
            ortho = case.has_matrix
        elif line:
            return False
    return links or any(isinstance(step, Probe) for step in case.steps)


def _pixels(x: float, y: float, width: float, height: float) -> Area:
    """Return an area in pixels from one in clip space."""
    half = WINDOW / 2
    return (x + 1) * half, (y + 1) * half, width * half, height * half


def _read_uniform(uniforms: dict[str, tuple[float, ...]], line: str) -> bool:
    _, kind, name, *words = re.sub("[,;]", " ", line).split()
    if not _TYPE.fullmatch(kind) or not words:
        return False
    numbers = tuple(_number(word, kind) for word in words)
    uniforms[name] = uniforms[f"{name}[0]"] = numbers  # the name of an array is that of its first element
    return True


def _number(word: str, kind: str) -> float:
    """Return a number; hexadecimal digits are the bits of a float, as piglit's ``strtof_hex`` reads them."""
    if "0x" not in word:
        return float(word)
    bits = int(word, 16)
    is_float = kind.startswith(("float", "vec", "mat"))
    return float(np.uint32(bits % (1 << 32)).view(np.float32)) if is_float else float(bits)


def _probe(line: str, numbers: tuple[float, ...]) -> Probe:
    """Return an area, and the channels that its pixels must have; numbers behind them are for nothing."""
    channels = 4 if "rgba" in line else 3 if "rgb" in line else 1
    if "all" in line:
        return Probe((0.0, 0.0, WINDOW, WINDOW), numbers[:channels])
    scale = WINDOW if line.startswith("relative") else 1
    if "rect" in line:
        x, y, width, height = (number * scale for number in numbers[:4])
        return Probe((x, y, width, height), numbers[4 : 4 + channels])
    x, y, *color = numbers[: 2 + channels]
    column, row = (min(int(place * scale), WINDOW - 1) for place in (x, y))
    return Probe((column, row, 1.0, 1.0), tuple(color))


def kernel_of(case: Case) -> PixelKernel[Target]:
    """Parse a test's shaders."""
    fragment = case.fragment.strip() + "\n"
    prelude = ""
    if case.vertex:
        tokens, reader = preprocessed([(case.vertex.strip() + "\n", "vertex")], {}, None)
        prelude = vertex_stage(tokens, "vertex", viewer_inputs({}, []), reader.dialect).text
    return PixelKernel.of_shader(parse(fragment, name="suite", prelude=prelude, has_vertex_stage=bool(prelude)))


def judge(case: Case, backends: Backends) -> dict[str, Judgment]:
    """Return how a test went on each backend; it is parsed once."""
    try:
        kernel = kernel_of(case)
    except PassgraphError as error:
        return dict.fromkeys(backends, Judgment.refused(error))
    return {name: _run(case, kernel, backend) for name, backend in backends.items()}


def _run(case: Case, kernel: PixelKernel[Target], backend: Backend | str) -> Judgment:
    draws = [step for step in case.steps if isinstance(step, Draw)]
    if not draws:
        return Judgment("right")
    try:
        into = pg.target("result", "rgba32f", size=(WINDOW, WINDOW))
        made: Any = kernel(**arguments_of(kernel, draws[0].uniforms), into=into, name="suite")
        with pg.compile({"result": made}, backend=backend, non_finite="keep") as program:
            return _played(case, kernel, program)
    except PassgraphError as error:
        return Judgment.refused(error)


def _played(case: Case, kernel: PixelKernel[Target], program: Any) -> Judgment:
    """Return the judgment after all steps."""
    window = np.zeros((WINDOW, WINDOW, 4), np.float32)  # rows go up
    before: dict[str, tuple[float, ...]] | None = None
    for step in case.steps:
        if isinstance(step, Clear):
            window[:] = step.color
            continue
        seen = window[_within(step.area)]
        if isinstance(step, Draw):
            if before is not None and step.uniforms != before:
                for name, argument in arguments_of(kernel, step.uniforms).items():
                    program.set("suite", name, argument)
            before = step.uniforms
            drawn = program()["result"][::-1][_within(step.area)]
            if "discard" in case.fragment:  # pixels without a color keep the one before
                drawn = np.where(drawn.any(axis=-1, keepdims=True), drawn, seen)
            seen[:] = np.clip(drawn, 0.0, 1.0)
            continue
        off = np.abs(seen[..., : len(step.color)] - np.clip(step.color, 0.0, 1.0)).max()
        if not off <= ALLOWED:
            return Judgment("wrong", f"pixels in {step.area} are off by {off:.3g}")
    return Judgment("right")


def _within(area: Area) -> tuple[slice, slice]:
    """Return the rows and columns whose pixels have their center in an area."""
    x, y, width, height = area
    return slice(round(y), round(y + height)), slice(round(x), round(x + width))
