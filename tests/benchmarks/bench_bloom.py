"""Bloom and Gaussian blur beside arcade's, 1920x1080, on the same OpenGL driver without a window.

    python tests/benchmarks/bench_bloom.py [PYTHON WITH arcade]

Arcade has two blooms: ``BloomFilter`` (four passes by shaders, 8-bit targets) and ``BloomEffect`` (three blurs of 11
taps on smaller pictures, 8-bit targets).  Its ``GaussianBlur`` has 11 taps, standard deviation about 3, 8-bit.  Ours
keep float16 and their weights add up to 1; the blur is given with 8-bit targets too.  For the blur both
upload the picture in each frame.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio
from peers import Peer, compare, serve

SIZE = (1920, 1080)
FRAMES = 15


def picture() -> np.ndarray:
    """A dim picture with bright spots, 8 bits."""
    rng = np.random.default_rng(4)
    made = rng.integers(0, 80, (SIZE[1], SIZE[0], 4), np.uint8)
    for x, y in rng.integers(20, (SIZE[0] - 20, SIZE[1] - 20), (60, 2)):
        made[y - 8 : y + 8, x - 8 : x + 8] = 255
    made[:, :, 3] = 255
    return made


def peer(name: str) -> None:
    os.environ["ARCADE_HEADLESS"] = "True"
    import arcade
    from arcade.experimental.bloom_filter import BloomFilter
    from arcade.experimental.postprocessing import BloomEffect, GaussianBlur

    window = arcade.open_window(*SIZE, "peer")
    window.switch_to()
    context = window.ctx
    source = context.texture(SIZE, components=4, data=picture().tobytes())
    into = context.framebuffer(color_attachments=[context.texture(SIZE, components=4)])
    if name == "filter":
        bloom = BloomFilter(*SIZE, 20.0)
        bloom.fbo.color_attachments[0].write(picture().tobytes())

        def draw() -> None:
            into.use()
            bloom.draw()
    elif name == "effect":
        effect = BloomEffect(SIZE)

        def draw() -> None:
            effect.render(source, into)
    else:
        blur = GaussianBlur(SIZE)

        pixels = picture().tobytes()

        def draw() -> None:
            source.write(pixels)
            blur.render(source)

    def frame() -> None:
        draw()
        context.finish()

    serve(frame, f"arcade {arcade.__version__} {name} on {context.info.RENDERER}")


def ratios(python: str, runs: int = FRAMES) -> list[Ratio]:
    import passgraph as pg
    from passgraph.effects import bloom, gaussian_blur

    given = pg.Input("frame", "rgba8", SIZE, static=True, default=picture())
    # a step that runs each frame, so that nothing is kept from the last one
    moving = pg.Value("threshold", float)
    cases = {
        "filter": bloom(given, moving, 0.5, 5, into=pg.target("shown", "rgba16f")),
        "effect": bloom(given, moving, 0.5, 4, into=pg.target("shown", "rgba16f")),
    }
    found = []
    for name, made in cases.items():
        with pg.compile(made, backend="gl", size=SIZE) as program:
            frames = iter(range(1 << 30))

            def frame() -> None:
                program.run(threshold=0.5 + 1e-6 * next(frames))  # noqa: B023
                program.finish()

            other = Peer(python, __file__, name, dict(os.environ))
            found.append(compare(f"bloom beside {name}", frame, other, runs, 1.0))
            other.close()
    for format in ("rgba16f", "rgba8"):
        pixels = pg.Input("frame", "rgba8", SIZE, static=True)
        blurred = gaussian_blur(pixels, 3.0, 5, into=pg.target("shown", format))
        pictures = (picture(), picture())
        with pg.compile(blurred, backend="gl", size=SIZE) as program:
            frames = iter(range(1 << 30))

            def frame() -> None:
                program.run(frame=pictures[next(frames) % 2])  # noqa: B023
                program.finish()

            other = Peer(python, __file__, "gaussian", dict(os.environ))
            found.append(compare(f"Gaussian blur, 11 taps, {format}", frame, other, runs, 1.0))
            other.close()
    return found


if __name__ == "__main__":
    if sys.argv[1:2] == ["--peer"]:
        peer(sys.argv[2])
    else:
        ratios(sys.argv[1] if len(sys.argv) > 1 else sys.executable)
