"""Animated GIF, PNG and WebP in and out: pictures, times, alpha, and files that are not whole."""

from __future__ import annotations

import io
import struct
import zlib
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands.render import check_turntable
from passgraph.errors import InputError
from passgraph.files import Animation, Arrays, ToAnimation
from passgraph.files.animation import is_animated
from passgraph.files.open import open_film, open_sink, open_source
from tests.commands.told import Outcome, refused
from tests.files.made import SCALED, inverted, sequence
from tests.picture_files import names_in

LENGTHS = [40, 70, 100, 0, 300]
#: What browsers show, in seconds: no time at all is a tenth of a second.
SHOWN = [Fraction(n, 1000) for n in (40, 70, 100, 100, 300)]
GRAY = ["apply", "black-and-white", "-b", "reference"]
SUFFIXES = (".gif", ".png", ".webp")


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def frames_of(count: int = 5, size: tuple[int, int] = (9, 7), seed: int = 1) -> list[np.ndarray[Any, Any]]:
    """Each pixel one of four colours, or not there."""
    colours = np.array([[255, 0, 0, 255], [0, 255, 9, 255], [7, 0, 255, 255], [9, 200, 100, 255], [0, 0, 0, 0]])
    chosen = np.random.default_rng(seed).integers(0, 5, (count, size[1], size[0]))
    return list(colours.astype(np.uint8)[chosen])


def animation(name: str, frames: list[np.ndarray[Any, Any]], **how: Any) -> Path:
    """Written by Pillow."""
    first, *rest = [Image.fromarray(frame) for frame in frames]
    kind: dict[str, Any] = {".gif": {"disposal": 2}, ".webp": {"lossless": True, "exact": True}}.get(
        Path(name).suffix, {}
    )
    how = {"duration": LENGTHS[: len(frames)], "loop": 0, **kind, **how}
    first.save(name, save_all=True, append_images=rest, **how)
    return Path(name)


def visible(picture: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Without the colours of what is not there."""
    return np.where(picture[..., 3:] > 0, picture, 0)


def alike(pictures: Any, expected: Any) -> bool:
    return len(pictures) == len(expected) and all(
        np.array_equal(visible(a), visible(b)) for a, b in zip(pictures, expected, strict=True)
    )


def lengths(source: Animation) -> list[Fraction]:
    return [frame.metadata["duration"] * frame.metadata["time_base"] for frame in source]


def copied(source: Any, path: str, **how: Any) -> Any:
    """A source through a program that changes nothing."""
    with pg.compile(SCALED(pg.Input("frame", "rgba8"), gain=1.0), backend="numpy") as program:
        return pg.frames(program, source, ToAnimation(path, **how))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frames_are_whole_pictures_with_their_times(suffix: str) -> None:
    drawn = frames_of()
    source = open_source(animation(f"a{suffix}", drawn))
    assert isinstance(source, Animation)
    assert (source.size, source.count, source.rate, source.plays) == ((9, 7), 5, 5 / sum(SHOWN), 0)
    found = list(source)
    assert [frame.name for frame in found] == [f"a{suffix}, frame {n}" for n in range(1, 6)]
    assert alike([frame.read() for frame in found], drawn)
    assert lengths(source) == SHOWN
    starts = [frame.metadata["pts"] * frame.metadata["time_base"] for frame in found]
    assert starts == [sum(SHOWN[:n]) for n in range(5)]


@pytest.mark.parametrize("disposal", [0, 1, 2, 3])
def test_what_a_gif_leaves_of_the_frame_before_is_what_another_decoder_leaves(disposal: int) -> None:
    av = pytest.importorskip("av")
    animation("a.gif", frames_of(), disposal=disposal)
    with av.open("a.gif") as container:
        theirs = [frame.to_ndarray(format="rgba") for frame in container.decode(video=0)]
    assert alike([frame.read() for frame in Animation("a.gif")], theirs)


def encoded(container: str, codec: str, pixel_format: str, frames: list[np.ndarray[Any, Any]]) -> bytes:
    """Written by ffmpeg, which stores what changes from frame to frame."""
    av = pytest.importorskip("av")
    stream = io.BytesIO()
    with av.open(stream, "w", format=container) as output:
        video = output.add_stream(codec, rate=10)
        video.height, video.width = frames[0].shape[:2]
        video.pix_fmt = pixel_format
        for frame in frames:
            output.mux(video.encode(av.VideoFrame.from_ndarray(frame, format="rgba").reformat(format=pixel_format)))
        output.mux(video.encode())
    return stream.getvalue()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", [("gif", "gif", "bgr8"), ("apng", "apng", "rgba")])
def test_frames_that_store_what_changes_are_composed_as_ffmpeg_does(seed: int, kind: tuple[str, str, str]) -> None:
    rng = np.random.default_rng(seed)
    frames = [rng.integers(0, 4, (24, 32, 4)).astype(np.uint8) * 85]
    for _ in range(5):
        frames.append(frames[-1].copy())
        top, left = rng.integers(0, 16, 2)
        frames[-1][top : top + 8, left : left + 12] = rng.integers(0, 4, (8, 12, 4)) * 85
    if kind[0] == "gif":
        for frame in frames:
            frame[..., 3] = 255
    path = Path("a.gif" if kind[0] == "gif" else "a.png")
    path.write_bytes(encoded(*kind, frames))
    assert alike([frame.read() for frame in Animation(path)], theirs(str(path)))
    if kind[0] == "apng":
        assert alike([frame.read() for frame in Animation(path)], frames)


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def test_a_damaged_apng_is_told() -> None:
    path = animation("a.png", frames_of())
    data = path.read_bytes()
    at = data.rindex(b"fdAT") + 12
    path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
    with pytest.raises(InputError, match=r"a\.png: truncated or corrupt .*; the 4 frames before are done"):
        [frame.read() for frame in Animation(path)]


def test_an_apng_of_a_frame_beyond_the_picture_is_refused_before_memory_is_asked_for() -> None:
    data = animation("a.png", frames_of()).read_bytes()
    at = data.index(b"fcTL", data.index(b"fcTL") + 4)
    body = data[at + 4 : at + 8] + struct.pack(">II", 1 << 30, 1 << 30) + data[at + 16 : at + 30]
    Path("a.png").write_bytes(data[: at - 4] + chunk(b"fcTL", body) + data[at + 34 :])
    with pytest.raises(InputError, match=r"truncated or corrupt .*the one frame before is done"):
        [frame.read() for frame in Animation("a.png")]


def test_a_picture_before_the_first_frame_is_not_shown() -> None:
    """A PNG for readers that know no animations."""
    drawn = frames_of()
    source = Animation(animation("a.png", drawn, duration=LENGTHS[1:], default_image=True))
    assert alike([frame.read() for frame in source], drawn[1:])
    assert lengths(source) == SHOWN[1:]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("plays", [0, 1, 3])
def test_how_often_it_is_shown(suffix: str, plays: int) -> None:
    """Of a GIF the repetitions are counted; it has no such number where it is shown once."""
    how = {"loop": plays} if suffix != ".gif" else {"loop": plays - 1} if plays > 1 else {"loop": None if plays else 0}
    source = Animation(animation(f"a{suffix}", frames_of(), **how))
    assert source.plays == plays
    for written in ("b.gif", "b.apng"):
        copied(source, written)
        assert Animation(written).plays == plays


@pytest.mark.parametrize("written", ["b.gif", "b.apng"])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_pictures_times_and_alpha_come_back(suffix: str, written: str) -> None:
    drawn = frames_of()
    summary = copied(Animation(animation(f"a{suffix}", drawn)), written)
    assert (summary.written, summary.whole) == (5, True)
    made = Animation(written)
    assert alike([frame.read() for frame in made], drawn)
    assert lengths(made) == SHOWN


def test_an_apng_keeps_every_alpha() -> None:
    drawn = list(np.random.default_rng(2).integers(1, 256, (3, 5, 4, 4)).astype(np.uint8))
    copied(Arrays(drawn), "b.apng", rate=Fraction(8))
    assert alike([frame.read() for frame in Animation("b.apng")], drawn)
    assert lengths(Animation("b.apng")) == [Fraction(1, 8)] * 3


@pytest.mark.parametrize("least_alpha", [0, 255])
def test_a_gif_of_many_colours_is_near(least_alpha: int) -> None:
    """More colours than a frame holds are dithered: means over areas stay; from half on, pixels are there."""
    down, across = np.mgrid[0:64, 0:64]
    alpha = np.maximum(down * 4, least_alpha)
    frame = np.stack([across * 4, down * 4, 128 + 0 * down, alpha], axis=-1).astype(np.uint8)
    copied(Arrays([frame, frame[::-1]]), "b.gif")
    for drawn, made in zip([frame, frame[::-1]], Animation("b.gif"), strict=True):
        shown, seen = made.read(), drawn[..., 3] >= 128
        assert np.array_equal(shown[..., 3] == 255, seen)
        off = np.where(seen[..., None], shown[..., :3].astype(int) - drawn[..., :3], 0)
        assert np.abs(off.reshape(8, 8, 8, 8, 3).mean(axis=(1, 3))).max() < 4
        assert np.abs(off).max() < 40


@pytest.mark.parametrize("count", [254, 255, 256, 257])
@pytest.mark.parametrize("is_whole", [True, False])
def test_a_gif_keeps_255_colors(count: int, is_whole: bool) -> None:
    """Exactly; one number is left for transparent pixels."""
    frame = np.zeros((1, 300, 4), np.uint8)
    frame[..., 0], frame[..., 1] = np.arange(300) % count % 256, np.arange(300) % count // 256
    frame[..., 3] = 255
    if not is_whole:
        frame[0, count:, 3] = 0
    copied(Arrays([frame, frame[:, ::-1]]), "b.gif")
    shown = [one.read() for one in Animation("b.gif")]
    assert alike(shown, [frame, frame[:, ::-1]]) == (count <= 255)
    assert np.array_equal(shown[0][..., 3], frame[..., 3])


def theirs(path: str) -> list[np.ndarray[Any, Any]]:
    """What libav makes of a file."""
    av = pytest.importorskip("av")
    with av.open(path) as container:
        return [frame.to_ndarray(format="rgba") for frame in container.decode(video=0)]


@pytest.mark.parametrize("order", ["wtwt", "ttww", "etee", "eew", "tete", "ww"])
def test_whole_pictures_and_such_that_are_seen_through_come_in_any_order(order: str) -> None:
    """Whole ones (w), some seen through (t) and empty ones (e): what is behind never shows, and none is lost."""
    drawn = {"t": frames_of(len(order), seed=3), "w": frames_of(len(order), seed=4), "e": frames_of(len(order))}
    for whole, empty in zip(drawn["w"], drawn["e"], strict=True):
        whole[..., 3], empty[:] = 255, 0
    frames = [drawn[kind][number] for number, kind in enumerate(order)]
    copied(Arrays(frames), "b.gif", rate=Fraction(10))
    # One that is as the one before is that one for longer.
    changes = [one for number, one in enumerate(frames) if not number or not alike([one], [frames[number - 1]])]
    made = Animation("b.gif")
    assert alike([frame.read() for frame in made], changes)
    assert sum(lengths(made)) == Fraction(len(order), 10)
    assert alike(theirs("b.gif"), changes)


def test_a_whole_picture_of_all_colours_makes_room_for_what_is_seen_through() -> None:
    whole, part = np.zeros((2, 16, 32, 4), np.uint8)
    whole[..., 0], whole[..., 3], part[:8] = np.arange(512).reshape(16, 32) % 256, 255, (9, 8, 7, 255)
    copied(Arrays([whole, part, whole]), "b.gif")
    for made in [frame.read() for frame in Animation("b.gif")], theirs("b.gif"):
        for drawn, one in zip([whole, part, whole], made, strict=True):
            assert np.array_equal(one[..., 3], drawn[..., 3])
            seen = drawn[..., 3] == 255
            assert np.abs(one[seen].astype(int) - drawn[seen]).max() <= 4


def test_only_what_changes_is_stored_of_whole_pictures() -> None:
    still = np.random.default_rng(5).integers(0, 200, (64, 64, 4)).astype(np.uint8)
    still[..., 1:] = 0, 0, 255
    other = still.copy()
    other[20:22, 30:34] = 7, 200, 9, 255
    copied(Arrays([still, still]), "one.gif")
    copied(Arrays([still, other, still]), "b.gif")
    assert alike([frame.read() for frame in Animation("b.gif")], [still, other, still])
    assert Path("b.gif").stat().st_size < Path("one.gif").stat().st_size + 2000


def test_a_time_that_a_gif_cannot_hold_is_an_error() -> None:
    """Two bytes hold eleven minutes of hundredths."""
    with pytest.raises(InputError, match=r"b\.gif: shows a frame for 700 s; expected at most 655\.35 s"):
        copied(Arrays(frames_of(3)), "b.gif", rate=Fraction(1, 700))
    assert names_in() == []


def test_a_gif_is_shown_as_often_as_it_can_say() -> None:
    copied(Animation(animation("a.png", frames_of(), loop=70_000)), "b.gif")
    assert Animation("b.gif").plays == 65_536


def test_frames_too_short_to_show_are_left_out_and_time_goes_on() -> None:
    """60 a second are more than a GIF shows: each that is kept lasts 20 ms or more, and all end when they should."""
    drawn = [np.full((2, 3, 4), (n, 0, 0, 255), np.uint8) for n in range(61)]
    copied(Arrays(drawn), "b.gif", rate=Fraction(60))
    made = Animation("b.gif")
    assert min(lengths(made)) >= Fraction(20, 1000)
    starts = [frame.metadata["pts"] * frame.metadata["time_base"] for frame in made]
    shown = [int(frame.read()[0, 0, 0]) for frame in made]
    assert all(abs(start - Fraction(n, 60)) <= Fraction(1, 200) for start, n in zip(starts, shown, strict=True))
    assert abs(sum(lengths(made)) - Fraction(61, 60)) <= Fraction(1, 100)


def test_a_video_has_the_times_and_an_animation_those_of_a_video() -> None:
    av = pytest.importorskip("av")
    with inverted("numpy") as program:
        pg.frames(program, animation("a.gif", frames_of(5, (16, 16))), "b.mp4")
        pg.frames(program, Path("b.mp4"), "c.gif")
    with av.open("b.mp4") as container:
        starts = [frame.pts * frame.time_base for frame in container.decode(video=0)]
        assert abs(container.duration / 1e6 - float(sum(SHOWN))) < 1e-3
    assert starts == [sum(SHOWN[:n]) for n in range(5)]
    assert lengths(Animation("c.gif"))[:4] == SHOWN[:4]


@pytest.mark.parametrize("suffix", [".gif", ".png"])
def test_a_truncated_file_gives_what_it_has(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    whole = animation(f"a{suffix}", frames_of(size=(64, 48))).read_bytes()
    Path(f"b{suffix}").write_bytes(whole[: len(whole) * 7 // 10])
    outcome = Outcome(capsys, *GRAY, f"b{suffix}", "-o", "out.gif")
    assert outcome.status == 1
    assert f"b{suffix}: truncated" in outcome.err
    assert 2 <= Animation("out.gif").count < 5
    assert "ended early" in outcome.out


def test_a_truncated_webp_is_refused() -> None:
    """Pillow's decoder takes whole files only."""
    whole = animation("a.webp", frames_of(size=(64, 48))).read_bytes()
    Path("b.webp").write_bytes(whole[: len(whole) * 7 // 10])
    with pytest.raises(InputError, match=r"b\.webp: truncated or corrupt"):
        Animation("b.webp")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_hostile_bytes_are_refused_or_read(suffix: str) -> None:
    """Whatever is changed, reading ends, with frames of the file's size or an error of ours."""
    whole = animation(f"a{suffix}", frames_of(3)).read_bytes()
    rng = np.random.default_rng(3)
    for _ in range(60):
        broken = bytearray(whole[: rng.integers(8, len(whole) + 1)])
        for place in rng.integers(6, len(broken), 3):
            broken[place] = rng.integers(256)
        Path(f"b{suffix}").write_bytes(broken)
        try:
            source = Animation(f"b{suffix}")
            for frame in source:
                assert frame.read().shape == (*source.size[::-1], 4)
            told = f"b{suffix}"
        except InputError as error:
            told = str(error)
        assert told.startswith(f"b{suffix}")


def test_what_is_no_animation() -> None:
    still = Image.fromarray(frames_of(1)[0])
    for name in ("a.gif", "a.png", "a.webp"):
        still.save(name)
        assert not is_animated(Path(name))
        with pytest.raises(InputError, match="is no animation of several frames"):
            Animation(name)
    Path("b.gif").write_bytes(b"")
    Path("c.gif").mkdir()
    assert not is_animated(Path("b.gif"))
    assert not is_animated(Path("c.gif"))
    assert not is_animated(Path("none.gif"))
    with pytest.raises(InputError, match=r"none\.gif: no such file"):
        Animation("none.gif")
    with pytest.raises(InputError, match=r"b\.bmp: unknown suffix '\.bmp' of an animation; expected \.gif or \.apng"):
        ToAnimation("b.bmp")
    with io.BytesIO() as stream:
        Image.fromarray(np.zeros((2, 2), np.uint16)).save(
            stream, "PNG", save_all=True, append_images=[Image.fromarray(np.ones((2, 2), np.uint16))]
        )
        Path("deep.png").write_bytes(stream.getvalue())
    with pytest.raises(InputError, match="has frames of 16 bits; expected 8 bits a channel"):
        Animation("deep.png")


def test_sizes_that_no_memory_holds_are_refused_before_it_is_asked_for() -> None:
    whole = bytearray(animation("a.gif", frames_of()).read_bytes())
    whole[6:10] = b"\xff\xff\xff\xff"
    Path("b.gif").write_bytes(whole)
    with pytest.raises(InputError, match=r"65535×65535|4294836225 pixels"):
        Animation("b.gif")


# The command line


def test_an_animation_goes_into_any_output(capsys: pytest.CaptureFixture[str]) -> None:
    animation("a.gif", frames_of())
    Path("in").mkdir()
    Path("a.gif").rename("in/a.gif")
    sequence(Path("in"), range(1, 3), (9, 7))
    for arguments, made in (
        (["in/a.gif", "-o", "b.gif"], "b.gif: 5 frames 9x7"),
        (["in/a.gif", "-o", "b.apng"], "b.apng: 5 frames 9x7"),
        (["in/a.gif", "-o", "b.%02d.png"], "b.%02d.png: 5 frames 9x7"),
        (["in/a.gif", "-o", "frames"], "frames/a.%04d.png: 5 frames 9x7"),
        (["in", "-o", "all/"], "all/a.%04d.png: 5 frames 9x7"),
        (["in/in.0001.png", "-o", "one.gif"], "one.gif: 1 frame 9x7"),
        (["in/in.0001.png", "in/in.0002.png", "--rate", "4", "-o", "two.gif"], "two.gif: 2 frames 9x7"),
    ):
        outcome = Outcome(capsys, *GRAY, *arguments)
        assert (outcome.status, outcome.err) == (0, ""), arguments
        assert made in outcome.out
    assert lengths(Animation("b.gif")) == lengths(Animation("b.apng")) == SHOWN
    assert names_in("frames") == [f"a.000{n}.png" for n in range(1, 6)]
    assert len(names_in("all")) == 7
    assert lengths(Animation("two.gif")) == [Fraction(1, 4)] * 2
    gray = np.stack([frame.read() for frame in Animation("b.gif")])
    assert np.array_equal(gray[..., 3], np.stack(frames_of())[..., 3])
    assert (gray[..., 0] == gray[..., 2]).all()


def test_one_picture_of_an_animation_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    for suffix in SUFFIXES:
        animation(f"a{suffix}", frames_of())
        outcome = Outcome(capsys, *GRAY, f"a{suffix}", "-o", "one.jpg.png")
        assert outcome.status == 0
        assert outcome.err == (
            f"passgraph: warning: a{suffix}: holds several pictures; the first is read; for all of them: -o out.gif, "
            "out.mp4 or out/\n"
        )


def test_what_an_animation_cannot_be(capsys: pytest.CaptureFixture[str]) -> None:
    animation("a.gif", frames_of())
    for arguments, told in (
        (["a.gif", "-o", "a.gif"], "a.gif: would overwrite the input a.gif"),
        (["a.gif", "--rate", "3", "-o", "b.gif"], "--rate is for videos made of pictures"),
        (["a.gif", "--codec", "libx264", "-o", "b.gif"], "--codec-option are for videos"),
    ):
        assert told in refused(capsys, *GRAY, *arguments)
    animation("c.gif", frames_of(2, (4, 4)))
    assert "would all be written to it; give a folder" in refused(capsys, *GRAY, "a.gif", "c.gif", "-o", "b.gif")


def test_resume_leaves_what_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    animation("a.gif", frames_of())
    assert Outcome(capsys, *GRAY, "a.gif", "-o", "b.gif").status == 0
    assert "b.gif: is there already" in Outcome(capsys, *GRAY, "a.gif", "-o", "b.gif", "--resume").out


def test_a_run_that_fails_leaves_nothing() -> None:
    sizes = [np.zeros((2, 3, 4), np.uint8), np.zeros((3, 3, 4), np.uint8)]
    summary = copied(Arrays(sizes), "b.gif")
    assert "has frames of 3x2; an animation has one size" in summary.failed[0].reason
    assert summary.written == 1
    with pytest.raises(InputError, match=r"folder .* does not exist"):
        copied(Arrays(sizes[:1]), "nowhere/b.gif")
    assert names_in() == ["b.gif"]
    assert isinstance(open_sink("c.apng"), ToAnimation)


def test_a_turntable_may_be_an_animation() -> None:
    check_turntable(Path("turn.gif"), None, False, Fraction(5))
    copied = open_film(Path("turn.gif"), Fraction(5))
    assert isinstance(copied, ToAnimation)
    assert copied.rate == 5
