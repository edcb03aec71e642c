"""What files say beside their pixels goes from a picture to the one that is made of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import ExifTags, Image, ImageCms
from PIL.TiffImagePlugin import IFDRational

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.files import Pictures, ToPictures
from passgraph.files.names import Pattern
from passgraph.image_formats import Metadata
from passgraph.image_writing import image_spec

PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
COLOURS = np.linspace(0, 255, 4 * 6 * 3).astype(np.uint8).reshape(4, 6, 3)


def photo(path: Path, **said: Any) -> Path:
    Image.fromarray(COLOURS).save(path, **{"quality": 100, "subsampling": 0} | said)
    return path


def camera(**said: int) -> Image.Exif:
    exif = Image.Exif()
    exif[ExifTags.Base.Model], exif[ExifTags.Base.Orientation] = "a camera", 6
    exif[ExifTags.Base.ImageWidth] = 6
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.DateTimeOriginal] = "2020:02:02 20:20:20"
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.ExifImageWidth] = 6
    return exif


@pytest.mark.parametrize(
    ("name", "bits"), [("b.png", 8), ("b.tif", 8), ("b.jpg", 8), ("b.webp", 8), ("b.png", 16), ("b.tif", 16)]
)
def test_a_colour_profile_goes_along(tmp_path: Path, name: str, bits: int) -> None:
    given = photo(tmp_path / "a.jpg", icc_profile=PROFILE)
    picture = np.full((4, 6, 4), 255, np.uint8) if bits == 8 else np.full((4, 6, 4), 65535, np.uint16)
    pg.save(tmp_path / name, picture, like=given)
    with Image.open(tmp_path / name) as made:
        assert made.info["icc_profile"] == PROFILE
        assert made.convert("RGB").getpixel((5, 3)) == (255, 255, 255)


def test_the_profile_of_gray_is_not_one_of_colours(tmp_path: Path) -> None:
    gray = PROFILE[:16] + b"GRAY" + PROFILE[20:]
    Image.fromarray(COLOURS[..., 0]).save(tmp_path / "a.png", icc_profile=gray)
    pg.save(tmp_path / "b.png", COLOURS, like=tmp_path / "a.png")
    with Image.open(tmp_path / "b.png") as made:
        assert "icc_profile" not in made.info


#: EXIF tags of cameras: whole numbers, fractions and texts.
CAMERA_TAGS: dict[int, Any] = {
    ExifTags.Base.ISOSpeedRatings: 400, ExifTags.Base.ExposureProgram: 2, ExifTags.Base.MeteringMode: 5,
    ExifTags.Base.Flash: 16, ExifTags.Base.WhiteBalance: 1, ExifTags.Base.FocalLengthIn35mmFilm: 75,
    ExifTags.Base.FNumber: IFDRational(28, 10), ExifTags.Base.FocalLength: IFDRational(50),
    ExifTags.Base.OffsetTime: "+01:00", ExifTags.Base.LensModel: "a lens",
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "lost"), [("out.png", "LensModel"), ("out.jpg", "LensModel"), ("out.tif", "ISOSpeedRatings")]
)
def test_exif_of_cameras_goes_along(tmp_path: Path, name: str, lost: str) -> None:
    """All but what OpenImageIO 3.2 does not write into such a file."""
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif).update(CAMERA_TAGS)
    pg.save(tmp_path / name, COLOURS, like=photo(tmp_path / "a.jpg", exif=exif))
    with Image.open(tmp_path / name) as made:
        kept = made.getexif().get_ifd(ExifTags.IFD.Exif)
    for tag, value in CAMERA_TAGS.items():
        expected = None if tag == ExifTags.Base[lost] else value
        found = kept.get(tag)
        assert found == (pytest.approx(float(value)) if isinstance(expected, IFDRational) else expected), ExifTags.TAGS[
            tag
        ]


@pytest.mark.parametrize(
    ("type_", "value"),
    [("int8", -1), ("uint16", 65535), ("int16", -2), ("half", 0.5), ("double", 0.1), ("uint16[2]", (1, 2))],
)
def test_types_of_metadata_that_the_library_drops_are_kept(type_: str, value: object) -> None:
    spec = image_spec((1, 1, 3), np.dtype(np.uint8), Metadata((("a", type_, value),)), "tiff")
    assert spec.getattribute("a") == pytest.approx(value)


@pytest.mark.parametrize("name", ["out.png", "out.jpg"])
def test_exif_goes_along_without_what_is_not_true_any_more(tmp_path: Path, name: str) -> None:
    """The picture is stored upright, at a size of its own: whoever turned it once more would lay it on its side."""
    pg.save(tmp_path / name, COLOURS, like=photo(tmp_path / "a.jpg", exif=camera(), dpi=(300, 300)))
    with Image.open(tmp_path / name) as made:
        exif = made.getexif()
        assert exif[ExifTags.Base.Model] == "a camera"
        assert not {ExifTags.Base.Orientation, ExifTags.Base.ImageWidth} & set(exif)
        kept = exif.get_ifd(ExifTags.IFD.Exif)
        assert kept[ExifTags.Base.DateTimeOriginal] == "2020:02:02 20:20:20"
        assert ExifTags.Base.ExifImageWidth not in kept
        assert np.allclose(made.info["dpi"], 300, atol=0.1)


@pytest.mark.parametrize("exif", [b"Exif\0\0", b"Exif\0\0II*\0\xff\xff\xff\xff", b"Exif\0\0" + b"\x7f" * 60000])
def test_broken_exif_is_left_out(tmp_path: Path, exif: bytes) -> None:
    pg.save(tmp_path / "b.jpg", COLOURS, like=photo(tmp_path / "a.jpg", exif=exif))
    with Image.open(tmp_path / "b.jpg") as made:
        assert made.size == (6, 4)


@pytest.mark.parametrize("like", ["nowhere.png", "text.png", ""])
def test_what_has_no_notes_is_no_reason_to_fail(tmp_path: Path, like: str) -> None:
    (tmp_path / "text.png").write_text("no picture")
    pg.save(tmp_path / "b.png", COLOURS, like=tmp_path / like)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "b.png")), COLOURS)


@pytest.mark.parametrize(("given", "alpha", "mode"), [("RGB", 255, "RGB"), ("RGB", 254, "RGBA"), ("RGBA", 255, "RGBA")])
def test_alpha_is_stored_where_somebody_uses_it(tmp_path: Path, given: str, alpha: int, mode: str) -> None:
    Image.fromarray(COLOURS).convert(given).save(tmp_path / "a.png")
    picture = np.full((4, 6, 4), 255, np.uint8)
    picture[0, 0, 3] = alpha
    pg.save(tmp_path / "b.png", picture, like=tmp_path / "a.png")
    with Image.open(tmp_path / "b.png") as made:
        assert (made.mode, made.convert("RGBA").getpixel((0, 0))) == (mode, (255, 255, 255, alpha))


@pytest.mark.parametrize("how", ["one", "folder", "sequence", "python"])
def test_each_picture_of_a_run_keeps_its_own(tmp_path: Path, how: str) -> None:
    """One picture and many, on the command line and in Python."""
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir(), out.mkdir()
    photo(folder / "p.1.png", icc_profile=PROFILE)
    photo(folder / "p.2.png")
    if how == "python":
        copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
        with pg.compile(copy(pg.Input("frame"))) as program:
            source = Pictures([folder / "p.1.png", folder / "p.2.png"])
            assert pg.frames(program, source, ToPictures(Pattern(str(out / "p.%d.png")))).whole
    else:
        said = {
            "one": [str(folder / "p.1.png"), "-o", str(out / "p.1.png")],
            "folder": [str(folder), "-o", str(out)],
            "sequence": [str(folder / "p.%d.png"), "-o", str(out / "p.%d.png")],
        }[how]
        assert run(["apply", "black-and-white", *said]) == 0
    with Image.open(out / "p.1.png") as first:
        assert (first.info["icc_profile"], first.mode) == (PROFILE, "RGB")
    if how != "one":
        with Image.open(out / "p.2.png") as second:
            assert "icc_profile" not in second.info


def _kept(file: Path) -> set[str]:
    """The metadata of a file, by the words of docs/frames.md."""
    import OpenImageIO

    image = OpenImageIO.ImageInput.open(str(file))
    names = {entry.name for entry in image.spec().extra_attribs}
    image.close()
    found = {"ICC": "ICCProfile", "EXIF": "Make", "resolution": "XResolution", "time code": "smpte:TimeCode"}
    return {word for word, name in found.items() if name in names}


def _documented() -> dict[str, set[str]]:
    """Suffix → the last column of the table of formats."""
    text = (Path(__file__).parents[1] / "docs/frames.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    rows = [row for row in rows if len(row) == 5 and row[2] not in ("written", "–")]
    suffixes = {"JPEG": ".jpg", "OpenEXR": ".exr", "JPEG XL": ".jxl"}
    return {
        suffixes.get(name, f".{name.lower()}"): {word for word in row[4].split(", ") if word != "–"}
        for row in rows
        for name in row[0].split(", ")
    }


def test_the_documented_metadata_goes_along(tmp_path: Path) -> None:
    import OpenImageIO

    exif = Image.Exif()
    exif[0x010F] = "Camera"
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.new("RGB", (3, 2)).save(tmp_path / "photo.jpg", exif=exif, icc_profile=profile, dpi=(150, 150))
    spec = OpenImageIO.ImageSpec(3, 2, 3, "half")
    spec.attribute("smpte:TimeCode", OpenImageIO.TypeDesc("timecode"), (0x01020304, 0))
    plate = OpenImageIO.ImageOutput.create("plate.exr")
    plate.open(str(tmp_path / "plate.exr"), spec)
    plate.write_image(np.zeros((2, 3, 3), np.float16))
    plate.close()
    documented = _documented()
    assert len(documented) == 14
    for suffix, expected in documented.items():
        if suffix == ".npy":  # an array alone
            continue
        kept: set[str] = set()
        picture = np.ones((2, 3, 1 if suffix == ".pgm" else 4), np.float32)
        for like in ("photo.jpg", "plate.exr"):
            pg.save(tmp_path / f"out{suffix}", picture, like=tmp_path / like)
            kept |= _kept(tmp_path / f"out{suffix}")
        assert kept == expected, suffix
