"""passgraph.pictures: round trips, kinds of pixels, and that a file is written whole or not at all."""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from passgraph.image_formats import READABLE
from passgraph.pictures import load, load_stored, save
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from tests.picture_files import bytes_of, png, png_16, refused

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


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("suffix", [".exr", ".npy"])
def test_floats_come_back_exactly(tmp_path: Path, suffix: str, channels: int) -> None:
    """Arrays of two channels are red and green, as in programs; pictures of two are gray and alpha."""
    values = rng.normal(0, 100, (7, 5, channels)).astype(np.float32)
    if channels in (2, 4):
        values[..., -1] = 2.0 ** rng.integers(-3, 1, (7, 5))  # OpenEXR holds color times alpha: exact for these
    values[0, 0, 0], values[1, 1, 0], values[2, 2, 0] = np.inf, np.nan, -0.0
    save(tmp_path / f"p{suffix}", values)
    is_data = suffix == ".npy" and channels == 2
    expected = rgba_of(np.dstack([values, np.zeros_like(values[..., :1])]) if is_data else values)
    np.testing.assert_array_equal(load(tmp_path / f"p{suffix}"), expected)
    np.testing.assert_array_equal(load(tmp_path / f"p{suffix}", linear=True), expected)


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


@pytest.mark.parametrize(("channels", "colour"), [(1, 0), (2, 4), (3, 2), (4, 6)])
def test_png_of_16_bits_keeps_all_bits(tmp_path: Path, channels: int, colour: int) -> None:
    values = rng.integers(0, 65536, (7, 5, channels), dtype=np.uint16)
    (tmp_path / "deep.png").write_bytes(png_16(values, colour))
    expected = values.astype(np.float32) / np.float32(65535)
    np.testing.assert_array_equal(load(tmp_path / "deep.png"), rgba_of(expected))


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_tiff_of_16_bits_keeps_all_bits(tmp_path: Path, channels: int) -> None:
    cv2 = pytest.importorskip("cv2")
    values = rng.integers(0, 65536, (7, 5, channels), dtype=np.uint16)
    values[..., 3:] = 65535  # OpenCV does not say whether color is multiplied by alpha
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
    assert np.array_equal(load(file), rgba_of(pixels.astype(np.float32) / np.float32(65535)))


def test_16_bits_in_other_formats(tmp_path: Path) -> None:
    pixels = rng.integers(0, 65536, (4, 5, 3)).astype(np.uint16)
    refused("JPEG holds 8-bit uint8, not 16 bits", save, tmp_path / "a.jpg", pixels)
    refused("WebP holds 8-bit", save, tmp_path / "a.webp", pixels)
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
    refused(
        f"holds {np.dtype(dtype).name.removesuffix('32')}; expected 8 or 16 bits without sign", load, tmp_path / "f.tif"
    )


def test_broken_float_tiffs_are_told(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "f.tif", np.zeros((40, 60, 3), np.float32), photometric="rgb")
    data = (tmp_path / "f.tif").read_bytes()
    refused("says it is 60×40 = 2400 pixels, which take", load, tmp_path / "f.tif", max_bytes=80_000)
    for kept in (12, 100, 1000, len(data) - 50):
        (tmp_path / "cut.tif").write_bytes(data[:kept])
        refused("cut.tif: ", load, tmp_path / "cut.tif")


def test_integers_of_32_bits_are_refused(tmp_path: Path) -> None:
    Image.new("I", (2, 2)).save(tmp_path / "int.tiff")
    refused("int.tiff: holds int; expected 8 or 16 bits without sign", load, tmp_path / "int.tiff")


@pytest.mark.parametrize("name", ["ink.jpg", "ink.tif"])
def test_cmyk_becomes_rgb(tmp_path: Path, name: str) -> None:
    Image.new("CMYK", (16, 16), (0, 128, 255, 0)).save(tmp_path / name)
    assert load(tmp_path / name)[8, 8] == pytest.approx([1, 0.5, 0, 1], abs=0.02)


@pytest.mark.parametrize("depth", [1, 2, 4, 8])
def test_transparent_gray_of_few_bits(tmp_path: Path, depth: int) -> None:
    """PNG's tRNS names a value of the file's own bits."""
    values = np.arange(8) % (1 << depth)
    packed = np.packbits(np.unpackbits(values.astype(np.uint8)[:, None], axis=1)[:, 8 - depth :].ravel())
    key = struct.pack(">H", 1)
    chunk = struct.pack(">I", 2) + b"tRNS" + key + struct.pack(">I", zlib.crc32(b"tRNS" + key))
    (tmp_path / "key.png").write_bytes(png(8, 1, depth, 0, b"\0" + packed.tobytes(), chunk))
    picture = load(tmp_path / "key.png")[0]
    assert picture[:, 3].tolist() == (values != 1).astype(float).tolist()
    shown = values != 1
    np.testing.assert_allclose(picture[shown, 0], values[shown] / ((1 << depth) - 1), atol=1e-7)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_white_may_be_zero(tmp_path: Path, dtype: Any) -> None:
    values = rng.integers(0, np.iinfo(dtype).max, (5, 6), dtype)
    tifffile.imwrite(tmp_path / "w.tif", values, photometric="miniswhite")
    assert np.array_equal(load_stored(tmp_path / "w.tif")[..., 0], np.iinfo(dtype).max - values)


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


def test_exr_holds_associated_color(tmp_path: Path) -> None:
    """Color in the file is multiplied by alpha; color where alpha is 0 is light, which stays."""
    openexr = pytest.importorskip("OpenEXR")
    inside = np.array([[[0.25, 0.5, 0.125, 0.5], [2.0, 1.0, 0.0, 0.0]]], np.float32)
    openexr.File({}, {"RGBA": inside}).write(str(tmp_path / "a.exr"))
    assert load(tmp_path / "a.exr").tolist() == [[[0.5, 1.0, 0.25, 0.5], [2.0, 1.0, 0.0, 0.0]]]
    save(tmp_path / "b.exr", np.array([[[0.5, 1.0, 0.25, 0.5], [1.0, 1.0, 1.0, 0.0]]], np.float32))
    with openexr.File(str(tmp_path / "b.exr")) as made:
        assert made.channels()["RGBA"].pixels.tolist() == [[[0.25, 0.5, 0.125, 0.5], [0.0, 0.0, 0.0, 0.0]]]


def layered(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    openexr = pytest.importorskip("OpenEXR")
    names = ("R", "G", "B", "Z", "N.X", "N.Y", "N.Z", "diffuse.R", "diffuse.G", "diffuse.B")
    values: dict[str, Any] = {name: rng.random((4, 6), np.float32) for name in names}
    openexr.File({}, dict(values)).write(str(path))  # it changes what it is given
    return values


@pytest.mark.parametrize(
    ("layer", "channels"),
    [(None, ("R", "G", "B")), ("Z", ("Z",) * 3), ("N", ("N.X", "N.Y", "N.Z")),
     ("diffuse", ("diffuse.R", "diffuse.G", "diffuse.B")), ("N.Y", ("N.Y",) * 3)],
)  # fmt: skip
def test_exr_layers_by_name(tmp_path: Path, layer: str | None, channels: tuple[str, ...]) -> None:
    values = layered(tmp_path / "a.exr")
    expected = np.stack([*(values[name] for name in channels), np.ones((4, 6), np.float32)], axis=-1)
    assert np.array_equal(load(tmp_path / "a.exr", layer=layer), expected)
    if layer is not None:
        assert np.array_equal(load(f"{tmp_path}/a.exr:{layer}"), expected)


@pytest.mark.parametrize(
    ("names", "layer", "read"),
    [
        (("forward.u", "forward.v"), "forward", ("forward.u", "forward.v", None, "one")),  # motion vectors
        (("turn.x", "turn.y", "turn.z", "turn.w"), "turn", ("turn.x", "turn.y", "turn.z", "turn.w")),  # no alpha
        (("glow.red", "glow.green", "glow.blue", "Z"), "glow", ("glow.red", "glow.green", "glow.blue", "one")),
        (("glow.red", "glow.green", "glow.blue", "Z"), None, ("glow.red", "glow.green", "glow.blue", "one")),
        (("Y", "N.X", "N.Y", "N.Z"), None, ("Y", "Y", "Y", "one")),
    ],
)
def test_channels_of_a_layer(tmp_path: Path, names: tuple[str, ...], layer: str | None, read: tuple[str, ...]) -> None:
    openexr = pytest.importorskip("OpenEXR")
    values: dict[str | None, Any] = {name: rng.random((4, 6), np.float32) for name in names}
    openexr.File({}, dict(values)).write(str(tmp_path / "a.exr"))
    values |= {None: np.zeros((4, 6), np.float32), "one": np.ones((4, 6), np.float32)}
    expected = np.stack([values[name] for name in read], axis=-1)
    assert np.array_equal(load(tmp_path / "a.exr", layer=layer), expected)


def test_one_of_several_colored_layers_must_be_named(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    values = {f"{layer}.{letter}": np.zeros((2, 2), np.float32) for layer in ("AO", "Combined") for letter in "RGB"}
    openexr.File({}, values).write(str(tmp_path / "a.exr"))
    refused(r"several layers with color: AO, Combined; name one: .*a\.exr:AO", load, tmp_path / "a.exr")


@pytest.mark.parametrize("meaning", ["unspecified", "unassalpha"])
@pytest.mark.parametrize("channels", [2, 4])
def test_extra_samples_of_tiff_are_alpha_where_they_say_so(tmp_path: Path, channels: int, meaning: str) -> None:
    values = bytes_of[channels]
    kind: Any = "rgb" if channels == 4 else "minisblack"
    tifffile.imwrite(tmp_path / "a.tif", values, photometric=kind, planarconfig="contig", extrasamples=[meaning])
    padded = {2: np.dstack([values, np.zeros_like(values[..., 0])]), 4: values[..., :3]}
    expected = rgba_of((values if meaning == "unassalpha" else padded[channels]) / np.float32(255))
    np.testing.assert_array_equal(load(tmp_path / "a.tif"), expected)


def test_an_unknown_layer_names_those_that_are_there(tmp_path: Path) -> None:
    layered(tmp_path / "a.exr")
    refused("no layer 'depth'; it has Z, N, diffuse", load, tmp_path / "a.exr", layer="depth")


def test_exr_parts_by_name(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    beauty, depth = rng.random((4, 6, 3), np.float32), rng.random((4, 6), np.float32)
    parts = [openexr.Part({"name": "beauty"}, {"RGB": beauty}), openexr.Part({"name": "depth"}, {"Z": depth})]
    openexr.File(parts).write(str(tmp_path / "a.exr"))
    assert np.array_equal(load(tmp_path / "a.exr")[..., :3], beauty)
    assert np.array_equal(load(tmp_path / "a.exr:depth")[..., 0], depth)
    parts = [openexr.Part({"name": "depth"}, {"Z": depth}), openexr.Part({"name": "beauty"}, {"RGB": beauty})]
    openexr.File(parts).write(str(tmp_path / "b.exr"))
    assert np.array_equal(load(tmp_path / "b.exr")[..., :3], beauty)


def test_exr_without_color_names_its_layers(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    openexr.File({}, {"depth": np.zeros((2, 2), np.float32)}).write(str(tmp_path / "z.exr"))
    refused(r"z\.exr: has no color: its channels are depth; name a layer: .*z\.exr:depth", load, tmp_path / "z.exr")


@pytest.mark.parametrize("bits", [16, 32])
def test_exr_of_half_and_full_floats(tmp_path: Path, bits: int) -> None:
    openexr = pytest.importorskip("OpenEXR")
    values = rng.random((4, 6, 3)).astype(np.float16 if bits == 16 else np.float32)
    for name, how in (("a.exr", {}), ("b.exr", {"bits": bits})):
        save(tmp_path / name, values if not how else values.astype(np.float32), **how)
        with openexr.File(str(tmp_path / name)) as made:
            held = made.channels()["RGB"].pixels
        assert held.dtype == values.dtype
        assert np.array_equal(held, values)


@pytest.mark.parametrize("suffix", [".bmp", ".tga", ".ppm", ".jxl", ".dpx", ".pfm", ".hdr"])
def test_other_formats_come_back(tmp_path: Path, suffix: str) -> None:
    """By OpenCV's decoders too, where it has one."""
    exact = suffix != ".hdr"  # a shared exponent
    picture = bytes_of[3].astype(np.float32) / np.float32(255)
    save(tmp_path / f"a{suffix}", picture)
    np.testing.assert_allclose(load(tmp_path / f"a{suffix}")[..., :3], picture, atol=0 if exact else 0.008)
    if suffix in (".bmp", ".ppm", ".pfm", ".hdr"):
        other = cv2.imread(os.fspath(tmp_path / f"a{suffix}"), cv2.IMREAD_UNCHANGED)[..., ::-1]
        scale = 255 if other.dtype == np.uint8 else 1
        np.testing.assert_allclose(other / np.float32(scale), picture, atol=1e-6 if exact else 0.008)


@pytest.mark.parametrize("size", [1, 64])
def test_tiny_jpeg_xl_is_read(tmp_path: Path, size: int) -> None:
    """OpenImageIO alone does not recognize files of less than 128 bytes."""
    flat = np.full((size, size, 3), 200, np.uint8)
    save(tmp_path / "a.jxl", flat)
    assert (tmp_path / "a.jxl").stat().st_size < 128
    assert abs(load_stored(tmp_path / "a.jxl")[..., :3].astype(int) - 200).max() <= 1
    assert load_stored(tmp_path / "b.jxl", (tmp_path / "a.jxl").read_bytes()).shape == (size, size, 4)
    (tmp_path / "cut.jxl").write_bytes((tmp_path / "a.jxl").read_bytes()[:40])
    refused("cut.jxl: (truncated or corrupt|not a picture)", load, tmp_path / "cut.jxl")


@pytest.mark.parametrize("suffix", [".pgm", ".png"])
def test_gray_stays_gray(tmp_path: Path, suffix: str) -> None:
    """Formats of gray alone take equal channels; others are refused."""
    save(tmp_path / f"a{suffix}", bytes_of[1])
    save(tmp_path / "b.pgm", load(tmp_path / f"a{suffix}"))
    assert np.array_equal(load_stored(tmp_path / "b.pgm")[..., :1], bytes_of[1])
    refused("PGM holds gray, got 3 channels", save, tmp_path / "c.pgm", bytes_of[3])


def test_jpeg_2000_is_read(tmp_path: Path) -> None:
    Image.fromarray(bytes_of[3]).resize((64, 64)).save(tmp_path / "a.jp2", irreversible=False)
    expected = np.asarray(Image.fromarray(bytes_of[3]).resize((64, 64)))
    assert np.array_equal(load_stored(tmp_path / "a.jp2")[..., :3], expected)


@pytest.mark.parametrize("name", ["a.png", "a%04d#?x=1&y.png", "ä ö.png", os.fsdecode(b"\xff\xfe.png")])
def test_any_name_is_a_name(tmp_path: Path, name: str) -> None:
    save(tmp_path / name, bytes_of[3])
    assert np.array_equal(load_stored(tmp_path / name)[..., :3], bytes_of[3])


def test_no_pixels_are_made_up_from_a_name(tmp_path: Path) -> None:
    (tmp_path / "a.null").write_bytes(b"nothing")
    refused("not a picture that can be read", load, tmp_path / "a.null")


# Whole or not at all


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_a_failure_leaves_the_old_file_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
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


def test_suffixes_are_those_of_openimageio() -> None:
    import OpenImageIO as oiio

    listed = str(oiio.get_string_attribute("extension_list")).split(";")
    theirs = {name: suffixes.split(",") for name, _, suffixes in (entry.partition(":") for entry in listed)}
    for name, suffixes in READABLE.items():
        assert {suffix[1:] for suffix in suffixes} - {"apng"} <= set(theirs[name]), name


# Files with several pictures


def write_pages(file: Path, *kinds: int) -> Path:
    """Write a TIFF file with a page for each kind (NewSubfileType): 0 is a picture, 1 a smaller copy, 4 a mask."""
    with tifffile.TiffWriter(file) as writer:
        for kind in kinds:
            pixels = np.full((4, 5), 50, bool if kind == 4 else np.uint8)
            writer.write(pixels, photometric="minisblack", subfiletype=kind)
    return file


def test_a_stack_is_loaded_with_a_warning(tmp_path: Path) -> None:
    file = write_pages(tmp_path / "stack.tif", 0, 0, 0)
    with pytest.warns(UserWarning, match="stack.tif: holds several pictures; the first is read"):
        assert load(file).shape == (4, 5, 4)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kinds", [(0,), (0, 1, 1), (0, 4)])
def test_smaller_copies_and_masks_make_no_stack(tmp_path: Path, kinds: tuple[int, ...]) -> None:
    assert load(write_pages(tmp_path / "one.tif", *kinds)).shape == (4, 5, 4)
