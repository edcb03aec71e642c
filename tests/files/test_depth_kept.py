"""A result has the bits a channel of what it is made of, where its format has them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageCms

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.files.run import frames
from passgraph.files.sequences import Pictures, ToPictures
from passgraph.pictures import load_stored

WIDE = np.random.default_rng(0).integers(0, 65536, (6, 8, 3), np.uint16)
SAME = ("gaussian-blur", "--sigma-px", "0", "-b", "numpy")


def unchanged() -> pg.Program:
    one = pg.kernel(source="def one(c: Image) -> vec4: return c[0, 0]")
    return pg.compile(one(pg.Input("c")), "numpy")


@pytest.mark.parametrize("to", [".png", ".tif"])
@pytest.mark.parametrize("given", [".png", ".tif"])
@pytest.mark.parametrize("many", [False, True], ids=["one", "many"])
def test_sixteen_bits_stay(tmp_path: Path, given: str, to: str, many: bool, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "in").mkdir()
    for name in ("a", "b"):
        pg.save(tmp_path / "in" / f"{name}.1{given}", WIDE)
    source = tmp_path / "in" / f"a.%d{given}" if many else tmp_path / "in" / f"a.1{given}"
    output = tmp_path / (f"out.%d{to}" if many else f"out.1{to}")
    assert run(["apply", *SAME, str(source), "-o", str(output)]) == 0
    made = load_stored(tmp_path / f"out.1{to}")
    assert made.dtype == np.uint16
    assert np.array_equal(made[..., :3], WIDE)
    assert "warning" not in capsys.readouterr().err
    assert run(["apply", *SAME, str(source), "-o", str(output), "--bits", "8"]) == 0
    assert load_stored(tmp_path / f"out.1{to}").dtype == np.uint8


@pytest.mark.parametrize("many", [False, True], ids=["one", "many"])
def test_lost_bits_are_told(tmp_path: Path, many: bool, capsys: pytest.CaptureFixture[str]) -> None:
    pg.save(tmp_path / "a.1.tif", WIDE)
    source, output = ("a.%d.tif", "out.%d.jpg") if many else ("a.1.tif", "out.1.jpg")
    assert run(["apply", *SAME, str(tmp_path / source), "-o", str(tmp_path / output)]) == 0
    assert capsys.readouterr().err == (
        f"passgraph: warning: {tmp_path / 'out.1.jpg'}: JPEG holds 8 bits a channel, and the source has 16; "
        f"to keep them, save as .png or .tif ({tmp_path / 'a.1.tif'})\n"
    )


def test_python_keeps_them_or_warns(tmp_path: Path) -> None:
    pg.save(tmp_path / "a.tif", WIDE)
    picture = pg.load(tmp_path / "a.tif")
    pg.save(tmp_path / "b.png", picture, like=tmp_path / "a.tif")
    assert np.array_equal(load_stored(tmp_path / "b.png")[..., :3], WIDE)
    with pytest.warns(UserWarning, match="WebP holds 8 bits a channel, and the source has 16"):
        pg.save(tmp_path / "b.webp", picture, like=tmp_path / "a.tif")
    with unchanged() as program:
        frames(program, Pictures([tmp_path / "a.tif"]), ToPictures({1: tmp_path / "c.png"}))
        assert np.array_equal(load_stored(tmp_path / "c.png")[..., :3], WIDE)
        with pytest.warns(UserWarning, match="JPEG holds 8 bits a channel"):
            frames(program, Pictures([tmp_path / "a.tif"]), ToPictures({1: tmp_path / "c.jpg"}))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            frames(program, Pictures([tmp_path / "a.tif"]), ToPictures({1: tmp_path / "c.jpg"}, 8))


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_notes_go_into_files_of_sixteen_bits(tmp_path: Path, suffix: str) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    exif = Image.Exif()
    exif[0x010E] = "a description"
    Image.new("RGB", (8, 6)).save(tmp_path / "a.png", icc_profile=profile, dpi=(300, 150), exif=exif)
    pg.save(tmp_path / f"b{suffix}", WIDE, like=tmp_path / "a.png")
    with Image.open(tmp_path / f"b{suffix}") as made:
        assert made.info["icc_profile"] == profile
        assert made.info["dpi"] == pytest.approx((300, 150), abs=0.0254)  # a PNG counts whole dots a meter
        if suffix == ".png":
            assert made.getexif()[0x010E] == "a description"
    assert np.array_equal(load_stored(tmp_path / f"b{suffix}")[..., :3], WIDE)


def test_frames_of_deep_videos_are_pictures_of_sixteen_bits(tmp_path: Path) -> None:
    av: Any = pytest.importorskip("av")
    with av.open(str(tmp_path / "a.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = 16, 8, "yuv444p10le"
        frame = av.VideoFrame(16, 8, "yuv444p10le")
        for plane, value in zip(frame.planes, (500, 512, 512), strict=True):
            plane.update(np.full(plane.buffer_size // 2, value, np.uint16).tobytes())
        container.mux([*stream.encode(frame), *stream.encode()])
    assert run(["apply", *SAME, str(tmp_path / "a.mkv"), "-o", str(tmp_path / "b.%d.png")]) == 0
    made = load_stored(tmp_path / "b.1.png")
    assert made.dtype == np.uint16
    assert abs(int(made[0, 0, 0]) - (500 - 64) / 876 * 65535) <= 0.52
