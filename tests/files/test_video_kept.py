"""What a video has besides colors and times is read, and kept where the output can store it."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.commands.entry import run
from passgraph.files import Video
from passgraph.files.audio import decoded
from tests.files.made import video

av: Any = pytest.importorskip("av")
COPY = ("apply", "black-and-white")
SIZE = 64, 48


def write(path: Path, codec: str, format: str, values: tuple[int, ...], options: Any = None, **context: Any) -> Path:
    """Four frames, each plane of one value; x265 may give fewer frames wrong times."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25, options=options or {})
        (stream.width, stream.height), stream.pix_fmt = SIZE, format
        for name, value in context.items():
            setattr(stream.codec_context, name, value)
        for number in range(4):
            frame = av.VideoFrame(*SIZE, format)
            frame.pts = number
            kind = np.uint16 if frame.format.components[0].bits > 8 else np.uint8
            for plane, value in zip(frame.planes, values, strict=True):
                rows = np.full((plane.height, plane.line_size // np.dtype(kind).itemsize), value, kind)
                plane.update(rows.tobytes())
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


# YUV4MPEG2

Y4M = b"YUV4MPEG2 W16 H16 F25:1 Ip A1:1 %sFRAME\n"


@pytest.mark.parametrize(("words", "chroma"), [
    (b"C420jpeg\n", "center"), (b"C420mpeg2\n", "left"), (b"C420paldv\n", "topleft"), (b"\n", "center"),
])  # fmt: skip
def test_y4m_is_read(tmp_path: Path, words: bytes, chroma: str) -> None:
    """Bytes by the format's definition; luma 235 of limited range is white."""
    data = bytes([235]) * 128 + bytes([16]) * 128 + bytes([128]) * 128
    (tmp_path / "a.y4m").write_bytes(Y4M % words + data)
    source = Video(tmp_path / "a.y4m")
    picture = next(iter(source)).read()
    assert picture[[0, -1], 0].tolist() == [[255] * 4, [0, 0, 0, 255]]
    assert source.chroma == chroma


def test_y4m_is_written(tmp_path: Path) -> None:
    made = video(tmp_path / "a.mkv", 3)
    assert run([*COPY, str(made), "-o", str(tmp_path / "b.y4m")]) == 0
    header, *frames = (tmp_path / "b.y4m").read_bytes().split(b"FRAME\n")
    assert header.startswith(b"YUV4MPEG2 W64 H48 F25:1 ")
    assert b" C420mpeg2 " in header
    assert [len(frame) for frame in frames] == [64 * 48 * 3 // 2] * 3
    gray = [round((frame[64 * 24 + 32] - 16) / 219 * 255) for frame in frames]
    assert gray == pytest.approx([20, 30, 40], abs=2)


@pytest.mark.parametrize("data", [b"YUV4MPEG2", b"YUV4MPEG2 W16\n", Y4M % b"C420jpeg\n", Y4M % b"Cnone\n"])
def test_damaged_y4m_is_told(tmp_path: Path, data: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.y4m").write_bytes(data)
    assert run([*COPY, str(tmp_path / "a.y4m"), "-o", str(tmp_path / "b.mp4")]) != 0
    assert "a.y4m: " in capsys.readouterr().err


# Alpha


@pytest.mark.parametrize(("codec", "options"), [("libvpx-vp9", {"lossless": "1"}), ("libvpx", {"auto-alt-ref": "0"})])
def test_alpha_of_webm_is_kept(tmp_path: Path, codec: str, options: dict[str, str]) -> None:
    made = write(tmp_path / "a.webm", codec, "yuva420p", (120, 128, 128, 80), options)
    assert Video(made).has_alpha
    for path in (made, tmp_path / "b.webm"):
        assert path.exists() or run([*COPY, str(made), "-o", str(path)]) == 0
        pictures = [frame.read() for frame in Video(path)]
        assert len(pictures) == 4
        for picture in pictures:
            assert picture[5, 5].tolist() == pytest.approx([121, 121, 121, 80], abs=2)


# HDR10

#: Units of H.265, D.2.28: 0.00002, and 0.0001 cd/m².
DISPLAY = "G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,1)"
HDR = {"colorspace": 9, "color_primaries": 9, "color_trc": 16, "color_range": 1}


def hdr_source(path: Path, light: bool = True) -> Path:
    options = f"log-level=none:master-display={DISPLAY}" + ":max-cll=1000,400" * light
    return write(path, "libx265", "yuv420p10le", (500, 512, 512), {"x265-params": options}, **HDR)


def hdr_of(path: Path) -> list[float]:
    """Numbers of libavutil's structures: x and y of red, green, blue and white, luminances, and light levels."""
    with av.open(str(path)) as container:
        data = next(container.decode(video=0)).side_data
    types = av.sidedata.sidedata.Type
    found = list[float]()
    if (display := data.get(types.MASTERING_DISPLAY_METADATA)) is not None:
        pairs = np.frombuffer(display, np.int32)[:20].reshape(-1, 2)
        found += (pairs[:, 0] / pairs[:, 1]).tolist()
    if (light := data.get(types.CONTENT_LIGHT_LEVEL)) is not None:
        found += np.frombuffer(light, np.uint32).tolist()
    return found


WANTED = [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329, 0.0001, 1000.0, 1000, 400]


@pytest.mark.parametrize(("codec", "suffix"), [
    ("libx265", ".mp4"), ("libx265", ".mkv"), ("libx264", ".mkv"), ("libsvtav1", ".mkv"),
])  # fmt: skip
def test_hdr_metadata_is_kept(tmp_path: Path, codec: str, suffix: str) -> None:
    made = hdr_source(tmp_path / "a.mkv")
    assert hdr_of(made) == pytest.approx(WANTED)
    assert run([*COPY, str(made), "-o", str(tmp_path / f"b{suffix}"), "--codec", codec]) == 0
    # AV1 has fractions of its own: 2^-16 for chromaticities, 2^-14 for the least luminance (section 6.7.4).
    assert hdr_of(tmp_path / f"b{suffix}") == pytest.approx(WANTED, abs=2**-14 if codec == "libsvtav1" else 1e-6)


def test_a_part_of_the_hdr_metadata_is_kept(tmp_path: Path) -> None:
    made = hdr_source(tmp_path / "a.mkv", light=False)
    option = "x265-params=log-level=none:max-cll=500,100"
    words = [*COPY, str(made), "-o", str(tmp_path / "b.mkv"), "--codec", "libx265"]
    assert run(words) == 0
    assert hdr_of(tmp_path / "b.mkv") == pytest.approx([*WANTED[:10], 0, 0])  # x265 writes zeros for unknown levels
    assert run([*words, "--codec-option", option]) == 0
    assert hdr_of(tmp_path / "b.mkv") == pytest.approx([*WANTED[:10], 500, 100])


def test_hdr_metadata_of_converted_colors_goes(tmp_path: Path) -> None:
    made = hdr_source(tmp_path / "a.mkv")
    assert run(["apply", "tone-map", str(made), "-o", str(tmp_path / "b.mkv"), "--codec", "libx265"]) == 0
    assert hdr_of(tmp_path / "b.mkv") == []


# Time code, shape of pixels, sound


@pytest.mark.parametrize("suffix", [".mov", ".mp4", ".mkv"])
def test_the_time_code_is_kept(tmp_path: Path, suffix: str) -> None:
    with av.open(str(tmp_path / "a.mov"), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        (stream.width, stream.height), stream.pix_fmt = SIZE, "yuv420p"
        container.metadata["timecode"] = "01:02:03:04"
        container.mux(stream.encode(av.VideoFrame(*SIZE, "yuv420p")))
        container.mux(stream.encode())
    assert run([*COPY, str(tmp_path / "a.mov"), "-o", str(tmp_path / f"b{suffix}")]) == 0
    with av.open(str(tmp_path / f"b{suffix}")) as made:
        known = {**made.metadata, **made.streams.video[0].metadata}
    assert "01:02:03:04" in (known.get("timecode"), known.get("TIMECODE"))


@pytest.mark.parametrize("degrees", [0, 90, 180])
def test_anamorphic_pixels_turn_with_the_picture(tmp_path: Path, degrees: int) -> None:
    with av.open(str(tmp_path / "a.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        (stream.width, stream.height), stream.pix_fmt = SIZE, "yuv420p"
        stream.codec_context.sample_aspect_ratio = Fraction(4, 3)
        stream.set_display_rotation(degrees)
        container.mux(stream.encode(av.VideoFrame(*SIZE, "yuv420p")))
        container.mux(stream.encode())
    assert run([*COPY, str(tmp_path / "a.mp4"), "-o", str(tmp_path / "b.mp4")]) == 0
    with av.open(str(tmp_path / "b.mp4")) as made:
        stream = made.streams.video[0]
        turned = degrees == 90
        assert (stream.width, stream.height) == (SIZE[::-1] if turned else SIZE)
        assert stream.sample_aspect_ratio == (Fraction(3, 4) if turned else Fraction(4, 3))


def test_sound_is_asked_for_in_packed_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PyAV 18.1 cannot convert planar frames of many channels."""
    asked, own = [], av.AudioResampler

    def resampler(**options: Any) -> Any:
        asked.append(options["format"])
        return own(**options)

    monkeypatch.setattr(av, "AudioResampler", resampler)
    with av.open(str(tmp_path / "a.wav"), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=44100, layout="stereo")
        left, right = np.full(44100, 8192, np.int16), np.full(44100, -24576, np.int16)
        frame = av.AudioFrame.from_ndarray(np.stack([left, right], 1).reshape(1, -1), "s16", "stereo")
        frame.sample_rate = 44100
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    samples = decoded(tmp_path / "a.wav")
    assert [av.AudioFormat(name).is_packed for name in asked] == [True]
    assert samples.shape == (44100,)
    np.testing.assert_allclose(samples, -0.25, atol=1e-4)
