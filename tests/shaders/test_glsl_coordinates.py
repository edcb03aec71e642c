"""``gl_FragCoord`` as ``layout(…)`` asks for it, compared with the driver's."""

from __future__ import annotations

import numpy as np
import pytest
from original import original

import passgraph as pg

LAYOUTS = ["", "origin_upper_left", "pixel_center_integer", "origin_upper_left, pixel_center_integer"]


@pytest.mark.gl
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("backend", ["reference", "numpy", "gl", "opencl", "webgpu"])
def test_the_origin_and_the_centers_of_pixels_are_those_of_the_layout(layout: str, backend: str) -> None:
    """GLSL 3.30, section 4.3.8.1."""
    head = "#version 330\n" + (f"layout({layout}) in vec4 gl_FragCoord;\n" if layout else "")
    text = "out vec4 o;\nvoid main() { o = vec4(gl_FragCoord.xy, 0.0, 1.0); }"
    size = (3, 5)
    with original() as there:
        expected = there.run(text, size, {}, {}, head=head)
    target = pg.kernel(glsl=head + text)(into=pg.target("r", "rgba32f", size=size))
    with pg.compile(target, backend=backend) as program:
        assert np.array_equal(program()["r"], expected)
