"""Cases of the Khronos conformance suite for OpenGL ES: its files, as kernels with values, or as text to refuse.

The suite (repository KhronosGroup/VK-GL-CTS) writes shaders in ``data/gles2``, ``gles3`` and ``gles31`` as text with
placeholders for inputs and outputs. A case that runs "both" in a vertex and in a fragment shader runs here as a pixel
kernel whose inputs are uniforms. Nothing of the suite is kept in this repository.
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
from tests.suites.judgment import Backends, Judgment, arguments_of, components_of

FOLDERS = ("gles2/shaders", "gles3/shaders", "gles31/shaders/es31")
#: The suite allows this difference of floats from its values (``glsShaderLibraryCase.cpp``).
ALLOWED = 0.05
_TOKENS = re.compile(
    r'(?P<comment>\#[^\n]*)|(?P<shader>""(?P<text>.*?)"")|(?P<string>"(?:[^"\\\n]|\\.)*")'
    r"|(?P<word>[A-Za-z_][\w.\[\]]*|[-+]?[\d.][\w.+-]*)|(?P<sign>[{}\[\]|=;(),<>&-])|\s+",
    re.DOTALL,
)


@dataclass(frozen=True)
class Value:
    """An input, output or uniform, and its numbers in each run of the case."""

    role: str
    type: str
    name: str
    runs: tuple[tuple[float, ...], ...]


@dataclass
class Case:
    """A case of the suite."""

    name: str
    version: str = "100"
    expects: str = "pass"
    both: str | None = None
    values: list[Value] = field(default_factory=list)
    others: set[str] = field(default_factory=set)

    @property
    def is_in_reach(self) -> bool:
        """Return True if the case is one text for any stage, without an extension of the language."""
        return self.both is not None and "require" not in self.others

    @property
    def is_invalid(self) -> bool:
        """Return True if a compiler must refuse the text."""
        return self.expects in ("compile_fail", "compile_or_link_fail")


def cases_of(suite: Path) -> Iterator[Case]:
    """Yield the cases of all files of a checkout of the suite."""
    for folder in FOLDERS:
        for file in sorted((suite / "data" / folder).glob("*.test")):
            yield from _cases(file, folder.split("/")[0])


def _cases(file: Path, start: str) -> Iterator[Case]:
    tokens = [match for match in _TOKENS.finditer(file.read_text()) if match.lastgroup not in (None, "comment")]
    path, at, case = [start, file.stem], 0, Case("")
    while at < len(tokens):
        word, next_text = tokens[at].group(), tokens[at + 1].group() if at + 1 < len(tokens) else ""
        at += 1
        if word == "group":
            path.append(next_text)
            at += 1
        elif word == "case":
            case = Case("/".join([*path, next_text]), "300 es" if start != "gles2" else "100")
            path.append(next_text)
            at += 1
        elif word == "pipeline_program":
            case.others.add(word)
            path.append("")
        elif word == "end":
            if case.name == "/".join(path):
                yield case
                case = Case("")
            path.pop()
        elif word == "version":
            case.version = next_text + (" es" if tokens[at + 1].group() == "es" else "")
        elif word == "expect":
            case.expects = next_text
        elif word == "both":
            case.both = tokens[at]["text"].replace("\\\\", "\\")  # as the suite's own parser reads it
        elif word == "values":
            end = next(k for k in range(at, len(tokens)) if tokens[k].group() == "}")
            case.values += _values([token.group() for token in tokens[at + 1 : end]])
            at = end
        elif word in ("require", "vertex", "fragment", "geometry", "compute"):
            case.others.add(word)


def _values(words: list[str]) -> list[Value]:
    """Return the values between the braces of a block."""
    found, line = list[Value](), list[str]()
    for word in words:
        if word != ";":
            line.append(word)
            continue
        role, *types, name = line[: line.index("=")]
        lists, runs = line[line.index("=") + 1 :], [list[float]()]
        for item in lists:
            if item == "|":
                runs.append([])
            elif item in ("true", "false"):
                runs[-1].append(float(item == "true"))
            elif re.match(r"[-+]?[\d.]", item):
                runs[-1].append(float(int(item, 0)) if re.fullmatch(r"[-+]?(0[xX])?[\da-fA-F]+[uU]?", item.rstrip("uU"))
                                and "." not in item and "e" not in item.lower().replace("0x", "")
                                else float(item))  # fmt: skip
        found.append(Value(role, types[-1], name, tuple(tuple(run) for run in runs)))
        line = []
    return found


def _parts(value: Value) -> list[str]:
    """Return expressions of the components of an output, columns of matrices one after the other."""
    if value.type.startswith("mat"):
        columns, _, rows = value.type[3:].partition("x")
        return [f"{value.name}[{c}][{r}]" for c in range(int(columns)) for r in range(int(rows or columns))]
    count = components_of(value.type)
    return [value.name] if count == 1 else [f"{value.name}[{k}]" for k in range(count)]


def _stored(part: str, type_: str) -> list[str]:
    """Return float expressions that hold a component without loss: integers in two halves."""
    if type_.startswith(("int", "ivec")):
        return [f"float({part} & 65535)", f"float(({part} >> 16) & 65535)"]
    if type_.startswith(("uint", "uvec")):
        return [f"float({part} & 65535u)", f"float({part} >> 16u)"]
    return [f"float({part})"]


def shader_of(case: Case) -> tuple[str, int]:
    """Return the case as one fragment shader, and how many vec4 it writes."""
    assert case.both is not None
    outputs = [value for value in case.values if value.role == "output"]
    old = case.version.startswith("100")
    stored = [text for value in outputs for part in _parts(value) for text in _stored(part, value.type)]
    if old and any(value.type.startswith(("i", "u")) for value in outputs):
        stored = [f"float({part})" for value in outputs for part in _parts(value)]
    stored = stored or ["1.0"]
    stored += ["0.0"] * (-len(stored) % 4)
    count = len(stored) // 4
    rows = [", ".join(stored[4 * k : 4 * k + 4]) for k in range(count)]
    names = [f"gl_FragData[{k}]" if old else f"suite_result{k}" for k in range(count)]
    declared = [f"uniform {value.type} {value.name};" for value in case.values if value.role == "input"]
    declared += [f"{value.type} {value.name};" for value in outputs]
    if not old:
        declared += [f"layout(location = {k}) out vec4 {name};" for k, name in enumerate(names)]
    written = " ".join(f"{name} = vec4({row});" for name, row in zip(names, rows, strict=True))
    text = case.both.replace("${DECLARATIONS}", "\n".join(declared)).replace("${SETUP}", "")
    text = text.replace("${DECLARATIONS:single-line}", " ".join(declared)).replace("${OUTPUT}", written)
    for placeholder in ("${POSITION_FRAG_COLOR}", "${FRAG_COLOR}"):
        text = text.replace(placeholder, names[0])
    version = "#version 100\n#line 1\n" if old and "#version" not in text else ""
    return version + text.strip() + "\n", count


def judge(case: Case, backends: Backends) -> dict[str, Judgment]:
    """Return how a case went on each backend, or on each name if it is only compiled; it is parsed once."""
    try:
        text, count = shader_of(case)
        kernel = pg.kernel(glsl=text, name="suite")
    except PassgraphError as error:
        return dict.fromkeys(backends, Judgment("right") if case.is_invalid else Judgment.refused(error))
    if case.is_invalid:
        return dict.fromkeys(backends, Judgment("accepted"))
    return {name: _run(case, kernel, count, backend) for name, backend in backends.items()}


def _run(case: Case, kernel: pg.Kernel, count: int, backend: Backend | str) -> Judgment:
    """Return how each run of a case went on a backend."""
    try:
        into = tuple(pg.target(f"result{k}", "rgba32f", size=(1, 1)) for k in range(count))
        made: Any = kernel(**_arguments(case, kernel, 0), into=into if count > 1 else into[0], name="suite")
        outputs = {f"result{k}": target for k, target in enumerate(made if count > 1 else [made])}
        with pg.compile(outputs, backend=backend, non_finite="keep") as program:
            for run in range(max((len(value.runs) for value in case.values), default=1)):
                for name, argument in _arguments(case, kernel, run).items() if run else ():
                    program.set("suite", name, argument)
                results = program()
                numbers = np.concatenate([results[name][0, 0] for name in outputs])
                wrong = _difference(case, numbers, run)
                if wrong:
                    return Judgment("wrong", f"run {run}: {wrong}")
    except PassgraphError as error:
        return Judgment.refused(error)
    return Judgment("right")


def _arguments(case: Case, kernel: pg.Kernel, run: int) -> dict[str, Any]:
    return arguments_of(kernel, {value.name: value.runs[min(run, len(value.runs) - 1)] for value in case.values})


def _difference(case: Case, numbers: Any, run: int) -> str:
    """Return what differs from the suite's values; empty if nothing does."""
    at = 0
    for value in (value for value in case.values if value.role == "output"):
        expected = value.runs[min(run, len(value.runs) - 1)]
        whole = value.type.startswith(("int", "ivec", "uint", "uvec")) and not case.version.startswith("100")
        for component, due in enumerate(expected):
            if whole:
                got = int(numbers[at]) + (int(numbers[at + 1]) << 16)
                is_right = (got - int(due)) % (1 << 32) == 0
                at += 2
            else:
                got = float(numbers[at])
                is_right = abs(got - due) <= ALLOWED
                at += 1
            if not is_right:
                return f"{value.name}[{component}] is {got}, expected {due}"
    return ""
