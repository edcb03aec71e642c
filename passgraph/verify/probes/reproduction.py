"""Write a fact that a specification does not allow as a folder that shows it without passgraph."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.verify.probes import gl_bench, opencl_bench, webgpu_bench
from passgraph.verify.probes.kept import Results
from passgraph.verify.probes.probe import DTYPES, NAMES, Expression, Language, Program, Said
from passgraph.verify.probes.table import PROBES
from passgraph.writing import made_folder, write_files

#: Texts of the programs: they run in the folder that they are copied to, and are no modules of passgraph.
PROGRAMS = Path(__file__).parents[2] / "assets" / "reproduction"
#: Language → the library of its program, the file with the shader or kernel, and what writes that.
LIBRARIES: dict[Language, tuple[str, str, Callable[[Program], str]]] = {
    "glsl": ("moderngl", "probe.frag", gl_bench.fragment_text),
    "opencl": ("pyopencl", "probe.cl", opencl_bench.kernel_text),
    "wgsl": ("wgpu", "probe.wgsl", webgpu_bench.compute_text),
}
README = """{asks}: this device computes {got}, where {allowed} is allowed by {section}.

    pip install {packages}
    python reproduce.py

It prints what the device computed and what is allowed. The exit status is 1 if the results are not allowed.

device: {device}
passgraph: {passgraph}
date: {date}
system: {system}
{piglit}"""
PIGLIT = """
probe.shader_test is the same for Piglit: shader_runner probe.shader_test -auto -fbo
"""
#: Corners of Piglit's test; it draws rectangles.
_PIGLIT_HEAD = """# {asks}: {allowed} ({section})
[require]
GLSL >= {version}

[vertex shader passthrough]

[fragment shader]
{text}
[test]
"""
_PIGLIT_DRAW = """uniform uvec4 words {words}
uniform uint expected {expected}
draw rect -1 -1 2 2
probe all rgba 0.0 1.0 0.0 1.0
"""


def write_reproduction(name: str, results: Results, folder: Path) -> str:
    """Write the program of a probe, its arguments, and what is allowed of its results.

    Parameters
    ----------
    name : of a probe whose fact does not conform
    folder : is made in a folder that exists; its files are replaced

    Returns
    -------
    str
        Why there is no reproduction; empty if it was written. Only expressions have one, with a list of allowed
        results.
    """
    probe, language = PROBES[name], results.language
    expression, said = probe.expressions.get(language), probe.said.get(language)
    if expression is None or said is None or not said.allowed or language not in LIBRARIES:
        return "it is no expression with a list of allowed results"
    library, file, text_of = LIBRARIES[language]
    program = expression.program
    plain = {text: str(number) for number, text in NAMES.items()} | {"NaN": "nan", "∞": "inf", "-∞": "-inf"}
    allowed = [", ".join(plain.get(part, part) for part in one.split(", ")) for one in said.allowed]
    case = {
        "asks": probe.asks.replace("`", ""), "section": said.section, "allowed": allowed, "type": program.result,
        "rows": expression.rows.tolist(), "source": file, "options": list(program.options), "device": results.device,
        "conditions": results.conditions,
    }  # fmt: skip
    texts = {
        file: text_of(program), "case.json": json.dumps(case, indent=1) + "\n",
        "case.py": (PROGRAMS / "probe_case.py.txt").read_text(encoding="utf-8"),
        "reproduce.py": (PROGRAMS / f"{library}_probe.py.txt").read_text(encoding="utf-8"),
    }  # fmt: skip
    if language == "glsl" and len(allowed) == 1:
        texts["probe.shader_test"] = shader_test(case["asks"], said, expression, allowed[0])
    conditions = results.conditions
    texts["README.txt"] = README.format(
        asks=case["asks"], got=results.facts[name], allowed=" or ".join(said.allowed), section=said.section,
        packages=" ".join(f"{one}=={metadata.version(one)}" for one in ("numpy", library)), device=results.title,
        passgraph=conditions["passgraph"], date=conditions["date"], system=conditions["system"],
        piglit=PIGLIT if "probe.shader_test" in texts else "",
    )  # fmt: skip
    write_files(made_folder(folder), {path: text.encode() for path, text in texts.items()})
    return ""


def shader_test(asks: Any, said: Said, expression: Expression, allowed: str) -> str:
    """Return the expression as a test of Piglit: each row must draw green."""
    program = expression.program
    dtype = DTYPES[program.result]
    numbers = np.array([float(part) if dtype is np.float32 else int(part) for part in allowed.split(", ")], dtype)
    draws = [
        _PIGLIT_DRAW.format(words=" ".join(map(str, row)), expected=bits)
        for row, bits in zip(expression.rows.tolist(), numbers.view(np.uint32).tolist(), strict=True)
    ]
    head = _PIGLIT_HEAD.format(
        asks=asks, allowed=allowed, section=said.section, version=f"{max(program.version, 330) / 100:.2f}",
        text=gl_bench.piglit_text(program),
    )  # fmt: skip
    return head + "\n".join(draws)
