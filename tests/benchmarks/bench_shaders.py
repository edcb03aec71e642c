"""Published shaders on OpenGL: as passgraph runs them, with exact and with native math, beside the same text by hand.

    python tests/benchmarks/bench_shaders.py [FOLDER]

FOLDER has gl-transitions (default: ../shared/shaders/transitions).  Frames of 1280x720 are drawn in turn, from two
float32 pictures into a float32 target; medians and ratios are printed.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import passgraph as pg
from tests.offscreen import offscreen
from tests.shaders.original import _QUAD, HEAD

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "shaders" / "transitions"
SHADERS = (
    "burn0", "circle", "colorphase", "crosshatch", "directionalwarp", "displacement", "flyeye", "hexagonalize",
    "InvertedPageCurl", "LinearBlur", "perlin", "Radial", "Swirl", "TVStatic", "undulatingBurnOut",
)  # fmt: skip
SIZE = (1280, 720)
ROUNDS = 15
PROGRESS = 0.4
Draw = Callable[[], None]
Picture = NDArray[np.float32]
#: What a player of gl-transitions puts before their text.
_HOST = """
uniform sampler2D from_picture, to_picture;
uniform float progress;
float ratio = pg_output_size.x / pg_output_size.y;
vec4 getFromColor(vec2 uv) { return texture(from_picture, uv); }
vec4 getToColor(vec2 uv) { return texture(to_picture, uv); }
"""


def by_hand(context: moderngl.Context, path: Path, effect: Any, pictures: list[Picture]) -> Draw:
    """Return a function that draws a transition's own text once."""
    text = f"{HEAD}{_HOST}{path.read_text()}\nvoid main() {{ gl_FragColor = transition(pg_position); }}"
    program = context.program(vertex_shader=_QUAD, fragment_shader=text)
    for unit, (name, picture) in enumerate(zip(("from_picture", "to_picture"), pictures, strict=True)):
        texture = context.texture(SIZE, 4, np.ascontiguousarray(picture[::-1]).tobytes(), dtype="f4")
        texture.repeat_x = texture.repeat_y = False
        texture.use(unit)
        if name in program:
            program[name].value = unit
    values = {name: parameter.default for name, parameter in effect.parameters.items()}
    for name, value in {**values, "progress": PROGRESS, "pg_output_size": tuple(map(float, SIZE))}.items():
        if name in program:
            program[name].value = value
    frame = context.framebuffer([context.texture(SIZE, 4, dtype="f4")])
    corners = context.buffer(np.array([-1, -1, 3, -1, -1, 3], np.float32).tobytes())
    quad = context.vertex_array(program, [(corners, "2f", "corner")])

    def draw() -> None:
        with context:
            frame.use()
            quad.render(moderngl.TRIANGLES)
            context.finish()

    return draw


def by_passgraph(effect: Any, pictures: list[Picture], math: str) -> Draw:
    handles = [pg.Input(name, "rgba32f", SIZE, static=True) for name in ("one", "other")]
    output = effect(*handles, progress=PROGRESS, into=pg.target("out", "rgba32f"))
    program = pg.compile(output, "gl", SIZE, pg.Options(static=False, math=math))
    given = {spec: picture for spec, picture in zip(("one", "other"), pictures, strict=True) if spec in program.inputs}

    def draw() -> None:
        program.run(**given)
        program.finish()

    return draw


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    random = np.random.default_rng(0)
    pictures = [random.random((SIZE[1], SIZE[0], 4), np.float32) for _ in range(2)]
    print(f"{'shader':20} {'by hand':>9} {'exact':>9} {'native':>9}   exact / by hand, native / by hand")
    ratios: dict[str, list[float]] = {"exact": [], "native": []}
    for name in SHADERS:
        path = folder / f"{name}.glsl"
        if not path.exists():
            continue
        effect = pg.load_shader(path)
        with offscreen() as context:
            draws = {"by hand": by_hand(context, path, effect, pictures)}
            draws |= {math: by_passgraph(effect, pictures, math) for math in ratios}
            times: dict[str, list[float]] = {name: [] for name in draws}
            for _ in range(ROUNDS + 1):
                for kind, draw in draws.items():
                    begin = time.perf_counter()
                    draw()
                    times[kind].append(time.perf_counter() - begin)
        medians = {kind: statistics.median(spent[1:]) * 1e3 for kind, spent in times.items()}
        for math, found in ratios.items():
            found.append(medians[math] / medians["by hand"])
        shown = " ".join(f"{value:9.2f}" for value in medians.values())
        print(f"{name:20} {shown}   {ratios['exact'][-1]:.2f}, {ratios['native'][-1]:.2f}")
    for math, found in ratios.items():
        print(f"median of {math} / by hand: {statistics.median(found):.2f}")


if __name__ == "__main__":
    main()
