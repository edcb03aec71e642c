"""passgraph.pictures: each refusal, on reading and on writing."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st

from passgraph.errors import InputError
from passgraph.pictures import load, load_stored, save
from tests.picture_files import bytes_of, png, png_16, refused

rng = np.random.default_rng(1)


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


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".webp", ".exr", ".npy"])
@pytest.mark.parametrize("kept", [0.97, 0.5, 0.1])
def test_truncated_file(tmp_path: Path, suffix: str, kept: float) -> None:
    file = tmp_path / f"cut{suffix}"
    save(file, rng.random((64, 64, 3)))
    file.write_bytes(file.read_bytes()[: int(file.stat().st_size * kept)])
    refused(rf"cut\{suffix}: (truncated or corrupt|not a picture)", load, file)


def test_truncated_16_bit_file(tmp_path: Path) -> None:
    data = png_16(rng.integers(0, 65536, (64, 64, 3), dtype=np.uint16), 2)
    (tmp_path / "cut.png").write_bytes(data[: len(data) // 2])
    refused("truncated or corrupt", load, tmp_path / "cut.png")


@pytest.mark.parametrize(("suffix", "mark"), [(".png", b"IDAT"), (".jpg", b"\xff\xda")])
def test_a_file_without_pixels(tmp_path: Path, suffix: str, mark: bytes) -> None:
    file = tmp_path / f"header{suffix}"
    save(file, rng.random((8, 8, 3)))
    data = file.read_bytes()
    at = data.index(mark)
    file.write_bytes(data[:at] + data[at:].replace(mark, b"IEND") if suffix == ".png" else data[:at])
    refused(r"(truncated or corrupt|not a picture).*\(.+\)", load_stored, file)


def test_an_error_that_quotes_a_name_that_is_no_text(tmp_path: Path) -> None:
    file = tmp_path / "a.exr"
    save(file, rng.random((8, 8, 3)))
    damaged = file.read_bytes().replace(b"displayWindow\0box2i", b"displayWindow\0bo\x882i")
    assert damaged != file.read_bytes()
    file.write_bytes(damaged)
    refused(r"a\.exr: truncated or corrupt \(.*bo\ufffd2i", load, file)


def test_a_compression_that_is_not_read_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.tif"
    tifffile.imwrite(file, rng.integers(0, 255, (8, 8), np.uint8))
    with tifffile.TiffFile(file, mode="r+") as opened:
        opened.pages[0].tags["Compression"].overwrite(50000)  # Zstandard
    refused(r"a\.tif: is compressed in a way that is not read \(.*ZSTD.*\); save it with ZIP or LZW", load, file)


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
    refused("claims a 13732 MB image from a 69 byte file", load, tmp_path / "bomb.png")
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (1 << 20, 1 << 20)})
    (tmp_path / "bomb.npy").write_bytes(header.getvalue())
    refused("1048576×1048576 = ", load, tmp_path / "bomb.npy")


def test_max_bytes_is_the_limit(tmp_path: Path) -> None:
    save(tmp_path / "a.png", bytes_of[3])
    needed = 35 * (16 + 3) + (tmp_path / "a.png").stat().st_size
    assert load(tmp_path / "a.png", max_bytes=needed).shape == (7, 5, 4)
    expected = rf"5×7 = 35 pixels, which take {needed} bytes of memory to load; expected at most {needed - 1}; make it"
    refused(expected + " smaller, or raise max_bytes", load, tmp_path / "a.png", max_bytes=needed - 1)


def test_max_bytes_is_the_limit_of_exr(tmp_path: Path) -> None:
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


@pytest.mark.parametrize("name", ["a.abc", "a", "a.png.zip"])
def test_unknown_suffix(tmp_path: Path, name: str) -> None:
    refused(
        rf"{re.escape(name)}: unknown suffix '.*'; expected one of .png .jpg",
        save,
        tmp_path / name,
        bytes_of[1],
    )


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_missing_folder(tmp_path: Path, suffix: str) -> None:
    refused("absent does not exist; make it first", save, tmp_path / "absent" / f"a{suffix}", bytes_of[1])


def test_saving_over_a_directory(tmp_path: Path) -> None:
    (tmp_path / "a.png").mkdir()
    refused("is a directory; expected the name of a file", save, tmp_path / "a.png", bytes_of[1])


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="a folder that even root cannot write in")
@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_unwritable_place(suffix: str) -> None:
    refused(r"cannot be written \(.+\); check the folder", save, f"/proc/self/a{suffix}", bytes_of[1])


@pytest.mark.parametrize("shape", [(), (3,), (2, 2, 5), (1, 2, 2, 3)])
def test_a_shape_that_is_no_picture(tmp_path: Path, shape: tuple[int, ...]) -> None:
    message = rf"of shape {re.escape(str(shape))}; expected \(h, w\) or \(h, w, 1 to 4\)"
    refused(message, save, tmp_path / "a.png", np.zeros(shape))


@pytest.mark.parametrize("shape", [(0, 4), (4, 0, 3)])
@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy"])
def test_zero_size(tmp_path: Path, shape: tuple[int, ...], suffix: str) -> None:
    refused("pixels; expected at least 1×1", save, tmp_path / f"a{suffix}", np.zeros(shape))


@pytest.mark.parametrize("dtype", [np.int32, np.uint32, bool, complex, object])
def test_dtypes_without_a_scale(tmp_path: Path, dtype: Any) -> None:
    refused(
        r"of dtype \w+; expected float in \[0, 1\], uint8 or uint16",
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
    refused("WebP cannot hold 70000×1 pixels", save, tmp_path / "a.webp", wide)
    save(tmp_path / "a.png", wide)
