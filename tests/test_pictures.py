"""passgraph.pictures: round trips, each refusal, and that a file is written whole or not at all."""

from __future__ import annotations

import io
import os
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from passgraph import pictures
from passgraph.errors import InputError
from passgraph.pictures import load, save
from passgraph.srgb import linear_to_srgb, srgb_to_linear

rng = np.random.default_rng(1)
bytes_of = {channels: rng.integers(0, 256, (7, 5, channels), dtype=np.uint8) for channels in (1, 2, 3, 4)}


def rgba_of(picture: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """What load should return for stored channels in [0, 1]."""
    channels = picture if picture.ndim == 3 else picture[..., None]
    count = channels.shape[2]
    colour = channels[..., :3] if count > 2 else np.repeat(channels[..., :1], 3, axis=2)
    alpha = channels[..., -1:] if count in (2, 4) else np.ones_like(channels[..., :1])
    return np.concatenate([colour, alpha], axis=2).astype(np.float32)


def refused(expected: str, call: Any, *arguments: Any, **options: Any) -> str:
    """The one line of the InputError that the call raises, which must match `expected`."""
    with pytest.raises(InputError, match=expected) as caught:
        call(*arguments, **options)
    line = str(caught.value)
    assert "\n" not in line
    return line


def png(width: int, height: int, depth: int, colour: int, rows: bytes, extra: bytes = b"") -> bytes:
    """A PNG made by hand: rows with their filter bytes."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + extra + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def png_16(values: np.ndarray[Any, Any], colour: int, extra: bytes = b"") -> bytes:
    height, width, _ = values.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)
    return png(width, height, 16, colour, rows, extra)


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


# Refusals on reading


def test_missing_file(tmp_path: Path) -> None:
    refused(r"absent\.png: no such file; check the path", load, tmp_path / "absent.png")


def test_directory(tmp_path: Path) -> None:
    refused("is a directory; expected a picture file", load, tmp_path)


def test_pipe_is_refused_and_does_not_hang(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    refused("is a device, a pipe or a socket; expected a picture file", load, tmp_path / "pipe.png")


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="a file that even root cannot read")
def test_unreadable_file() -> None:
    refused(r"/proc/self/mem: cannot be read \(.+\); check its permissions", load, "/proc/self/mem")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_file_without_permission(tmp_path: Path) -> None:
    save(tmp_path / "secret.png", bytes_of[1])
    (tmp_path / "secret.png").chmod(0)
    refused(r"cannot be read \(Permission denied\)", load, tmp_path / "secret.png")


def test_null_byte_in_the_path() -> None:
    refused("cannot be read .*null", load, "a\0.png")
    refused("cannot be written .*null", save, "a\0.png", bytes_of[1])


def test_empty_file(tmp_path: Path) -> None:
    (tmp_path / "empty.png").touch()
    refused(r"empty\.png: is empty \(0 bytes\)", load, tmp_path / "empty.png")


def test_not_a_picture(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("hello, world")
    refused(
        r"not a picture that can be read.* got 12 bytes that begin with b'hello, w'",
        load,
        tmp_path / "text.png",
    )


def test_radiance_is_refused_with_a_way_out(tmp_path: Path) -> None:
    (tmp_path / "sky.hdr").write_bytes(b"#?RADIANCE\n")
    refused("convert it to OpenEXR", load, tmp_path / "sky.hdr")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".webp", ".exr", ".npy"])
@pytest.mark.parametrize("kept", [0.97, 0.5, 0.1])
def test_truncated_file(tmp_path: Path, suffix: str, kept: float) -> None:
    if suffix == ".exr":
        pytest.importorskip("OpenEXR")
    file = tmp_path / f"cut{suffix}"
    save(file, rng.random((64, 64, 3)))
    file.write_bytes(file.read_bytes()[: int(file.stat().st_size * kept)])
    refused(rf"cut\{suffix}: (truncated or corrupt|not a picture)", load, file)


def test_truncated_16_bit_file(tmp_path: Path) -> None:
    data = png_16(rng.integers(0, 65536, (64, 64, 3), dtype=np.uint16), 2)
    (tmp_path / "cut.png").write_bytes(data[: len(data) // 2])
    refused("truncated or corrupt", load, tmp_path / "cut.png")


def test_corrupt_file(tmp_path: Path) -> None:
    file = tmp_path / "corrupt.png"
    save(file, rng.random((64, 64, 3)))
    data = bytearray(file.read_bytes())
    data[200:300] = bytes(100)
    file.write_bytes(data)
    refused(r"corrupt\.png: truncated or corrupt \(.+\); make or copy the file again", load, file)


@settings(deadline=None)
@given(data=st.data())
def test_flipped_bytes_give_a_picture_or_an_input_error(tmp_path_factory: Any, data: Any) -> None:
    suffix = data.draw(st.sampled_from([".png", ".jpg", ".webp", ".npy"]))
    file = tmp_path_factory.getbasetemp() / f"flipped{suffix}"
    save(file, bytes_of[3])
    content = bytearray(file.read_bytes())
    for position in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=4)):
        content[position] = data.draw(st.integers(0, 255))
    file.write_bytes(content)
    try:
        shape = load(file, max_bytes=1 << 24).shape
    except InputError:
        return
    assert shape[2] == 4


def test_decompression_bomb_is_refused_before_decoding(tmp_path: Path) -> None:
    (tmp_path / "bomb.png").write_bytes(png(60000, 60000, 8, 6, bytes(100)))
    refused(
        r"60000×60000 = 3600000000 pixels, which take 72000\d{6} bytes of memory to load; expected at most 4294967296",
        load,
        tmp_path / "bomb.png",
    )
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (1 << 20, 1 << 20)})
    (tmp_path / "bomb.npy").write_bytes(header.getvalue())
    refused("1048576×1048576 = ", load, tmp_path / "bomb.npy")


def test_max_bytes_is_the_limit(tmp_path: Path) -> None:
    limit = Image.MAX_IMAGE_PIXELS
    save(tmp_path / "a.png", bytes_of[3])
    needed = 35 * (16 + 4) + (tmp_path / "a.png").stat().st_size
    assert load(tmp_path / "a.png", max_bytes=needed).shape == (7, 5, 4)
    expected = rf"5×7 = 35 pixels, which take {needed} bytes of memory to load; expected at most {needed - 1}; make it"
    refused(expected + " smaller, or raise max_bytes", load, tmp_path / "a.png", max_bytes=needed - 1)
    assert limit == Image.MAX_IMAGE_PIXELS


def test_max_bytes_is_the_limit_of_exr(tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR")
    save(tmp_path / "a.exr", bytes_of[3])
    needed = 35 * (16 + 12) + (tmp_path / "a.exr").stat().st_size
    assert load(tmp_path / "a.exr", max_bytes=needed).shape == (7, 5, 4)
    refused(f"5×7 = 35 pixels, which take {needed} bytes", load, tmp_path / "a.exr", max_bytes=needed - 1)


def test_more_bytes_than_the_pixels_can_need(tmp_path: Path) -> None:
    with (tmp_path / "huge.png").open("wb") as stream:
        stream.truncate(1 << 34)  # sparse
    refused(r"has 17179869184 bytes; expected at most", load, tmp_path / "huge.png")


@pytest.mark.parametrize("shape", [(3,), (2, 2, 5), (1, 2, 2, 3), (0, 4)])
def test_npy_of_a_shape_that_is_no_picture(tmp_path: Path, shape: tuple[int, ...]) -> None:
    np.save(tmp_path / "a.npy", np.zeros(shape))
    refused("expected", load, tmp_path / "a.npy")


def test_npy_with_objects_is_not_unpickled(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.full((2, 2), None), allow_pickle=True)
    refused("has dtype object; expected float, uint8 or uint16", load, tmp_path / "a.npy")


# Refusals on writing


@pytest.mark.parametrize("name", ["a.bmp", "a", "a.png.zip"])
def test_unknown_suffix(tmp_path: Path, name: str) -> None:
    refused(
        rf"{re.escape(name)}: unknown suffix '.*'; expected one of .png .jpg",
        save,
        tmp_path / name,
        bytes_of[1],
    )


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_missing_folder(tmp_path: Path, suffix: str) -> None:
    if suffix == ".exr":
        pytest.importorskip("OpenEXR")
    refused("absent does not exist; make it first", save, tmp_path / "absent" / f"a{suffix}", bytes_of[1])


def test_saving_over_a_directory(tmp_path: Path) -> None:
    (tmp_path / "a.png").mkdir()
    refused("is a directory; expected the name of a file", save, tmp_path / "a.png", bytes_of[1])


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="a folder that even root cannot write in")
@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_unwritable_place(suffix: str) -> None:
    if suffix == ".exr":
        pytest.importorskip("OpenEXR")
    refused(r"cannot be written \(.+\); check the folder", save, f"/proc/self/a{suffix}", bytes_of[1])


@pytest.mark.parametrize("shape", [(), (3,), (2, 2, 5), (1, 2, 2, 3)])
def test_a_shape_that_is_no_picture(tmp_path: Path, shape: tuple[int, ...]) -> None:
    message = rf"of shape {re.escape(str(shape))}; expected \(h, w\) or \(h, w, 1 to 4\)"
    refused(message, save, tmp_path / "a.png", np.zeros(shape))


@pytest.mark.parametrize("shape", [(0, 4), (4, 0, 3)])
@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_zero_size(tmp_path: Path, shape: tuple[int, ...], suffix: str) -> None:
    refused("pixels; expected at least 1×1", save, tmp_path / f"a{suffix}", np.zeros(shape))


@pytest.mark.parametrize("dtype", [np.int32, np.uint16, bool, complex, object])
def test_dtypes_without_a_scale(tmp_path: Path, dtype: Any) -> None:
    refused(
        r"of dtype \w+; expected float in \[0, 1\] or uint8",
        save,
        tmp_path / "a.png",
        np.zeros((2, 2), dtype),
    )


def test_nan_is_counted_and_located(tmp_path: Path) -> None:
    picture = np.zeros((4, 5, 3))
    picture[2, 3, 1] = picture[3, 0, 0] = np.nan
    message = "2 of 60 values are NaN, the first in row 2, column 3, channel 1; save as .exr or .npy"
    refused(message, save, tmp_path / "a.png", picture)
    assert list(tmp_path.iterdir()) == []


def test_jpeg_with_transparency(tmp_path: Path) -> None:
    refused(r"JPEG has no transparency; .*picture\[\.\.\., :3\]", save, tmp_path / "a.jpg", bytes_of[4])


def test_bytes_are_not_linear(tmp_path: Path) -> None:
    refused("uint8 with linear=True; expected floats", save, tmp_path / "a.png", bytes_of[3], linear=True)


def test_a_size_that_the_format_cannot_hold(tmp_path: Path) -> None:
    wide = np.zeros((1, 70000), np.uint8)
    refused("JPEG cannot hold 70000×1 pixels", save, tmp_path / "a.jpg", wide)
    refused("WEBP cannot hold 70000×1 pixels", save, tmp_path / "a.webp", wide)
    save(tmp_path / "a.png", wide)


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
