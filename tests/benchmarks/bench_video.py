"""A video through a blur against libavfilter's, with the same decoder and encoder; and two jobs against one.

    python tests/benchmarks/bench_video.py [FRAMES] [WIDTHxHEIGHT]

The video is made first: gradients with noise that moves, H.264.  ``copy`` decodes and encodes only, as both sides do.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import passgraph as pg
from passgraph.commands.command_graph import in_bytes
from passgraph.effects.color.black_and_white import black_and_white
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.files import Pattern, Pictures, ToPictures, ToVideo, Video
from tests.benchmarks.harness import Ratio, interleaved, ratio_of

SIGMA_PX = 3.0
ENCODER = {"preset": "medium", "crf": "18"}
#: At most 1.1 times as long as decoding, libavfilter's gblur and encoding.
WANTED = 1.1
#: Two jobs on two cores against one, where reading and writing is nearly all.
WANTED_OF_TWO = 0.55


def make_video(path: Path, frames: int, size: tuple[int, int]) -> None:
    y, x = np.mgrid[0 : size[1], 0 : size[0]].astype(np.float32)
    rng = np.random.default_rng(0)
    picture = np.dstack([x / size[0] * 200, y / size[1] * 200, (np.sin(x / 50) * np.cos(y / 40) + 1) * 100])
    picture = picture.astype(np.uint8) + rng.integers(0, 12, picture.shape, np.uint8)
    with av.open(str(path), "w") as container:
        stream = new_stream(container, size)
        for number in range(frames):
            frame = av.VideoFrame.from_ndarray(np.roll(picture, 8 * number, 1), "rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def new_stream(container: Any, size: tuple[int, int]) -> Any:
    stream = container.add_stream("libx264", rate=30, options=ENCODER)
    (stream.width, stream.height), stream.pix_fmt = size, "yuv420p"
    stream.codec_context.thread_count, stream.codec_context.thread_type = 0, "AUTO"
    return stream


def through_libavfilter(source: Path, output: Path, blur: bool) -> None:
    """Decoding and encoding, with gblur between them or nothing."""
    with av.open(str(source)) as given, av.open(str(output), "w") as container:
        video = given.streams.video[0]
        video.thread_type = "AUTO"
        stream = new_stream(container, (video.width, video.height))
        graph = av.filter.Graph()
        first, last = graph.add_buffer(template=video), graph.add("buffersink")
        if blur:
            made = graph.add("gblur", f"sigma={SIGMA_PX}")
            first.link_to(made)
            made.link_to(last)
        else:
            first.link_to(last)
        graph.configure()
        stream.codec_context.time_base = video.time_base
        for frame in given.decode(video):
            graph.push(frame)
            done = graph.pull()
            done.pict_type = 0
            container.mux(stream.encode(done))
        container.mux(stream.encode())


def videos(folder: Path, frames: int, size: tuple[int, int], turns: int) -> list[Ratio]:
    source = folder / "source.mp4"
    make_video(source, frames, size)
    blurred = in_bytes({"blurred": gaussian_blur(pg.Input("frame"), sigma_px=SIGMA_PX)})
    with pg.compile(blurred, "numpy", results="stored") as program:  # as `passgraph apply` does

        def ours() -> None:
            sink = ToVideo(folder / "ours.mp4", options=ENCODER, sound=False, rate=Fraction(30))
            assert pg.frames(program, Video(source), sink).whole

        jobs: dict[str, Callable[[], object]] = {
            "passgraph": ours,
            "gblur": lambda: through_libavfilter(source, folder / "gblur.mp4", blur=True),
            "copy": lambda: through_libavfilter(source, folder / "copy.mp4", blur=False),
        }
        times = interleaved(jobs, turns)
    return [
        ratio_of("a blurred video / libavfilter's", times["passgraph"], times["gblur"], WANTED),
        ratio_of("a blurred video / decoding and encoding", times["passgraph"], times["copy"], None),
    ]


def pictures(folder: Path, size: tuple[int, int], turns: int) -> list[Ratio]:
    """PNG files: reading and writing them is nearly all."""
    rng = np.random.default_rng(1)
    paths = [folder / f"{number}.png" for number in range(6)]
    for path in paths:
        pg.save(path, rng.integers(0, 64, (size[1], size[0], 4), np.uint8) | np.uint8([0, 0, 0, 255]))
    sink = ToPictures(Pattern(str(folder / "out.%d.png")))
    found = []
    for name, effect in (("blurred", gaussian_blur), ("gray", black_and_white)):
        with pg.compile(effect(pg.Input("frame", "rgba32f")), "numpy") as program:

            def run(jobs: int, program: pg.Program = program) -> object:
                return pg.frames(program, Pictures(paths), sink, jobs=jobs)

            times = interleaved({"two": lambda run=run: run(2), "one": lambda run=run: run(1)}, turns)  # type: ignore[misc]
        found.append(ratio_of(f"{name} pictures, two jobs / one", times["two"], times["one"], WANTED_OF_TWO))
    return found


def ratios(frames: int, size: tuple[int, int], turns: int) -> list[Ratio]:
    with tempfile.TemporaryDirectory() as folder:
        return [*videos(Path(folder), frames, size, turns), *pictures(Path(folder), size, turns)]


def main() -> None:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    width, _, height = (sys.argv[2] if len(sys.argv) > 2 else "1920x1080").partition("x")
    for ratio in ratios(frames, (int(width), int(height)), 3):
        wanted = "" if ratio.wanted is None else f", wanted {ratio.wanted:.2f}"
        print(f"{ratio.what}: {ratio.got:.2f}{wanted} ({ratio.ms:.0f} ms against {ratio.other_ms:.0f})")


if __name__ == "__main__":
    main()
