"""A host's picture that must be copied to be read can be written where it is in the same run."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

import passgraph as pg
from tests.offscreen import offscreen

pytestmark = pytest.mark.gl
SIZE = (7, 5)
SHIFT = "def shift(c: Image) -> vec4: return vec4(c[1, 0].rgb, 1.0)"


@pytest.fixture
def context() -> Iterator[moderngl.Context]:
    with offscreen() as made:
        yield made


def ran(host: pg.gl.Host) -> tuple[str, str]:
    """How the bound framebuffer's colour came in and went out."""
    shift = pg.kernel(source=SHIFT)
    with pg.compile(shift(pg.Input("frame"), into=pg.target("picture", "rgba8")), backend=host) as program:
        frame = host.framebuffer()
        program.run(frame=frame, into={"picture": frame})
        told = program.explain().splitlines()
    came, went = [line for line in told if line.startswith(("- input", "- output"))]
    return came.split(": ")[1], went.split(": ")[1]


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
@pytest.mark.parametrize("samples", [0, 4])
def test_what_was_copied_is_written_where_it_is(context: moderngl.Context, isolation: str, samples: int) -> None:
    pixels = np.random.default_rng(3).integers(0, 256, (SIZE[1], SIZE[0], 4), np.uint8)
    pixels[..., 3] = 255
    start = context.framebuffer([context.texture(SIZE, 4, pixels.tobytes())])
    frame = context.framebuffer([context.renderbuffer(SIZE, 4, samples=samples)])
    if samples:
        quad = context.vertex_array(context.program(VERTEX, FRAGMENT), [])
        start.color_attachments[0].use(0)
        frame.use()
        quad.render(moderngl.TRIANGLES, 3)
    else:
        context.copy_framebuffer(frame, start)
    frame.use()
    host = pg.gl.Host.current(isolation)  # type: ignore[arg-type]
    came, went = ran(host)
    host.close()
    assert came.startswith("copied on the device"), came
    # several samples a pixel stay where nothing changes, which a pass that compares sees to
    assert went.startswith("moved into" if samples else "written in place"), went
    shown = context.framebuffer([context.texture(SIZE, 4)])
    context.copy_framebuffer(shown, frame)
    after = np.frombuffer(shown.read(components=4), np.uint8).reshape(pixels.shape)
    np.testing.assert_array_equal(after, pixels[:, [*range(1, SIZE[0]), SIZE[0] - 1]])


VERTEX = "#version 330\nvoid main() { gl_Position = vec4(gl_VertexID / 2 * 4 - 1, gl_VertexID % 2 * 4 - 1, 0, 1); }"
FRAGMENT = (
    "#version 330\nuniform sampler2D t; out vec4 c;\nvoid main() { c = texelFetch(t, ivec2(gl_FragCoord.xy), 0); }"
)
