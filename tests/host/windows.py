"""A window of pyglet's whose frame a kernel changes in place: run as a process by test_windows.py.

    python -m tests.host.windows ISOLATION OPTIONS

OPTIONS is what the window has, as JSON: "single", "samples", "alpha", "headless".
"""

from __future__ import annotations

import json
import sys
from time import sleep
from typing import Any

import numpy as np
import pyglet

import passgraph as pg

SIZES = ((67, 45), (40, 52), (131, 70), (1, 1))
KERNEL = "def shifted_inverse(c: Image) -> vec4: return vec4(1.0 - c[2, 1].rgb, c[0, 0].a)"


def expected(picture: Any) -> Any:
    """What the kernel makes of the numbers that are stored, of any bits."""
    height, width, _ = picture.shape
    down, right = np.minimum(np.arange(height) + 1, height - 1), np.minimum(np.arange(width) + 2, width - 1)
    return 255 - picture[down][:, right]


def main(isolation: Any, has: dict[str, Any]) -> None:
    pyglet.options.headless = has.get("headless", False)
    from pyglet import gl

    config = gl.Config(
        major_version=3, minor_version=3, depth_size=24, double_buffer=not has.get("single"),
        sample_buffers=int("samples" in has), samples=has.get("samples"), alpha_size=8 if has.get("alpha") else None,
    )  # fmt: skip
    window = pyglet.window.Window(*SIZES[0], config=config, resizable=True)
    host = pg.gl.Host.current(isolation)
    kernel = pg.kernel(source=KERNEL)
    bits = [host_bits(host)]

    def read() -> Any:
        width, height = window.get_framebuffer_size()
        made = (gl.GLubyte * (width * height * 3))()
        gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
        gl.glReadPixels(0, 0, width, height, gl.GL_RGB, gl.GL_UNSIGNED_BYTE, made)
        return np.frombuffer(made, np.uint8).reshape(height, width, 3)[::-1].copy()

    def draw() -> None:
        window.switch_to()
        width, height = window.get_framebuffer_size()
        numbers = np.random.default_rng(5)
        gl.glEnable(gl.GL_SCISSOR_TEST)
        for number in range(40):
            x, y = (0, 0) if number == 0 else (numbers.integers(0, width), numbers.integers(0, height))
            gl.glScissor(int(x), int(y), width, height)
            gl.glClearColor(*numbers.random(3).tolist(), 1.0)
            gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
        gl.glDisable(gl.GL_SCISSOR_TEST)

    for size in SIZES[: 1 if pyglet.options.headless else None]:
        if window.get_size() != size:
            resize(window, host, size)
        pictures = []
        for run in (False, True, False):
            draw()
            if run:
                frame = host.framebuffer(srgb=False)
                assert frame.color is not None
                assert frame.color.size == size, frame.color
                assert frame.color.samples == has.get("samples", 0), frame.color
                with pg.compile(kernel(pg.Input("frame"), into=pg.target("made", "rgba8")), backend=host) as program:
                    program.run(frame=frame, into={"made": frame})
                    # Of several samples a pixel, only what the effect changes is written.
                    assert ("moved into" if has.get("samples") else "written in place") in program.explain()
            pictures.append(read())
            window.flip()
        plain, changed, later = pictures
        assert len(np.unique(plain.reshape(-1, 3), axis=0)) > 5 or size == (1, 1)
        np.testing.assert_array_equal(later, plain)
        np.testing.assert_array_equal(changed, expected(plain))
    host.close()
    window.close()
    print(json.dumps(bits))


def resize(window: Any, host: pg.gl.Host, size: tuple[int, int]) -> None:
    """X answers later, and pyglet follows each of its answers."""
    window.set_size(*size)
    for _ in range(200):
        window.dispatch_events()
        if window.get_size() == size == host.framebuffer(srgb=False).size:
            return
        sleep(0.01)
    raise AssertionError(f"the window has not got {size}")


def host_bits(host: pg.gl.Host) -> str:
    color = host.framebuffer(srgb=False).color
    assert color is not None
    return color.facts.stored


if __name__ == "__main__":
    main(sys.argv[1], json.loads(sys.argv[2]))
