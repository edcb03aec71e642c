"""Tiny pictures and videos that the tests of frames make."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import passgraph as pg

INVERT = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, color[0, 0].a)")
ADD = pg.kernel(source="def add(sum: Image, color: Image) -> vec4: return sum[0, 0] + color[0, 0]")
SCALED = pg.kernel(source="def scaled(color: Image, gain: float) -> vec4: return color[0, 0] * gain")


def inverted(backend: str = "reference") -> pg.Program:
    return pg.compile(INVERT(pg.Input("frame")), backend=backend)


def summed(backend: str = "reference") -> pg.Program:
    """Adds up all frames until now."""
    spec = pg.target("sum", "rgba32f")
    return pg.compile(ADD(pg.previous(spec), pg.Input("frame"), into=spec), backend=backend)


def picture(value: int, size: tuple[int, int] = (6, 4)) -> np.ndarray[Any, np.dtype[np.uint8]]:
    made = np.full((size[1], size[0], 4), value, np.uint8)
    made[..., 3] = 255
    return made


def sequence(folder: Path, numbers: range | list[int], size: tuple[int, int] = (6, 4)) -> None:
    """``in.0001.png`` and so on, each as bright as ten times its number."""
    folder.mkdir(exist_ok=True)
    for number in numbers:
        pg.save(folder / f"in.{number:04d}.png", picture(10 * number, size))


def value(path: Path) -> int:
    """The red of a picture of one colour."""
    loaded = pg.load(path)
    assert np.ptp(loaded[..., 0]) < 0.01
    return round(float(loaded[0, 0, 0]) * 255)


def video(
    path: Path,
    count: int = 10,
    size: tuple[int, int] = (64, 48),
    *,
    times: list[int] | None = None,
    sound: bool = False,
    codec: str = "libx264",
    pix_fmt: str = "yuv420p",
    title: str = "",
    **colours: int,
) -> Path:
    """Frames of one gray each, 20, 30, 40 ... of 255, at 25 a second or at ``times`` of a 1/1000 second."""
    av: Any = __import__("av")
    base = Fraction(1, 25) if times is None else Fraction(1, 1000)
    with av.open(str(path), "w") as container:
        if title:
            container.metadata["title"] = title
        stream = container.add_stream(codec, rate=25, options={"crf": "10"} if codec == "libx264" else {})
        stream.width, stream.height, stream.pix_fmt = *size, pix_fmt
        stream.codec_context.time_base = base
        for name, number in colours.items():
            setattr(stream.codec_context, name, number)
        audio = container.add_stream("aac", rate=8000, layout="mono") if sound else None
        for i in range(count):
            frame = av.VideoFrame.from_ndarray(np.full((size[1], size[0], 3), 20 + 10 * (i % 20), np.uint8), "rgb24")
            frame.colorspace, frame.color_range = colours.get("colorspace", 6), colours.get("color_range", 1)
            frame = frame.reformat(format=pix_fmt)
            frame.pts, frame.time_base = (i if times is None else times[i]), base
            container.mux(stream.encode(frame))
            if audio is not None:
                wave = (np.sin(np.arange(320) / 5) * 9000).astype(np.int16)[None]
                heard = av.AudioFrame.from_ndarray(wave, "s16", "mono")
                heard.sample_rate, heard.pts, heard.time_base = 8000, 320 * i, Fraction(1, 8000)
                container.mux(audio.encode(heard))
        container.mux(stream.encode())
        if audio is not None:
            container.mux(audio.encode())
    return path


def grays(path: Path) -> list[int]:
    """The gray in the middle of each frame of a video, in RGB."""
    av: Any = __import__("av")
    with av.open(str(path)) as container:
        return [int(f.to_ndarray(format="rgb24")[f.height // 2, f.width // 2, 0]) for f in container.decode(video=0)]
