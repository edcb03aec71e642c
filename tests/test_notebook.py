"""How objects show themselves in a notebook."""

from __future__ import annotations

import re
from base64 import b64decode
from io import BytesIO
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.backends.registry import open_backend
from passgraph.verify import conformance
from passgraph.verify.compare import compare

TEXT = "def twice(color: Image, gain: float = 0.7) -> vec4: return 2.0 * gain / 0.7 * color[0, 0]  # a<b"
twice = pg.kernel(source=TEXT)
level = pg.kernel(source="def level(color: Image) -> float: return color[0, 0].r * 2.0")
FRAME = np.full((2, 3, 4), 0.25, np.float32)


def pictures(html: str) -> list[Image.Image]:
    return [Image.open(BytesIO(b64decode(data))) for data in re.findall(r'base64,([^"]*)"', html)]


def test_a_result_shows_each_picture_at_its_size() -> None:
    frame = pg.Input("frame")
    outputs = {"a<b": twice(frame, into=pg.target("a", "rgba32f")), "depth": level(frame, into=pg.target("d", "r32f"))}
    with pg.compile(outputs, backend="numpy") as program:
        shown = program(frame=FRAME)._repr_mimebundle_()
    assert shown["text/plain"] == "a<b: 3x2, 4 channels, float32\ndepth: 3x2, 1 channels, float32"
    assert "a&lt;b: 3x2, 4 channels, float32; as stored" in shown["text/html"]
    first, second = pictures(shown["text/html"])
    assert (first.size, first.getpixel((0, 0)), second.size) == ((3, 2), (128, 128, 128), (3, 2))
    assert shown["text/html"].count('width="3" height="2"') == 2


def test_a_huge_result_is_shown_with_fewer_texels_at_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.notebook.MOST_PIXELS", 100)
    html = pg.Result({"a": np.zeros((30, 20, 3), np.float32)})._repr_mimebundle_()["text/html"]
    assert pictures(html)[0].size == (7, 10)
    assert 'width="20" height="30"' in html
    assert "every 3 texels" in html


def drawing(svg: str) -> tuple[list[str], int]:
    """Texts and lines of a drawing that is well-formed."""
    root = ElementTree.fromstring(svg)
    space = "{http://www.w3.org/2000/svg}"
    return [text.text or "" for text in root.iter(f"{space}text")], len(list(root.iter(f"{space}path")))


def test_a_target_shows_its_graph() -> None:
    first = twice(pg.Input("frame"), into=pg.target("a<b", "rgba16f"))
    second = twice(first, into=pg.target("out", "rgba8"))
    both = pg.kernel(source="def both(one: Image, two: Image) -> vec4: return one[0, 0] + two[0, 0]")
    shown = both(first, second)._repr_mimebundle_()
    texts, lines = drawing(shown["image/svg+xml"])
    assert {"frame", "input", "a<b", "twice → rgba16f", "out", "both"} <= {*texts}
    assert lines == 4
    assert drawing(pg.previous(pg.target("old", "rgba8"))._repr_mimebundle_()["image/svg+xml"]) == (
        ["old", "earlier run, rgba8"], 0,
    )  # fmt: skip


def test_a_kernel_shows_its_parameters_and_source() -> None:
    shown = twice._repr_mimebundle_()
    assert "<td>gain</td><td>float</td><td>0.7</td>" in shown["text/html"]
    assert "a&lt;b" in shown["text/html"]
    assert shown["text/plain"] == repr(twice)


def test_a_program_shows_its_plan_once_it_is_known() -> None:
    with pg.compile(twice(pg.Input("frame")), backend="numpy") as program:
        before = program._repr_mimebundle_()
        assert "frame" in drawing(before["image/svg+xml"])[0]
        assert "text/html" not in before
        program(frame=FRAME)
        shown, plan = program._repr_mimebundle_(), program.plan._repr_mimebundle_()
    assert shown["text/plain"] == f"program on numpy\n{plan['text/plain']}"
    for html in (shown["text/html"], plan["text/html"]):
        assert "<td>twice</td><td>frame</td><td>twice</td><td>3x2</td>" in html
        assert "<svg" in html
    assert program._repr_mimebundle_()["text/plain"] == "program on numpy: twice"  # closed


def test_reports_show_tables() -> None:
    target = twice(pg.Input("frame"), into=pg.target("out", "rgba32f"))
    report = compare(target, backends=["numpy"], frame=FRAME)._repr_mimebundle_()
    assert report["text/plain"].startswith("numpy: within bounds")
    assert "<td>numpy</td><td>out</td><td>out</td>" in report["text/html"]
    with open_backend("numpy") as backend:
        chosen = list(conformance.cases(["pictures"], quick=True))[:2]
        suite = conformance.run(backend, chosen)._repr_mimebundle_()
    assert suite["text/plain"] == "conformance of numpy: 2 cases, 0 not passed: passes"
    assert "<td>pictures</td><td>2</td><td>2</td>" in suite["text/html"]
