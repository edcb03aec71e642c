"""Tests of piglit (repository Igalia/piglit): ``.shader_test`` files that draw with a fragment shader alone.

The vertex shaders of these tests place a rectangle over the window and hand nothing to the fragment shader, which runs
here as a pixel kernel. Nothing of the suite is kept in this repository.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.errors import PassgraphError
from tests.suites.judgment import Backends, Judgment, arguments_of

#: Pixels along each side of piglit's window.
WINDOW = 250
#: piglit's tolerance of a channel (``tests/util/piglit-util-gl.c``: 8-bit framebuffers, and 0.01 at most).
ALLOWED = 0.01
_SECTION = re.compile(r"^\[(.*)\]\s*$", re.MULTILINE)
#: What a fragment shader may take from a vertex shader, or from the fixed functions before GLSL 1.40.
_FROM_VERTEX = re.compile(
    r"\b(varying|gl_TexCoord|gl_Color|gl_SecondaryColor|gl_FogFragCoord|gl_FrontFacing|gl_PointCoord|gl_FragDepth"
    r"|gl_ClipDistance|gl_ModelView\w*|gl_Light\w*|gl_Front\w*|gl_Fog\b)|^\s*(?:flat|smooth|noperspective|centroid)?\s*in\b",
    re.MULTILINE,
)  # fmt: skip
_REACH = re.compile(
    r"clear|clear color .*|draw rect -1 -1 2 2|probe (all )?(rgba?|red) .*|relative probe rgba? .*"
    r"|uniform (?!.*\bmat).*|ortho|draw rect ortho .*"
)
_TYPES = {"float", "int", "uint", "vec2", "vec3", "vec4", "ivec2", "ivec3", "ivec4", "uvec2", "uvec3", "uvec4"}


@dataclass
class Case:
    """A test: its fragment shader, the uniforms it sets, and the pixels it expects after its only draw."""

    name: str
    fragment: str
    uniforms: dict[str, tuple[float, ...]] = field(default_factory=dict)
    probes: list[tuple[float | None, float | None, tuple[float, ...]]] = field(default_factory=list)


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
    """Return a test, or None if it needs more than a fragment shader over one rectangle."""
    fragment, required = sections.get("fragment shader"), sections.get("require", "")
    known = {"require", "fragment shader", "test", "vertex shader", "vertex shader passthrough"}
    if fragment is None or "test" not in sections or not sections.keys() <= known or _FROM_VERTEX.search(fragment):
        return None
    if re.search(r"^\s*(GL_|SIZE|depthbuffer|fbo)", required, re.MULTILINE) or "sampler" in fragment:
        return None
    case = Case(name, fragment)
    for line in sections["test"].splitlines():
        line = line.split("#")[0].strip()
        if not line:
            continue
        if not _REACH.fullmatch(line):
            return None
        if line.startswith("uniform ") and not (case.probes or _read_uniform(case, line)):
            return None
        if "probe" in line:
            case.probes.append(_probe(line))
        if case.probes and line.startswith(("uniform", "draw")):
            return None  # several draws
    return case if case.probes else None


def _read_uniform(case: Case, line: str) -> bool:
    _, kind, name, *words = re.sub("[,;]", " ", line).split()
    if kind not in _TYPES or not words:
        return False
    case.uniforms[name] = tuple(_number(word, kind) for word in words)
    return True


def _number(word: str, kind: str) -> float:
    """Return a number; hexadecimal digits are the bits of a float, as piglit's ``strtof_hex`` reads them."""
    if not word.startswith("0x"):
        return float(word)
    bits = int(word, 16)
    return float(np.uint32(bits).view(np.float32)) if kind.startswith(("float", "vec")) else float(bits)


def _probe(line: str) -> tuple[float | None, float | None, tuple[float, ...]]:
    """Return where a pixel is, in window coordinates or None for all of them, and the channels that it must have."""
    relative = line.startswith("relative")
    numbers = [float(word) for word in re.findall(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", line)]
    if "all" in line:
        return None, None, tuple(numbers)
    x, y, *color = numbers
    return (x * WINDOW, y * WINDOW, tuple(color)) if relative else (x, y, tuple(color))


def judge(case: Case, backends: Backends) -> dict[str, Judgment]:
    """Return how a test went on each backend; it is parsed once."""
    try:
        kernel = pg.kernel(glsl=case.fragment.strip() + "\n", name="suite")
    except PassgraphError as error:
        return dict.fromkeys(backends, Judgment.refused(error))
    return {name: _run(case, kernel, backend) for name, backend in backends.items()}


def _run(case: Case, kernel: pg.Kernel, backend: Backend | str) -> Judgment:
    try:
        arguments = arguments_of(kernel, case.uniforms)
        made: Any = kernel(**arguments, into=pg.target("result", "rgba32f", size=(WINDOW, WINDOW)), name="suite")
        with pg.compile({"result": made}, backend=backend, non_finite="keep") as program:
            picture = np.clip(program()["result"][::-1], 0.0, 1.0)  # window coordinates go up
    except PassgraphError as error:
        return Judgment.refused(error)
    for x, y, color in case.probes:
        seen = picture if x is None or y is None else picture[int(y), int(x)]
        off = np.abs(seen[..., : len(color)] - np.clip(color, 0.0, 1.0)).max()
        if not off <= ALLOWED:
            return Judgment("wrong", f"pixel {x}, {y} is off by {off:.3g}")
    return Judgment("right")
