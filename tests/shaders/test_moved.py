"""Vertex shaders that move the picture's corners, held against the original on OpenGL."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from originals import IsfFile, Original, Picture

import passgraph as pg

SIZE = (53, 31)
_CORNERS = ("a", "b", "c", "d")  # bottom left and right, top left and right
_HEADER = {
    "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]
    + [{"NAME": f"{one}{part}", "TYPE": "point2D", "DEFAULT": [0, 1]} for one in _CORNERS for part in ("", "_far")]
}
#: ``a`` and its like are places in clip space, ``a_far`` its z and w.
_VERTEX = """varying vec3 shade;
void main() {
    isf_vertShaderInit();
    bool right = gl_Position.x > 0.0, above = gl_Position.y > 0.0;
    vec2 at = above ? (right ? d : c) : (right ? b : a);
    vec2 far = above ? (right ? d_far : c_far) : (right ? b_far : a_far);
    shade = vec3(isf_FragNormCoord, 1.0 - isf_FragNormCoord.x);
    gl_Position = vec4(at, far);
}
"""
_FRAGMENT = """varying vec3 shade;
void main() {
    vec4 pixel = IMG_THIS_PIXEL(inputImage);
    gl_FragColor = vec4(shade.xy, 0.5 * isf_FragNormCoord.x + 0.5 * pixel.g, 1.0);
}
"""
_FLAT = (0.0, 1.0)
#: Places of the corners, with their z and w.
QUADS: dict[str, Any] = {
    "smaller": [(-0.51, -0.33, 0, 1), (0.62, -0.33, 0, 1), (-0.51, 0.71, 0, 1), (0.62, 0.71, 0, 1)],
    "turned": [(-0.1, -0.9, 0, 1), (0.9, -0.1, 0, 1), (-0.9, 0.1, 0, 1), (0.1, 0.9, 0, 1)],
    "mirrored": [(0.83, -0.7, 0, 1), (-0.77, -0.6, 0, 1), (0.8, 0.9, 0, 1), (-0.9, 0.8, 0, 1)],
    "any four corners": [(-0.9, -0.2, 0, 1), (0.4, -0.95, 0, 1), (-0.3, 0.8, 0, 1), (0.97, 0.1, 0, 1)],
    "corners that cross over": [(-0.9, -0.8, 0, 1), (0.9, 0.7, 0, 1), (-0.8, 0.75, 0, 1), (0.85, -0.7, 0, 1)],
    "a floor": [(-1.1, -0.9, 0, 1), (1.2, -0.9, 0, 1), (-1.1, 1.7, 0, 3), (1.2, 1.7, 0, 3)],
    "a floor that goes on behind the eye": [
        (-1.1, -0.4, 0, 1),
        (1.1, -0.4, 0, 1),
        (-1, 0.7, 0, -0.5),
        (1, 0.7, 0, -0.5),
    ],
    "what lies too far away": [(-0.9, -0.9, 0.4, 1), (0.9, -0.9, 0.4, 1), (-0.9, 0.9, 1.9, 1), (0.9, 0.9, 1.9, 1)],
    "beyond the picture": [(-3.1, -2.2, 0, 1), (2.3, -4.1, 0, 1), (-2.7, 3.3, 0, 1), (4.1, 2.9, 0, 1)],
    "a line": [(-0.9, -0.9, 0, 1), (0.9, 0.9, 0, 1), (-0.9, -0.9, 0, 1), (0.9, 0.9, 0, 1)],
    "nowhere": [(np.nan, 0, 0, 1), (0.9, np.inf, 0, 1), (0, 0, 0, 0), (0.9, 0.9, 0, -1)],
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "moved.vs").write_text(_VERTEX)
    made = tmp_path / "moved.fs"
    made.write_text(f"/*{json.dumps(_HEADER)}*/\n{_FRAGMENT}")
    return made


def picture() -> Picture:
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]].astype(np.float32)
    return np.stack([x / SIZE[0], y / SIZE[1], 0.5 + 0 * x, 1 + 0 * x], axis=-1)


def values(quad: Any) -> dict[str, Any]:
    given = {name: corner[:2] for name, corner in zip(_CORNERS, quad, strict=True)}
    return given | {f"{name}_far": corner[2:] for name, corner in zip(_CORNERS, quad, strict=True)}


def ours(file: Path, quad: Any, backend: str = "numpy", size: tuple[int, int] = SIZE) -> Picture:
    made = pg.load_shader(file)(pg.Input("inputImage"), into=pg.target("shown", "rgba32f", scale=1.0), **values(quad))
    with pg.compile(made, backend=backend, size=size) as program:
        return np.array(program(inputImage=picture())["shown"])


@pytest.mark.parametrize("name", QUADS)
def test_a_moved_picture_lies_where_the_original_draws_it(file: Path, context: moderngl.Context, name: str) -> None:
    run = Original(context, IsfFile(file), SIZE)
    run.show({"inputImage": picture()})
    drawn = run.draw(values(QUADS[name]))[-1]
    run.release()
    found = np.clip(ours(file, QUADS[name]), 0.0, 1.0)
    # Drivers snap corners to parts of a pixel: few pixels at edges may differ.
    shown = np.abs(found - drawn).max(axis=2) > 2 / 255
    assert shown.mean() <= 0.012
    covered = drawn[..., 3].mean()
    assert {"a line": covered < 0.02, "nowhere": covered == 0}.get(name, covered > 0.1)
    if name == "nowhere":
        assert not found.any()


@pytest.mark.parametrize("backend", ["gl", "opencl", "reference"])
def test_backends_move_pictures_alike(file: Path, backend: str) -> None:
    quad = QUADS["a floor that goes on behind the eye"]
    np.testing.assert_allclose(ours(file, quad, backend), ours(file, quad), atol=2e-5)


def test_a_square_has_as_many_pixels_as_it_is_large(file: Path) -> None:
    """Corners at middles of pixels: of those on its edges it has the left and the lower ones, whatever its diagonal."""
    size = (64, 32)
    (left, right), (low, high) = [-1 + 2 * (x + 0.5) / 64 for x in (10, 26)], [-1 + 2 * (y + 0.5) / 32 for y in (5, 21)]
    expected = np.zeros((32, 64))
    expected[32 - 21 : 32 - 5, 10:26] = 1
    for square in (
        [(x, y, *_FLAT) for y in (low, high) for x in (left, right)],
        [(x, y, *_FLAT) for x in (right, left) for y in (low, high)],
    ):
        assert np.array_equal(ours(file, square, "reference", size)[..., 3], expected)


def test_both_shaders_may_use_a_name_and_vertices_begin_with_their_globals(tmp_path: Path) -> None:
    (tmp_path / "two.vs").write_text("""varying vec2 v; float calls = 0.0; float f(float x) { return x * 2.0; }
void main() { isf_vertShaderInit(); calls += 1.0; v = vec2(f(isf_FragNormCoord.x), calls); }""")
    made = tmp_path / "two.fs"
    made.write_text("""/*{}*/\nvarying vec2 v; float calls = 0.25; float f(float x) { return x + calls; }
void main() { gl_FragColor = vec4(v, f(0.5), 1.0); }""")
    with pg.compile(pg.load_shader(made)(into=pg.target("r", "rgba32f", size=(2, 1)))) as program:
        assert program()["r"][0].tolist() == [[0.5, 1.0, 0.75, 1.0], [1.5, 1.0, 0.75, 1.0]]


def test_a_vertex_shader_of_isf_has_no_inputs_but_the_corner(tmp_path: Path) -> None:
    (tmp_path / "two.vs").write_text("attribute vec2 tangent;\nvoid main() { isf_vertShaderInit(); }")
    (tmp_path / "two.fs").write_text("/*{}*/\nvoid main() { gl_FragColor = vec4(1.0); }")
    with pytest.raises(pg.KernelError, match=r"two\.vs:1: input tangent has no value in ISF; isf_FragNormCoord is the"):
        pg.load_shader(tmp_path / "two.fs")
