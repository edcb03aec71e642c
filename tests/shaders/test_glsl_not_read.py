"""Valid GLSL that is not read: the table of `docs/shaders.md`, each row with its error."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from passgraph.errors import KernelError
from passgraph.glsl import parse

PAGE = Path(__file__).parents[2] / "docs" / "shaders.md"
TABLE = PAGE.read_text().split("### What is not read")[1].split("\n### ")[0]
#: The words or texts of a row, and what their error says.
ROWS = [
    (re.findall(r"`([^`]*)`", words), error.strip(" `"))
    for words, error in re.findall(r"^\| (`.*) \| (`.*`) \|$", TABLE, re.MULTILINE)
]
CASES = [(word, error) for words, error in ROWS for word in words]
_PLAIN = "out vec4 o; void main() { o = vec4(1.0); }"


def texts(word: str) -> list[str]:
    """Return shaders with a word, or a text, of the table."""
    if word.startswith("in "):
        return [f"{word}; out vec4 o; void main() {{ o = vec4(a{'.b' * ('{' in word)}, 1.0); }}"]
    if word.startswith("out "):
        return [f"{word}; void main() {{ a = ivec4(1); }}"]
    if word == "void f() { discard; }":
        return [f"{word} void main() {{ f(); }}"]
    if word == "float a[1025];":
        return [f"out vec4 o; void main() {{ {word} a[3] = 1.0; o = vec4(a[3]); }}"]
    if word.endswith((" t", " a", " in", ")")) and " " in word:
        name = word.split()[0]
        return [f"uniform {word}; {_PLAIN}" if name in ("texture2D", "sampler") else f"{word}; {_PLAIN}"]
    if word.startswith("gl_"):
        return [f"out vec4 o; void main() {{ o = vec4({word}); }}"]
    if re.match(r"(image\dD|uimage|atomic_|[iu]?sampler|double|d(vec|mat)|int64|float16)", word):
        return [f"uniform {word} a; {_PLAIN}", f"out vec4 o; void main() {{ {word} a; o = vec4(1.0); }}"]
    return [f"out vec4 o; void main() {{ o = vec4({word}(1.0)); }}"]


def test_the_table_is_read() -> None:
    assert len(ROWS) == len(re.findall(r"^\| `", TABLE, re.MULTILINE)) == 21
    assert len(CASES) == len({word for word, _ in CASES})


@pytest.mark.parametrize(("word", "error"), CASES)
def test_what_is_not_read_is_refused_with_its_error(word: str, error: str) -> None:
    says = f": {word.split()[0].split('(')[-1]} {error}" if error.startswith(("is ", "belongs ")) else error
    for text in texts(word):
        with pytest.raises(KernelError, match=f"<shader>:2: .*{re.escape(error)}") as raised:
            parse("#version 430 compatibility\n" + text)
        assert says in str(raised.value), text


def test_functions_that_nothing_calls_may_use_what_is_not_read() -> None:
    used = """vec4 f(samplerCube s, usampler2D t) { return textureCube(s, vec3(1.0)); }
float g() { return noise1(gl_SampleID) + gl_LightSource.x; } float h(dvec2 x) { return 1.0; }"""
    assert parse(f"#version 430 compatibility\n{used} {_PLAIN}").program.results
