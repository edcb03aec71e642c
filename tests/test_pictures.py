"""passgraph.pictures: round trips, kinds of pixels, and that a file is written whole or not at all."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageFile, ImageOps

from passgraph import pictures
from passgraph.pictures import load, load_stored, save
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from tests.picture_files import bytes_of, png_16, refused

rng = np.random.default_rng(1)


def rgba_of(picture: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """What load should return for stored channels in [0, 1]."""
    channels = picture if picture.ndim == 3 else picture[..., None]
    count = channels.shape[2]
    colour = channels[..., :3] if count > 2 else np.repeat(channels[..., :1], 3, axis=2)
    alpha = channels[..., -1:] if count in (2, 4) else np.ones_like(channels[..., :1])
    return np.concatenate([colour, alpha], axis=2).astype(np.float32)


# Round trips


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tiff", ".webp", ".PNG"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_bytes_come_back_exactly(tmp_path: Path, suffix: str, channels: int) -> None:
    file = tmp_path / f"picture{suffix}"
    save(file, bytes_of[channels])
    back = load(file)
    assert back.dtype == np.float32
    assert back.flags.c_contiguous
    np.testing.assert_array_equal(back, rgba_of(bytes_of[channels].astype(np.float32) / np.float32(255)))
    save(file, back)
    np.testing.assert_array_equal(load(file), back)


@pytest.mark.parametrize("suffix", [".exr", ".npy"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_floats_come_back_exactly(tmp_path: Path, suffix: str, channels: int) -> None:
    if suffix == ".exr":
        pytest.importorskip("OpenEXR")
    values = rng.normal(0, 100, (7, 5, channels)).astype(np.float32)
    values[0, 0, 0], values[1, 1, 0], values[2, 2, 0] = np.inf, np.nan, -0.0
    save(tmp_path / f"p{suffix}", values)
    np.testing.assert_array_equal(load(tmp_path / f"p{suffix}"), rgba_of(values))
    np.testing.assert_array_equal(load(tmp_path / f"p{suffix}", linear=True), rgba_of(values))


@settings(deadline=None)
@given(st.lists(st.floats(-1, 2, width=32), min_size=1, max_size=30))
def test_floats_are_clipped_and_rounded_half_to_even(tmp_path_factory: Any, values: list[float]) -> None:
    file = tmp_path_factory.getbasetemp() / "rounded.png"
    row = np.array([values], np.float32)
    save(file, row)
    expected = np.rint(np.clip(row, 0, 1) * np.float32(255)).astype(np.uint8)
    np.testing.assert_array_equal(np.asarray(Image.open(file)), expected)


def test_half_goes_to_even(tmp_path: Path) -> None:
    save(tmp_path / "half.png", np.array([[0.5, 0.1, -1.0, 2.0, np.inf, -np.inf]]))  # 127.5 and 25.5
    assert np.asarray(Image.open(tmp_path / "half.png")).tolist() == [[128, 26, 0, 255, 255, 0]]


def test_two_dimensions_and_any_strides_are_accepted(tmp_path: Path) -> None:
    wide = np.linspace(0, 1, 12).reshape(3, 4)
    save(tmp_path / "a.png", wide[::-1, ::2])
    expected = np.rint(wide[::-1, ::2].astype(np.float32) * 255) / np.float32(255)
    np.testing.assert_array_equal(load(tmp_path / "a.png"), rgba_of(expected.astype(np.float32)))


def test_row_0_is_the_top_row(tmp_path: Path) -> None:
    save(tmp_path / "top.png", np.array([[1.0], [0.0]]))
    assert np.asarray(Image.open(tmp_path / "top.png")).tolist() == [[255], [0]]
    assert load(tmp_path / "top.png")[0, 0].tolist() == [1, 1, 1, 1]


def test_jpeg_is_close_and_loses_an_alpha_of_one(tmp_path: Path) -> None:
    ramp = np.linspace(0, 1, 32)
    smooth = np.stack(np.broadcast_arrays(ramp, ramp[:, None], 0.5, 1.0), axis=-1)
    save(tmp_path / "a.jpg", smooth)
    assert np.abs(load(tmp_path / "a.jpg") - smooth).max() < 0.03


def test_linear_encodes_on_saving_and_decodes_on_loading(tmp_path: Path) -> None:
    every = np.arange(256, dtype=np.uint8).reshape(16, 16)
    file = tmp_path / "ramp.png"
    save(file, np.stack([every, every], axis=-1))
    light = load(file, linear=True)
    assert light[8, 0, 0] == pytest.approx(0.21586, abs=1e-5)  # byte 128
    assert light[8, 0, 3] == np.float32(128 / 255), "alpha is not encoded"
    save(file, light, linear=True)
    assert (np.asarray(Image.open(file)) == np.stack([every] * 4, axis=-1)).all()
    save(file, np.array([[[0.21586, 0.5]]]), linear=True)
    assert np.asarray(Image.open(file)).tolist() == [[[128, 128]]]


@settings(deadline=None)
@given(st.floats(0, 1, width=32))
def test_srgb_there_and_back(value: float) -> None:
    light = srgb_to_linear(np.float32([value]))
    assert 0 <= light[0] <= 1
    assert linear_to_srgb(light)[0] == pytest.approx(value, abs=2e-6)


# Kinds of pixels


@pytest.mark.parametrize(("channels", "colour"), [(1, 0), (3, 2), (4, 6)])
def test_png_of_16_bits_keeps_all_bits(tmp_path: Path, channels: int, colour: int) -> None:
    values = rng.integers(0, 65536, (7, 5, channels), dtype=np.uint16)
    (tmp_path / "deep.png").write_bytes(png_16(values, colour))
    expected = values.astype(np.float32) / np.float32(65535)
    np.testing.assert_array_equal(load(tmp_path / "deep.png"), rgba_of(expected))


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_tiff_of_16_bits_keeps_all_bits(tmp_path: Path, channels: int) -> None:
    cv2 = pytest.importorskip("cv2")
    values = rng.integers(0, 65536, (7, 5, channels), dtype=np.uint16)
    order = {1: [0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[channels]
    assert cv2.imwrite(str(tmp_path / "deep.tiff"), values[..., order])
    expected = values.astype(np.float32) / np.float32(65535)
    np.testing.assert_array_equal(load(tmp_path / "deep.tiff"), rgba_of(expected))


@pytest.mark.parametrize(("channels", "colour"), [(1, 0), (3, 2)])
def test_transparent_colour_of_16_bits(tmp_path: Path, channels: int, colour: int) -> None:
    values = np.zeros((1, 2, channels), np.uint16)
    values[0, 0] = 258
    values[0, 1] = 257  # the same high byte
    key = struct.pack(f">{channels}H", *[258] * channels)
    chunk = struct.pack(">I", len(key)) + b"tRNS" + key + struct.pack(">I", zlib.crc32(b"tRNS" + key))
    (tmp_path / "key.png").write_bytes(png_16(values, colour, chunk))
    assert load(tmp_path / "key.png")[0, :, 3].tolist() == [0, 1]


def test_gray_with_alpha_of_16_bits_is_refused(tmp_path: Path) -> None:
    (tmp_path / "deep.png").write_bytes(png_16(np.zeros((2, 2, 2), np.uint16), 4))
    refused(r"deep\.png: holds LA;16B pixels; expected gray, palette, RGB", load, tmp_path / "deep.png")


def test_palette_with_transparency(tmp_path: Path) -> None:
    image = Image.new("P", (2, 1))
    image.putpalette([255, 0, 0, 0, 0, 255])
    image.putdata([0, 1])
    image.save(tmp_path / "palette.png", transparency=1)
    assert load(tmp_path / "palette.png").tolist() == [[[1, 0, 0, 1], [0, 0, 1, 0]]]


def test_one_bit(tmp_path: Path) -> None:
    Image.fromarray(np.array([[True, False]])).save(tmp_path / "bits.png")
    assert load(tmp_path / "bits.png")[0, :, 0].tolist() == [1, 0]


def test_float_tiff_is_linear_and_not_clipped(tmp_path: Path) -> None:
    Image.fromarray(np.array([[0.5, 7.0]], np.float32)).save(tmp_path / "float.tiff")
    assert load(tmp_path / "float.tiff", linear=True)[0, :, 0].tolist() == [0.5, 7.0]


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.uint16])
@pytest.mark.parametrize("planar", ["contig", "separate"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_tiff_of_many_floats_is_what_was_written(tmp_path: Path, dtype: Any, planar: str, channels: int) -> None:
    numbers = rng.normal(0.5, 10, (7, 5, channels)).astype(dtype) if dtype != np.uint16 else None
    written = rng.integers(0, 65536, (7, 5, channels)).astype(dtype) if numbers is None else numbers
    shown = written if channels > 1 else written[..., 0]
    shown = np.moveaxis(shown, -1, 0) if planar == "separate" and channels > 1 else shown
    tifffile.imwrite(
        tmp_path / "f.tif", shown, photometric="rgb" if channels > 2 else "minisblack",
        planarconfig=planar if channels > 1 else None, extrasamples=["unassalpha"] if channels in (2, 4) else None,
        compression="zlib",
    )  # fmt: skip
    floats = written.astype(np.float32) / (65535 if numbers is None else 1)
    assert np.array_equal(load(tmp_path / "f.tif"), rgba_of(floats))
    stored = load_stored(tmp_path / "f.tif")
    assert stored.dtype == (np.uint16 if numbers is None else np.float32)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("size", [(1, 1), (3, 1), (1, 4), (300, 7)])
def test_16_bits_are_what_others_read(tmp_path: Path, suffix: str, channels: int, size: tuple[int, int]) -> None:
    """By OpenCV's decoders, and tifffile where OpenCV has none."""
    pixels = rng.integers(0, 65536, (*size, channels)).astype(np.uint16)
    file = tmp_path / f"a{suffix}"
    save(file, pixels)
    if suffix == ".tif":
        with tifffile.TiffFile(file) as tiff:
            assert len(tiff.pages) == 1
            read = tiff.asarray()
    else:
        read = cv2.imread(os.fspath(file), cv2.IMREAD_UNCHANGED)
        order = {1: [0], 2: [0, 3], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[channels]  # OpenCV has gray with alpha as BGRA
        read = read.reshape(*size, -1)[..., order]
    assert read.dtype == np.uint16
    assert np.array_equal(read.reshape(pixels.shape), pixels)
    if channels != 2 or suffix == ".tif":  # of PNG, gray with alpha of 16 bits is not read here
        assert np.array_equal(load(file), rgba_of(pixels.astype(np.float32) / np.float32(65535)))


def test_16_bits_in_other_formats(tmp_path: Path) -> None:
    pixels = rng.integers(0, 65536, (4, 5, 3)).astype(np.uint16)
    refused("holds 8 bits a channel; 16 bits go into .png and .tif", save, tmp_path / "a.jpg", pixels)
    refused("holds 8 bits a channel", save, tmp_path / "a.webp", pixels)
    refused("uint16 with linear=True", save, tmp_path / "a.png", pixels, linear=True)
    save(tmp_path / "a.npy", pixels)
    assert np.array_equal(load(tmp_path / "a.npy")[..., :3], pixels / np.float32(65535))


def test_float_tiff_is_turned_and_made_straight_and_keeps_nan(tmp_path: Path) -> None:
    numbers = rng.random((4, 6, 4), np.float32) + 0.1
    numbers[1, 2, 0] = np.nan
    times = numbers * np.append(numbers[..., 3:].repeat(3, -1), np.ones((4, 6, 1), np.float32), -1)
    tifffile.imwrite(
        tmp_path / "f.tif", times, photometric="rgb", extrasamples=["assocalpha"], extratags=[(274, 3, 1, 6)]
    )
    np.testing.assert_allclose(load(tmp_path / "f.tif"), np.rot90(numbers, -1), rtol=1e-6)


@pytest.mark.parametrize("dtype", [np.int16, np.uint32, np.int8])
def test_tiff_of_whole_numbers_without_a_scale_is_refused(tmp_path: Path, dtype: Any) -> None:
    tifffile.imwrite(tmp_path / "f.tif", np.zeros((4, 6, 3), dtype), photometric="rgb")
    refused(f"holds {np.dtype(dtype)}; expected 8 or 16 bits, or floats", load, tmp_path / "f.tif")


def test_broken_float_tiffs_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tifffile.imwrite(tmp_path / "f.tif", np.zeros((40, 60, 3), np.float32), photometric="rgb")
    data = (tmp_path / "f.tif").read_bytes()
    refused("says it is 60×40 = 2400 pixels, which take", load, tmp_path / "f.tif", max_bytes=100_000)
    for kept in (12, 100, 1000, len(data) - 50):
        (tmp_path / "cut.tif").write_bytes(data[:kept])
        refused("cut.tif: ", load, tmp_path / "cut.tif")
    monkeypatch.setitem(sys.modules, "tifffile", None)
    refused(r"pip install 'passgraph\[tiles\]'", load, tmp_path / "f.tif")


@pytest.mark.parametrize(("mode", "name"), [("CMYK", "ink.jpg"), ("LAB", "lab.tiff"), ("I", "int.tiff")])
def test_other_colour_spaces_are_refused(tmp_path: Path, mode: str, name: str) -> None:
    Image.new(mode, (2, 2)).save(tmp_path / name)
    refused(rf"{name}: holds \S+ pixels; expected gray, .* convert it", load, tmp_path / name)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", [".png", ".tiff", ".webp"])
def test_exif_orientation_is_applied(tmp_path: Path, orientation: int, suffix: str) -> None:
    from PIL import ImageOps

    image = Image.fromarray(bytes_of[3])
    exif = Image.Exif()
    exif[0x0112] = orientation
    image.save(tmp_path / f"turned{suffix}", exif=exif, lossless=True)
    upright = Image.fromarray(bytes_of[3])
    upright.getexif()[0x0112] = orientation
    expected = np.asarray(ImageOps.exif_transpose(upright)).astype(np.float32) / np.float32(255)
    np.testing.assert_array_equal(load(tmp_path / f"turned{suffix}")[..., :3], expected)


def test_content_decides_not_the_name(tmp_path: Path) -> None:
    save(tmp_path / "a.png", bytes_of[3])
    (tmp_path / "a.png").rename(tmp_path / "a.jpg")
    assert load(tmp_path / "a.jpg").shape == (7, 5, 4)


@pytest.mark.parametrize(("dtype", "scale"), [(np.uint8, 255), (np.uint16, 65535), (np.float64, 1)])
def test_npy_dtypes(tmp_path: Path, dtype: Any, scale: int) -> None:
    np.save(tmp_path / "a.npy", np.full((2, 3), scale, dtype))
    assert (load(tmp_path / "a.npy") == 1).all()


def test_exr_shows_the_display_window(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    window = (np.array([1, 2], np.int32), np.array([3, 3], np.int32))
    display = (np.array([0, 0], np.int32), np.array([2, 4], np.int32))
    values = np.arange(1, 7, dtype=np.float32).reshape(2, 3)
    header = {"dataWindow": window, "displayWindow": display}
    openexr.File(header, {"Y": values}).write(str(tmp_path / "window.exr"))
    expected = np.zeros((5, 3), np.float32)
    expected[2:4, 1:3] = values[:, :2]
    np.testing.assert_array_equal(load(tmp_path / "window.exr")[..., 0], expected)


def test_exr_with_half_floats(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    half = rng.normal(size=(3, 2, 3)).astype(np.float16)
    openexr.File({}, {"RGB": half}).write(str(tmp_path / "half.exr"))
    np.testing.assert_array_equal(load(tmp_path / "half.exr"), rgba_of(half.astype(np.float32)))


def test_exr_with_other_channels_is_refused(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    openexr.File({}, {"depth": np.zeros((2, 2), np.float32)}).write(str(tmp_path / "z.exr"))
    refused(r"z\.exr: has the channels depth; expected R, G, B or Y", load, tmp_path / "z.exr")


# Whole or not at all


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_a_failure_leaves_the_old_file_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    if suffix == ".exr":
        pytest.importorskip("OpenEXR")
    file = tmp_path / f"a{suffix}"
    save(file, bytes_of[3])
    before = file.read_bytes()

    def full(source: object, target: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    refused(r"cannot be written \(No space left on device\)", save, file, bytes_of[1])
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link.png").symlink_to(tmp_path / "real" / "a.png")
    save(tmp_path / "link.png", bytes_of[3])
    assert (tmp_path / "link.png").is_symlink()
    assert load(tmp_path / "real" / "a.png").shape == (7, 5, 4)


def test_permissions_follow_the_umask(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    save(tmp_path / "a.png", bytes_of[1])
    assert (tmp_path / "a.png").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("verb", ["load", "save"])
def test_missing_openexr_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str) -> None:
    monkeypatch.setitem(__import__("sys").modules, "OpenEXR", None)
    (tmp_path / "a.exr").write_bytes(b"\x76\x2f\x31\x01")
    arguments = {"load": (), "save": (bytes_of[3],)}[verb]
    refused(
        r"a\.exr: OpenEXR is not installed; run: pip install 'passgraph\[exr\]'",
        getattr(pictures, verb),
        tmp_path / "a.exr",
        *arguments,
    )


@pytest.mark.parametrize("turn", [1, 3, 6])
@pytest.mark.parametrize(
    ("mode", "kind", "how"),
    [
        ("RGB", "PNG", {}), ("RGBA", "PNG", {}), ("L", "PNG", {}), ("P", "PNG", {}),
        ("RGB", "PNG", {"transparency": (1, 2, 3)}), ("RGB", "JPEG", {}), ("RGB", "JPEG", {"progressive": True}),
        ("L", "JPEG", {}),
    ],
)  # fmt: skip
def test_files_decode_as_by_pillow_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: str, kind: str, how: dict[str, Any], turn: int
) -> None:
    """In memory of ours or, where Pillow makes its own after all, copied from there: the same bytes."""
    image = Image.fromarray(rng.integers(0, 256, (37, 53, 4), np.uint8)).convert(mode)
    exif = Image.Exif()
    exif[0x0112] = turn
    image.save(tmp_path / "a", kind, exif=exif, **how)
    with Image.open(tmp_path / "a") as opened:
        expected = np.asarray(ImageOps.exif_transpose(opened).convert("RGBA"))
    assert np.array_equal(load_stored(tmp_path / "a"), expected)

    def own(self: ImageFile.ImageFile) -> None:
        self.im = Image.core.new(self.mode, self.size)
        before(self)

    before = ImageFile.ImageFile.load_prepare
    monkeypatch.setattr(ImageFile.ImageFile, "load_prepare", own)
    assert np.array_equal(load_stored(tmp_path / "a"), expected)


@pytest.mark.parametrize("kind", ["png", "jpg"])
def test_colours_are_decoded_into_the_array_that_is_returned(tmp_path: Path, kind: str) -> None:
    """Pillow is kept from making memory of its own, and needs none."""
    save(tmp_path / f"a.{kind}", np.full((600, 800, 3), 77, np.uint8))
    load_stored(tmp_path / f"a.{kind}")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ImageFile.ImageFile, "load_prepare", lambda self: None)  # where Pillow makes its own memory
        assert load_stored(tmp_path / f"a.{kind}")[1, 1].tolist() == [77, 77, 77, 255]


def test_one_format_is_loaded_for_one_file(tmp_path: Path) -> None:
    """In a process of its own, whose Pillow nobody has used."""
    save(tmp_path / "a.png", bytes_of[3])
    code = (
        f"import sys; from passgraph.pictures import load, save; save({str(tmp_path / 'b.png')!r}, "
        f"load({str(tmp_path / 'a.png')!r})); print([n for n in ('Bmp', 'Gif', 'Jpeg') "
        "if f'PIL.{n}ImagePlugin' in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
