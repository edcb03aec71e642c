"""Videos in and out: times, colours, sound, sizes, and files that are not whole."""

from __future__ import annotations

import struct
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.errors import InputError
from passgraph.files import Arrays, Outcome, ToArrays, ToVideo, Video
from passgraph.files.open import open_film
from passgraph.files.video import _duration, open_container
from tests.files.made import INVERT, SCALED, grays, inverted, picture, sequence, summed, value, video
from tests.picture_files import names_in

av: Any = pytest.importorskip("av")


def copied(source: Any, path: Path, **how: Any) -> pg.frames.Summary:  # type: ignore[name-defined]
    """A source through a program that changes nothing."""
    with pg.compile(SCALED(pg.Input("frame"), gain=1.0), backend="numpy") as program:
        return pg.frames(program, source, ToVideo(path, **how))


def packets(path: Path, kind: str) -> list[tuple[Fraction, bytes]]:
    with av.open(str(path)) as container:
        streams = [stream for stream in container.streams if stream.type == kind]
        if not streams:
            return []
        return [(p.pts * p.time_base, bytes(p)) for p in container.demux(streams) if p.dts is not None]


def times(path: Path) -> list[Fraction]:
    with av.open(str(path)) as container:
        return [frame.pts * frame.time_base for frame in container.decode(video=0)]


def test_frames_of_a_video_are_numbered_and_stored_in_bytes(tmp_path: Path) -> None:
    source = Video(video(tmp_path / "a.mp4", 5))
    frames = list(source)
    assert (source.size, source.rate, source.count) == ((64, 48), 25, 5)
    assert [(frame.number, frame.name) for frame in frames][-1] == (5, f"{tmp_path / 'a.mp4'}, frame 5")
    made = frames[2].read()
    assert (made.shape, made.dtype) == ((48, 64, 4), np.uint8)
    assert np.abs(made[..., :3].astype(int) - 40).max() <= 2
    assert made[..., 3].min() == 255


def test_an_effect_reaches_every_frame(tmp_path: Path) -> None:
    video(tmp_path / "a.mp4", 10)
    with inverted("numpy") as program:
        summary = pg.frames(program, tmp_path / "a.mp4", tmp_path / "b.mp4")
    assert (summary.written, summary.whole) == (10, True)
    assert np.abs(np.array(grays(tmp_path / "b.mp4")) - (235 - 10 * np.arange(10))).max() <= 3


def test_history_and_video(tmp_path: Path) -> None:
    video(tmp_path / "a.mp4", 4)
    made = ToArrays()
    with summed("numpy") as program:
        pg.frames(program, tmp_path / "a.mp4", made, jobs=3)
    sums = [float(one[24, 32, 0]) * 255 for one in made.pictures]
    assert np.abs(np.array(sums) - np.cumsum([20, 30, 40, 50])).max() <= 6


def test_times_are_kept_where_the_rate_varies(tmp_path: Path) -> None:
    video(tmp_path / "a.mkv", 6, times=[0, 40, 50, 300, 310, 1000])
    assert copied(tmp_path / "a.mkv", tmp_path / "b.mkv").whole
    assert times(tmp_path / "b.mkv") == times(tmp_path / "a.mkv")
    assert copied(tmp_path / "a.mkv", tmp_path / "b.mp4").whole
    assert times(tmp_path / "b.mp4") == times(tmp_path / "a.mkv")


def test_times_that_an_encoder_cannot_tell_apart_stay_in_order(tmp_path: Path) -> None:
    """MPEG-4 counts in frames of the average rate."""
    video(tmp_path / "a.mkv", 6, times=[0, 40, 50, 60, 310, 1000])
    summary = copied(tmp_path / "a.mkv", tmp_path / "b.avi", codec="mpeg4")
    assert (summary.written, summary.whole) == (6, True)
    made = times(tmp_path / "b.avi")
    assert made == sorted(set(made))
    assert len(made) == 6


def test_sound_is_copied_as_it_is(tmp_path: Path) -> None:
    video(tmp_path / "a.mp4", 25, sound=True)
    copied(tmp_path / "a.mp4", tmp_path / "b.mp4")
    assert len(packets(tmp_path / "a.mp4", "audio")) > 5
    assert packets(tmp_path / "b.mp4", "audio") == packets(tmp_path / "a.mp4", "audio")
    assert times(tmp_path / "b.mp4") == times(tmp_path / "a.mp4")
    copied(tmp_path / "a.mp4", tmp_path / "silent.mp4", sound=False)
    assert not packets(tmp_path / "silent.mp4", "audio")
    assert len(packets(tmp_path / "silent.mp4", "video")) == 25


def test_sound_that_a_file_cannot_hold_is_refused(tmp_path: Path) -> None:
    video(tmp_path / "a.mp4", 3, sound=True)
    with pytest.raises(
        InputError, match=r"b\.webm: cannot hold the audio of .*a\.mp4 .*choose another suffix, such as"
    ):
        copied(tmp_path / "a.mp4", tmp_path / "b.webm")
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    assert copied(tmp_path / "a.mp4", tmp_path / "b.webm", sound=False).written == 3


@pytest.mark.parametrize(("matrix", "colour_range"), [(1, 1), (1, 2), (6, 1), (6, 2), (9, 1)])
def test_matrix_and_range_are_kept(tmp_path: Path, matrix: int, colour_range: int) -> None:
    said = {"colorspace": matrix, "color_range": colour_range, "color_primaries": 9, "color_trc": 6}
    video(tmp_path / "a.mp4", 3, **said)
    copied(tmp_path / "a.mp4", tmp_path / "b.mp4")
    with av.open(str(tmp_path / "b.mp4")) as container:
        context = container.streams.video[0].codec_context
        assert {name: getattr(context, name) for name in said} == said


@pytest.mark.parametrize(
    ("height", "said", "expected"),
    [
        # Of Y 100, Cb 90, Cr 180: the matrices of BT.601 and BT.709 (ITU-R BT.601-7 and BT.709-6), limited range.
        (48, {}, (181, 70, 21)),
        (720, {}, (191, 78, 18)),
        (48, {"colorspace": 1}, (191, 78, 18)),
        (720, {"colorspace": 6}, (181, 70, 21)),
        (48, {"color_range": 2}, (173, 76, 33)),
    ],
)
def test_matrix_and_range_are_those_of_the_file(
    tmp_path: Path, height: int, said: dict[str, int], expected: tuple[int, int, int]
) -> None:
    with av.open(str(tmp_path / "a.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, height, "yuv444p"
        for name, number in said.items():
            setattr(stream.codec_context, name, number)
        planes = np.stack([np.full((height, 64), n, np.uint8) for n in (100, 90, 180)])
        container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, "yuv444p")))
        container.mux(stream.encode())
    got = next(iter(Video(tmp_path / "a.mkv"))).read()[height // 2, 32, :3]
    assert np.abs(got.astype(int) - expected).max() <= 2


def test_a_title_that_is_not_utf8_keeps_its_bytes(tmp_path: Path) -> None:
    """The bytes in the files are compared: the title, and the packets of the sound, which is opened again."""
    utf8 = video(tmp_path / "utf8.mkv", 3, sound=True, title="title: café")
    latin = b"title: caf\xe9!"
    given = utf8.read_bytes().replace("title: café".encode(), latin)
    assert given.count(latin) == 1
    (tmp_path / "latin.mkv").write_bytes(given)
    with inverted("numpy") as program:
        summary = pg.frames(program, tmp_path / "latin.mkv", tmp_path / "out.mkv")
    assert summary.written == 3
    out = (tmp_path / "out.mkv").read_bytes()
    assert out.count(latin) == 1
    (tmp_path / "out.mkv").write_bytes(out.replace(latin, "title: café".encode()))  # for PyAV 18 as the test calls it
    assert packets(tmp_path / "out.mkv", "audio") == packets(utf8, "audio")


@pytest.mark.parametrize("mode", ["r", "w"])
def test_each_version_of_pyav_gets_only_keywords_that_it_has(mode: str) -> None:
    """PyAV 18 needs ``metadata_errors`` for text that is not UTF-8; PyAV 19 raises TypeError for the keyword."""

    def open_18(file: str, mode: str = "r", *, options: object = None, metadata_errors: str = "strict") -> object:
        return file, mode, options, metadata_errors

    def open_19(file: str, mode: str = "r", *, options: object = None) -> object:
        return file, mode, options

    class Container18:
        metadata_errors = "strict"

    old = SimpleNamespace(open=open_18, container=SimpleNamespace(Container=Container18))
    new = SimpleNamespace(open=open_19, container=SimpleNamespace(Container=object))
    options = {"a": "b"}
    assert open_container(old, Path("x"), mode, options=options) == ("x", mode, options, "surrogateescape")
    assert open_container(new, Path("x"), mode, options=options) == ("x", mode, options)


@pytest.mark.parametrize("colours", [{}, {"colorspace": 1, "color_range": 2}, {"colorspace": 6, "color_range": 1}])
def test_colours_come_back(tmp_path: Path, colours: dict[str, int]) -> None:
    """Strong colours through a lossless codec: what a wrong matrix or range changes by 20 and more."""
    strong = np.zeros((48, 64, 4), np.uint8)
    strong[:, :16], strong[:, 16:32], strong[:, 32:48], strong[:, 48:] = (
        (200, 30, 30, 255), (30, 200, 30, 255), (30, 30, 200, 255), (250, 250, 250, 255),
    )  # fmt: skip
    copied(Arrays([strong] * 2), tmp_path / "a.mp4", options={"crf": "4"})
    video(tmp_path / "tagged.mp4", 2, **colours)
    first = next(iter(Video(tmp_path / "a.mp4"))).read()
    assert np.abs(first.astype(int) - strong)[:, [8, 24, 40, 56]].max() <= 8
    with pg.compile(SCALED(pg.Input("frame"), gain=1.0), backend="numpy") as program:
        source = Video(tmp_path / "tagged.mp4")
        sink = ToVideo(tmp_path / "b.mp4", options={"crf": "4"})
        sink.begin(source)
        frame = next(iter(source))
        sink.stores(frame, (64, 48))
        sink.take(frame, sink.prepare(frame, strong))
        sink.finish()
        assert program is not None
    assert np.abs(next(iter(Video(tmp_path / "b.mp4"))).read().astype(int) - strong)[:, [8, 24, 40, 56]].max() <= 8


def test_more_than_eight_bits_stay(tmp_path: Path) -> None:
    with av.open(str(tmp_path / "a.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = 16, 16, "yuv444p10le"
        ramp = np.linspace(10000, 50000, 256).astype(np.uint16).reshape(16, 16, 1).repeat(3, 2)
        container.mux(stream.encode(av.VideoFrame.from_ndarray(ramp, "rgb48le").reformat(format="yuv444p10le")))
        container.mux(stream.encode())
    source = Video(tmp_path / "a.mkv")
    deep = next(iter(source)).read()
    assert (source.deep, deep.dtype) == (True, np.uint16)
    assert len(np.unique(deep[..., 1])) > 150
    copied(source, tmp_path / "b.mkv")
    again = Video(tmp_path / "b.mkv")
    assert (again.codec, again.format) == ("ffv1", "yuv444p10le")
    assert np.abs(next(iter(again)).read().astype(int) - deep)[..., :3].max() <= 2 * 65536 // 1024


@pytest.mark.parametrize("size", [(63, 48), (64, 47), (63, 47), (1, 1)])
def test_odd_sizes(tmp_path: Path, size: tuple[int, int]) -> None:
    summary = copied(Arrays([picture(100, size)] * 3), tmp_path / "a.mp4")
    assert summary.whole
    assert Video(tmp_path / "a.mp4").size == size
    assert max(abs(gray - 100) for gray in grays(tmp_path / "a.mp4")) <= 2


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv", ".webm", ".avi"])
def test_containers(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    assert copied(Arrays([picture(20 * i, (32, 32)) for i in range(1, 4)]), path, rate=Fraction(10)).whole
    assert np.abs(np.array(grays(path)) - [20, 40, 60]).max() <= 3
    assert Video(path).rate == 10


def test_pictures_become_a_video_and_back(tmp_path: Path) -> None:
    sequence(tmp_path, range(5, 9), (32, 32))
    with inverted() as program:
        pg.frames(program, tmp_path / "in.####.png", tmp_path / "a.mp4")
        pg.frames(program, tmp_path / "a.mp4", tmp_path / "out.%d.png")
    assert [abs(value(tmp_path / f"out.{n}.png") - 10 * (n + 4)) <= 3 for n in range(1, 5)] == [True] * 4


def test_no_encoder_talks_on_stderr(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """x265 writes there by itself, past Python."""
    sequence(tmp_path, range(2), (64, 64))
    with inverted() as program:
        for codec in ("libx264", "libx265", "libvpx-vp9"):
            pg.frames(program, tmp_path / "in.####.png", ToVideo(tmp_path / f"{codec}.mkv", codec=codec))
    assert capfd.readouterr() == ("", "")


class Forgetful:
    """An encoder that tells when packets are decoded by what lies in its memory, as x265 does of two frames."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream

    def encode(self, frame: Any = None) -> Any:
        packets = self.stream.encode(frame)
        for packet in packets:
            packet.dts = 1 << 50
        return packets


@pytest.mark.parametrize("codec", ["libx264", "libx265"])
@pytest.mark.parametrize("count", [1, 2])
def test_few_frames_have_their_times(tmp_path: Path, codec: str, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def start(sink: Any) -> None:
        begin(sink)
        sink._stream = Forgetful(sink._stream)

    begin = ToVideo._start
    monkeypatch.setattr(ToVideo, "_start", start)
    frames = Arrays([picture(20 + 40 * i, (64, 64)) for i in range(count)])
    assert copied(frames, tmp_path / "a.mkv", codec=codec, rate=Fraction(25)).whole
    assert times(tmp_path / "a.mkv") == [Fraction(i, 25) for i in range(count)]


def test_a_missing_frame_leaves_its_time(tmp_path: Path) -> None:
    sequence(tmp_path, [1, 2, 5], (32, 32))
    with inverted() as program:
        pg.frames(program, tmp_path / "in.####.png", ToVideo(tmp_path / "a.mp4", rate=Fraction(10)))
    assert times(tmp_path / "a.mp4") == [0, Fraction(1, 10), Fraction(4, 10)]


def test_another_size_fails_alone(tmp_path: Path) -> None:
    pictures = [picture(10, (32, 32)), picture(20, (16, 32)), picture(30, (32, 32))]
    summary = copied(Arrays(pictures), tmp_path / "a.mp4")
    assert (summary.written, [one.number for one in summary.failed]) == (2, [2])
    assert "array 2: makes 16x32 pixels, and " in summary.failed[0].reason
    assert "has frames of 32x32; a video has one size" in summary.failed[0].reason


def test_a_turned_video_is_read_upright(tmp_path: Path) -> None:
    with av.open(str(tmp_path / "a.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": "5"})
        stream.width, stream.height, stream.pix_fmt = 64, 32, "yuv420p"
        stream.set_display_rotation(90)
        halves = np.full((32, 64, 3), 20, np.uint8)
        halves[:, 32:] = 220
        container.mux(stream.encode(av.VideoFrame.from_ndarray(halves, "rgb24")))
        container.mux(stream.encode())
    upright = next(iter(Video(tmp_path / "a.mp4"))).read()
    assert upright.shape == (64, 32, 4)
    # Turned a quarter counterclockwise, the right half is on top.
    assert upright[8, 16, 0] > 200 > 50 > upright[56, 16, 0]


@pytest.mark.parametrize(
    "shown",
    # The columns of a, b, c, d, and what is shown of [[1, 2, 3], [4, 5, 6]].
    [
        ((1, 0, 0, 1), [[1, 2, 3], [4, 5, 6]]), ((-1, 0, 0, 1), [[3, 2, 1], [6, 5, 4]]),
        ((1, 0, 0, -1), [[4, 5, 6], [1, 2, 3]]), ((-1, 0, 0, -1), [[6, 5, 4], [3, 2, 1]]),
        ((0, 1, -1, 0), [[4, 1], [5, 2], [6, 3]]), ((0, -1, 1, 0), [[3, 6], [2, 5], [1, 4]]),
        ((0, 1, 1, 0), [[1, 4], [2, 5], [3, 6]]), ((0, -1, -1, 0), [[6, 3], [5, 2], [4, 1]]),
    ],
)  # fmt: skip
def test_a_video_is_read_as_it_is_shown(tmp_path: Path, shown: tuple[tuple[int, ...], list[list[int]]]) -> None:
    """All turns and mirrorings that the header of a track may ask for: cameras that show one their face mirror."""
    (a, b, c, d), expected = shown
    blocks = np.kron(np.arange(1, 7, dtype=np.uint8).reshape(2, 3) * 40, np.ones((16, 16), np.uint8))
    copied(Arrays([blocks[..., None].repeat(3, 2)]), tmp_path / "plain.mp4", options={"crf": "1"})
    data = (tmp_path / "plain.mp4").read_bytes()
    plain, one = struct.pack(">9i", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30), 1 << 16
    at = data.index(plain, data.rindex(b"tkhd"))
    matrix = struct.pack(">9i", a * one, b * one, 0, c * one, d * one, 0, 0, 0, 1 << 30)
    (tmp_path / "said.mp4").write_bytes(data[:at] + matrix + data[at + len(plain) :])
    picture = next(iter(Video(tmp_path / "said.mp4"))).read()
    assert np.rint(picture[8::16, 8::16, 1] / 40).tolist() == expected


@pytest.mark.parametrize("format", ["yuv420p", "yuv422p", "yuv444p", "yuv420p10le"])
def test_a_video_that_is_not_changed_is_as_bright_as_before(tmp_path: Path, format: str) -> None:
    """Brightness is held against the definition of luma; through a lossless codec it comes back as it was."""
    step = 4 if format.endswith("10le") else 1
    with av.open(str(tmp_path / "a.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = 96, 64, format
        frame = av.VideoFrame(96, 64, format)
        for number, plane in enumerate(frame.planes):
            y, x = np.mgrid[: plane.height, : plane.width]
            wave = 120 + 30 * np.sin(x / 37 + y / 23) if number == 0 else 128 + 15 * np.sin(x / 17 + number)
            rows = np.zeros((plane.height, plane.line_size // (1 + step // 4)), np.uint16 if step > 1 else np.uint8)
            rows[:, : plane.width] = wave * step
            plane.update(rows.tobytes())
        container.mux(stream.encode(frame))
        container.mux(stream.encode())

    def luma(path: Path) -> Any:
        frame = next(av.open(str(path)).decode(video=0))
        return frame.to_ndarray()[:64] if format != "yuv444p" else frame.to_ndarray()[0]

    copied(Video(tmp_path / "a.mkv"), tmp_path / "b.mkv")
    assert np.array_equal(luma(tmp_path / "a.mkv"), luma(tmp_path / "b.mkv"))
    picture = next(iter(Video(tmp_path / "a.mkv"))).read()
    colours = picture[..., :3] / (65535 if step > 1 else 255)
    bright = 16 + 219 * (colours @ [0.299, 0.587, 0.114])  # ITU-R BT.601-7
    assert abs((bright - luma(tmp_path / "a.mkv") / step).mean()) < 0.5


@pytest.mark.parametrize(
    ("source", "codec", "kept"),
    [
        ("yuva444p10le", "prores_ks", "yuva444p12le"),
        ("yuva420p", "prores_ks", "yuva444p12le"),
        ("argb", "qtrle", "argb"),
    ],
)
def test_transparency_stays_where_an_encoder_can(tmp_path: Path, source: str, codec: str, kept: str) -> None:
    given = tmp_path / ("a.mov" if source == "argb" else "a.mkv")
    with av.open(str(given), "w") as container:
        stream = container.add_stream("qtrle" if source == "argb" else "ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = 32, 16, source
        half = np.full((16, 32, 4), (90, 120, 150, 255), np.uint8)
        half[:, :16, 3] = 128
        container.mux(stream.encode(av.VideoFrame.from_ndarray(half, "rgba").reformat(format=source)))
        container.mux(stream.encode())
    copied(Video(given), tmp_path / "b.mov", codec=codec)
    again = Video(tmp_path / "b.mov")
    picture = next(iter(again)).read()
    alpha = picture[..., 3] / np.iinfo(picture.dtype).max * 255
    assert again.format == kept and abs(alpha[8, 4] - 128) < 3 and abs(alpha[8, 28] - 255) < 1


# Files that are not whole


@pytest.mark.parametrize("suffix", [".mkv", ".mp4"])
def test_a_truncated_video_gives_what_it_has(tmp_path: Path, suffix: str) -> None:
    whole = tmp_path / f"whole{suffix}"
    with av.open(str(whole), "w", options={"movflags": "faststart"} if suffix == ".mp4" else {}) as container:
        stream = container.add_stream("mjpeg", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 64, "yuvj420p"
        rng = np.random.default_rng(1)
        for i in range(20):
            frame = av.VideoFrame.from_ndarray(rng.integers(0, 255, (64, 64, 3), np.uint8), "rgb24")
            frame.pts, frame.time_base = i, Fraction(1, 25)
            container.mux(stream.encode(frame.reformat(format="yuvj420p", dst_color_range=2)))
        container.mux(stream.encode())
    assert copied(whole, tmp_path / f"a{suffix}").whole
    data = whole.read_bytes()
    cut = tmp_path / f"cut{suffix}"
    cut.write_bytes(data[: len(data) * 6 // 10])
    summary = copied(cut, tmp_path / f"b{suffix}")
    assert 9 <= summary.written <= 13
    assert not summary.whole
    assert f"{cut}: truncated; it says it lasts 0.80 s, and its frames end at 0." in summary.stopped
    assert len(grays(tmp_path / f"b{suffix}")) == summary.written


def test_damage_in_the_middle_is_named(tmp_path: Path) -> None:
    whole = video(tmp_path / "a.mov", 12, (64, 64), codec="png", pix_fmt="rgb24")
    parts = whole.read_bytes().split(b"\x89PNG")
    assert len(parts) == 13
    whole.write_bytes(b"\x89PNG".join(parts[:5]) + b"\0" * 4 + b"\x89PNG".join(parts[5:]))
    told = list[Outcome]()
    with inverted("numpy") as program:
        summary = pg.frames(program, whole, tmp_path / "out.##.png", watch=told.append)
    assert [one.number for one in summary.failed] == [5]
    assert "frame 5: is damaged (Invalid data" in summary.failed[0].reason
    assert summary.written == 11
    assert told[-1].state == "written"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "cannot be read as a video"),
        (b"not a video at all" * 100, "cannot be read as a video"),
        (b"ffconcat version 1.0\nfile other.mp4\n", "cannot be read as a video"),
        (b"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nother.ts\n#EXT-X-ENDLIST\n", "cannot be read as a video"),
        (None, "no such file"),
    ],
)
def test_what_is_no_video(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "a.mp4"
    video(tmp_path / "other.mp4", 2)
    video(tmp_path / "other.ts", 2)
    if content is not None:
        path.write_bytes(content)
    with inverted() as program, pytest.raises(InputError, match=message):
        pg.frames(program, path, tmp_path / "b.mp4")
    assert not (tmp_path / "b.mp4").exists()


def test_a_video_of_sound_alone(tmp_path: Path) -> None:
    with av.open(str(tmp_path / "a.mp4"), "w") as container:
        stream = container.add_stream("aac", rate=8000, layout="mono")
        heard = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), "fltp", "mono")
        heard.sample_rate = 8000
        container.mux(stream.encode(heard))
        container.mux(stream.encode())
    with pytest.raises(InputError, match=r"has no video stream that can be decoded; expected a video"):
        Video(tmp_path / "a.mp4")


# Outputs that are not whole


def test_an_older_video_stays_until_the_new_one_is_whole(tmp_path: Path) -> None:
    old = tmp_path / "a.mp4"
    old.write_bytes(b"precious")

    def stop(outcome: Outcome) -> None:
        assert old.read_bytes() == b"precious"
        if outcome.number == 3:
            raise KeyboardInterrupt

    with inverted() as program:
        with pytest.raises(KeyboardInterrupt):
            pg.frames(program, Arrays([picture(1, (32, 32))] * 30), old, watch=stop)
        assert names_in(tmp_path) == ["a.mp4", "a.partial.mp4"]
        assert old.read_bytes() == b"precious"
        pg.frames(program, Arrays([picture(1, (32, 32))] * 3), old)
    assert len(grays(old)) == 3


def test_nothing_written_leaves_nothing(tmp_path: Path) -> None:
    with inverted() as program:
        summary = pg.frames(program, Arrays([np.full((4, 4, 4), np.nan, np.float32)]), tmp_path / "a.mp4")
    assert (summary.written, len(summary.failed)) == (0, 1)
    assert not list(tmp_path.iterdir())


def test_a_full_disk_keeps_what_is_encoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sink = ToVideo(tmp_path / "a.mp4")
    encode, count = ToVideo._encode, iter(range(100))

    def full(self: ToVideo, frame: Any, prepared: Any) -> None:
        if next(count) == 5:
            raise av.error.OSError(28, "No space left on device")
        encode(self, frame, prepared)

    monkeypatch.setattr(ToVideo, "_encode", full)
    with inverted() as program:
        summary = pg.frames(program, Arrays([picture(1, (32, 32))] * 30), sink)
    assert summary.stopped.startswith("the disk is full: ")
    assert summary.stopped.endswith("a.partial.mp4 has what was encoded")
    assert (summary.written, names_in(tmp_path)) == (0, ["a.partial.mp4"])
    assert len(grays(tmp_path / "a.partial.mp4")) == 5


@pytest.mark.parametrize(
    ("name", "how", "message"),
    [
        ("none/a.mp4", {}, r"the folder .*none does not exist"),
        ("a.mp4", {"codec": "nonsense"}, r"no encoder 'nonsense' for such a file; others are libx264"),
        ("a.mp4", {"codec": "aac"}, r"no encoder 'aac' for such a file"),
        ("a.webm", {"codec": "libx264"}, r"no encoder 'libx264' for such a file"),
        ("a.wrong", {}, r"a\.wrong: cannot be written as a video"),
    ],
)
def test_what_cannot_be_written(tmp_path: Path, name: str, how: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        copied(Arrays([picture(1, (32, 32))]), tmp_path / name, **how)
    assert not list(tmp_path.iterdir())


def test_options_of_an_encoder(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    noise = [rng.integers(0, 255, (64, 64, 4), np.uint8) | np.uint8([0, 0, 0, 255]) for _ in range(3)]
    copied(Arrays(noise), tmp_path / "fine.mp4", options={"crf": "5"})
    copied(Arrays(noise), tmp_path / "coarse.mp4", options={"crf": "45"})
    assert (tmp_path / "coarse.mp4").stat().st_size * 3 < (tmp_path / "fine.mp4").stat().st_size
    with pytest.raises(InputError, match=r"a\.mp4: cannot be written"):
        copied(Arrays(noise), tmp_path / "a.mp4", options={"preset": "nonsense"})
    with pytest.raises(InputError, match=r"a\.mp4: the encoder libx264 has no option 'nonsense'"):
        copied(Arrays(noise), tmp_path / "a.mp4", options={"crf": "20", "nonsense": "1"})
    assert not (tmp_path / "a.mp4").exists()


def test_a_video_is_not_written_over_itself(tmp_path: Path) -> None:
    video(tmp_path / "a.mp4", 3)
    (tmp_path / "link.mp4").symlink_to("a.mp4")
    with pytest.raises(InputError, match=r"would be overwritten while it is read"):
        copied(tmp_path / "a.mp4", tmp_path / "link.mp4")
    assert len(grays(tmp_path / "a.mp4")) == 3


def test_without_pyav_the_cure_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "av", None)
    with inverted() as program, pytest.raises(InputError, match=r"PyAV is not installed; run: pip install"):
        pg.frames(program, Arrays([picture(1)]), tmp_path / "a.mp4")
    assert INVERT is not None


@pytest.mark.parametrize("width", [34, 66, 98, 100, 130])
def test_every_column_of_a_narrow_video_is_read(tmp_path: Path, width: int) -> None:
    """Widths that are no multiple of what swscale writes at once."""
    flat = [np.full((34, width, 4), (200, 100, 50, 255), np.uint8)] * 2
    assert copied(Arrays(flat), tmp_path / "a.mp4").whole
    for frame in Video(tmp_path / "a.mp4"):
        made = frame.read()
        assert (made[..., 3] == 255).all()
        assert np.abs(made[..., :3].astype(int) - (200, 100, 50)).max() <= 3


@pytest.mark.parametrize(("codec", "suffix"), [("mpeg2video", ".mpg"), ("libx264", ".mp4")])
def test_interlaced_video_is_told(tmp_path: Path, codec: str, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / f"fields{suffix}"
    with av.open(str(source), "w") as container:
        stream = container.add_stream(codec, 25)
        stream.width, stream.height, stream.pix_fmt, stream.options = 64, 48, "yuv420p", {"flags": "+ildct+ilme"}
        for level in (40, 80, 120):
            frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), level, np.uint8))
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.warns(UserWarning, match="is interlaced; .* deinterlace it first"):
        assert len(list(Video(source))) == 3
    assert run(["apply", "black-and-white", str(source), "-o", str(tmp_path / "out.mp4")]) == 0
    assert "passgraph: warning: " in (said := capfd.readouterr().err) and "is interlaced" in said
    assert not Video(tmp_path / "out.mp4").is_interlaced


# Rates


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
@pytest.mark.parametrize("rate", [Fraction(1, 1_000_000), Fraction(0), Fraction(-1), Fraction(1001)])
def test_rates_that_cannot_be_written_are_told(tmp_path: Path, name: str, rate: Fraction) -> None:
    with pytest.raises(InputError, match=rf"{name}: .* frames a second; expected 1/1000 to 1000"):
        open_film(tmp_path / name, rate)


def test_a_slow_source_is_written(tmp_path: Path) -> None:
    """A rate below the smallest fraction that libav has; frames have their own times."""
    sink = ToVideo(tmp_path / "slow.mp4")
    sink.rate_for = lambda source: Fraction(1, 1_000_000)  # type: ignore[method-assign]
    with inverted() as program:
        assert pg.frames(program, Arrays([picture(1)]), sink).written == 1


@pytest.mark.parametrize("seconds", ["1e9999999", "1/0", "nan", "x"])
def test_a_duration_that_is_no_number_is_unknown(seconds: str) -> None:
    """`Fraction` alone would compute the first one forever."""
    stream: Any = SimpleNamespace(duration=None, time_base=None, start_time=0, metadata={"DURATION": f"0:0:{seconds}"})
    assert _duration(stream) is None
    stream.metadata["DURATION"] = "00:01:02.500000000"
    assert _duration(stream) == Fraction(125, 2)
