"""2-D light with soft shadows beside pygame-light2d: 1920x1080, 8 lights that move, 32 boxes, all anew each frame.

    python tests/benchmarks/bench_light2d.py [PYTHON WITH pygame-light2d]

Both draw on the same OpenGL driver without a window.  Ours is the exact penumbra of round lamps; the tables that the
host makes for each frame count.  The peer takes lamps as points and blurs the light map by 7 × 7 texels, one width
everywhere.  On Mesa the peer reads its boxes with another stride than it writes them, so that its picture shows
other walls than given; it still tests 116 of the 128 edges.

Then ours alone: how the cost grows with lights and walls by the hundred.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio
from peers import Peer, compare, serve

SIZE = (1920, 1080)
RADIUS = 600.0
FRAMES = 7


def lamp_places(frame: int) -> list[tuple[float, float]]:
    return [(300.0 + 480 * (i % 4) + 3 * (frame % 20), 310.0 + 540 * (i // 4)) for i in range(8)]


def boxes() -> list[tuple[float, float]]:
    """Middles of boxes 60 wide."""
    return [(120.0 + 240 * (i % 8), 135.0 + 270 * (i // 8)) for i in range(32)]


def peer() -> None:
    import pygame
    from pygame_light2d import Hull, LightingEngine, PointLight

    pygame.init()
    engine = LightingEngine(screen_res=SIZE, native_res=SIZE, lightmap_res=SIZE)
    engine.set_ambient(20, 20, 30, 255)
    for place in lamp_places(0):
        light = PointLight(position=place, power=1.0, radius=RADIUS)
        light.set_color(255, 200, 120, 200)
        engine.lights.append(light)
    for x, y in boxes():
        engine.hulls.append(Hull([(x - 30, y - 30), (x + 30, y - 30), (x + 30, y + 30), (x - 30, y + 30)]))
    frames = iter(range(1 << 30))

    def frame() -> None:
        for light, place in zip(engine.lights, lamp_places(next(frames)), strict=True):
            light.position = place
        engine.clear(255, 255, 255)
        engine.render()
        engine.ctx.finish()

    serve(frame, f"pygame-light2d on {engine.ctx.info['GL_RENDERER']}")


def ratios(python: str, frames: int = FRAMES) -> list[Ratio]:
    import passgraph as pg
    from passgraph.effects.light2d import Light2D, Wall, Window, lit, live_light_map

    walls = [Wall.box(x - 30, y - 30, x + 30, y + 30) for x, y in boxes()]
    live = live_light_map(Window(0, 0, *SIZE), SIZE, ambient=(0.08, 0.08, 0.12))
    scene = pg.Input("scene", "rgba8", SIZE, static=True, default=np.ones((SIZE[1], SIZE[0], 4), np.float32))
    numbers = iter(range(1 << 30))
    environment = {**os.environ, "SDL_VIDEODRIVER": "offscreen", "SDL_AUDIODRIVER": "dummy"}
    with pg.compile(lit(scene, live.target, into=pg.target("shown", "rgba8", SIZE)), backend="gl") as program:

        def frame() -> None:
            lights = [Light2D(place, (0.8, 0.6, 0.4), RADIUS, 12.0) for place in lamp_places(next(numbers))]
            program.run(**live.inputs(lights, walls))
            program.finish()

        other = Peer(python, __file__, "light2d", environment)
        ratio = compare("8 lights, 32 boxes", frame, other, frames, 20.0)
        other.close()
    return [ratio]


def by_the_hundred(backend: str) -> None:
    """Lights and walls on a map that grows with them, and on one that does not."""
    import passgraph as pg
    from passgraph.effects.light2d import Light2D, Wall, Window, live_light_map

    for count, size in ((50, (640, 720)), (100, (1280, 720)), (200, (2560, 720)), (200, (1280, 720))):
        rng = np.random.default_rng(2)
        cells = rng.permutation(size[0] // 64 * (size[1] // 36))[:count]
        walls = [Wall.box(x + 23, y + 12, x + 41, y + 24) for x, y in ((c // 20 * 64, c % 20 * 36) for c in cells)]
        lights = [
            Light2D((float(c // 20 * 64 + 64), float(c % 20 * 36 + 36)), (0.3, 0.25, 0.2), 160.0, 4.0) for c in cells
        ]
        live = live_light_map(Window(0, 0, *size), size, room=1 << 20, shaded=100)
        with pg.compile(live.target, backend=backend) as program:
            times = []
            for _ in range(4):
                begin = time.perf_counter()
                tables = live.inputs(lights, walls)
                made = time.perf_counter()
                program.run(**tables)
                program.finish()
                times.append((made - begin, time.perf_counter() - made))
        host, device = (statistics.median(column[1:]) * 1e3 for column in zip(*times, strict=True))
        print(
            f"{backend:8} {count} lights, {len(walls)} walls, {size[0]}x{size[1]}: host {host:.0f} ms, {device:.0f} ms"
        )


def main(python: str) -> None:
    ratios(python)
    for backend in ("gl", "numpy"):
        by_the_hundred(backend)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--peer"]:
        peer()
    else:
        main(sys.argv[1] if len(sys.argv) > 1 else sys.executable)
