"""Files that OpenImageIO misreads without an error, against files made by hand, tifffile and Pillow."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.pictures import load_stored, metadata_of
from tests.picture_files import refused
from tests.tiff_files import (
    ASSOCIATED,
    BLACK_IS_ZERO,
    CMYK,
    PALETTE,
    RGB,
    UNASSOCIATED,
    UNSPECIFIED,
    WHITE_IS_ZERO,
    tiff,
)  # fmt: skip

rng = np.random.default_rng(3)
WIDTH = 21


def written(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def numbers(shape: tuple[int, ...], bits: int, *, floats: bool = False) -> np.ndarray[Any, Any]:
    return rng.random(shape).astype(f"f{bits // 8}") if floats else rng.integers(0, 1 << bits, shape)


# TIFF: each sample type in each layout. A part that a reader leaves unwritten holds what memory held before.

LAYOUTS = {"one strip": {}, "strips of 3": {"rows": 3}, "strips of 1": {"rows": 1}, "tiles": {"tile": 16}}
SAMPLES = [*((bits, False) for bits in (1, 2, 4, 8, 10, 12, 14, 16)), (16, True), (32, True), (64, True)]
KINDS = {
    "gray": (BLACK_IS_ZERO, 1, ()),
    "inverted": (WHITE_IS_ZERO, 1, ()),
    "gray and alpha": (BLACK_IS_ZERO, 2, (UNASSOCIATED,)),
    "inverted, and alpha": (WHITE_IS_ZERO, 2, (UNASSOCIATED,)),
    "rgb": (RGB, 3, ()),
    "rgba": (RGB, 4, (UNASSOCIATED,)),
    "cmyk": (CMYK, 4, ()),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(("bits", "floats"), SAMPLES, ids=lambda value: str(value))
def test_each_sample_type_in_each_layout_of_tiff(tmp_path: Path, bits: int, floats: bool, layout: str) -> None:
    if bits == 64:
        pytest.importorskip("tifffile")
    for (kind, (photometric, samples, extra)), planar, height in itertools.product(
        KINDS.items(), (False, True), (1, 5, 18)
    ):
        if floats and photometric in (WHITE_IS_ZERO, CMYK):
            continue  # TIFF does not say what they mean
        values = numbers((height, WIDTH, samples), bits, floats=floats)
        order = "<>"[height % 2]
        data = tiff(values, bits, photometric, planar=planar, extra=extra, order=order, **LAYOUTS[layout])  # type: ignore[arg-type]
        found = load_stored(written(tmp_path, "a.tif", data))
        full = 1 if floats else np.iinfo(found.dtype).max
        expected = values.astype(np.float32) if floats else np.rint(values * (full / ((1 << bits) - 1)))
        if photometric == WHITE_IS_ZERO:
            expected[..., 0] = full - expected[..., 0]
        if photometric == CMYK:
            expected = np.rint((1 - expected[..., :3] / full) * (1 - expected[..., 3:] / full) * full)
        colors = expected[..., :3] if samples > 2 else expected[..., [0, 0, 0]]
        alpha = expected[..., -1] if extra else np.full((height, WIDTH), full)
        most = 2 if photometric == CMYK else 1 if bits in (10, 12, 14) else 0
        difference = np.abs(found - np.dstack([colors, alpha]).astype(np.float64))
        assert difference.max() <= most, (kind, planar, height)


@pytest.mark.parametrize("compression", ["zlib", None])
@pytest.mark.parametrize("big", [False, True])
def test_float64_of_tifffile(tmp_path: Path, compression: str | None, big: bool) -> None:
    tifffile = pytest.importorskip("tifffile")
    for planar, options in itertools.product(
        (False, True), ({"tile": (16, 16)}, {"rowsperstrip": 1}, {"rowsperstrip": 4})
    ):
        values = rng.normal(size=(3, 17, 19) if planar else (17, 19, 3))
        path = tmp_path / "a.tif"
        tifffile.imwrite(
            path, values, photometric="rgb", planarconfig="separate" if planar else "contig", bigtiff=big,
            compression=compression, **options,
        )  # fmt: skip
        expected = np.moveaxis(values, 0, 2) if planar else values
        assert np.array_equal(pg.load(path)[..., :3], expected.astype(np.float32))


def test_float64_that_ends_early(tmp_path: Path) -> None:
    pytest.importorskip("tifffile")
    data = tiff(numbers((18, WIDTH, 1), 64, floats=True), 64, BLACK_IS_ZERO, tile=16)
    cut = data[: 8 + 16 * 16 * 8] + data[8 + 16 * 16 * 8 * 2 :]
    refused("truncated or corrupt|not a picture that can be read", pg.load, written(tmp_path, "a.tif", cut))


def test_float64_without_tifffile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "tifffile", None)
    path = written(tmp_path, "a.tif", tiff(numbers((5, 5, 1), 64, floats=True), 64, BLACK_IS_ZERO))
    refused("holds float64; tifffile reads it: pip install 'passgraph.tiles.'; or save it as float32", pg.load, path)


@pytest.mark.parametrize(
    ("photometric", "samples", "bits", "extra", "error"),
    [
        (PALETTE, 2, 8, (UNASSOCIATED,), "is a palette with alpha, or of 8 bits; expected a palette of 1, 2, 4,"),
        (PALETTE, 2, 8, (0,), "is a palette with alpha"),
        (PALETTE, 1, 6, (), "is a palette with alpha, or of 6 bits"),
        (CMYK, 5, 8, (ASSOCIATED,), "holds inks other than CMYK; expected gray, RGB or CMYK; convert it to RGB"),
    ],
)  # fmt: skip
def test_what_is_refused_of_tiff(
    tmp_path: Path, photometric: int, samples: int, bits: int, extra: tuple[int, ...], error: str
) -> None:
    palette = rng.integers(0, 65536, 3 << bits).tolist() if photometric == PALETTE else ()
    data = tiff(numbers((5, 5, samples), bits), bits, photometric, extra=extra, palette=palette)
    refused(error, pg.load, written(tmp_path, "a.tif", data))


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_palettes_without_alpha(tmp_path: Path, bits: int) -> None:
    palette = (rng.integers(0, 256, 3 << bits) * 257).tolist()
    path = written(tmp_path, "a.tif", tiff(numbers((5, 9, 1), bits), bits, PALETTE, palette=palette))
    assert np.array_equal(load_stored(path)[..., :3], np.asarray(Image.open(path).convert("RGB")))


# BMP

MASKS = {
    "bgrx": (0xFF0000, 0xFF00, 0xFF, 0),
    "rgbx": (0xFF, 0xFF00, 0xFF0000, 0),
    "bgra": (0xFF0000, 0xFF00, 0xFF, 0xFF000000),
    "rgba": (0xFF, 0xFF00, 0xFF0000, 0xFF000000),
    "abgr": (0xFF000000, 0xFF0000, 0xFF00, 0xFF),
    "10 bits": (0x3FF00000, 0xFFC00, 0x3FF, 0xC0000000),
    "565": (0xF800, 0x7E0, 0x1F, 0),
    "555": (0x7C00, 0x3E0, 0x1F, 0),
    "4444": (0xF00, 0xF0, 0xF, 0xF000),
}


def bmp(pixels: np.ndarray[Any, Any], masks: tuple[int, ...], *, header: int = 40, compression: int = 3) -> bytes:
    """A BMP of words, row 0 at the bottom."""
    height, width = pixels.shape
    bits = pixels.itemsize * 8
    rows = b"".join(row.tobytes() + bytes(-row.nbytes % 4) for row in pixels[::-1])
    info = struct.pack("<IiiHHIIiiII", header, width, height, 1, bits, compression, len(rows), 2835, 2835, 0, 0)
    info = (info + struct.pack("<IIII", *masks)).ljust(header, b"\0") if header > 40 else info
    behind = struct.pack("<III", *masks[:3]) if header == 40 and compression == 3 else b""
    start = 14 + len(info) + len(behind)
    return b"BM" + struct.pack("<IHHI", start + len(rows), 0, 0, start) + info + behind + rows


@pytest.mark.parametrize("header", [40, 108, 124])
@pytest.mark.parametrize("name", MASKS)
def test_masks_of_bmp(tmp_path: Path, name: str, header: int) -> None:
    masks = MASKS[name]
    bits = 16 if max(masks) < 1 << 16 else 32
    words = rng.integers(0, 1 << bits, (5, 7), np.uint64).astype(f"<u{bits // 8}")
    path = written(tmp_path, "a.bmp", bmp(words, masks, header=header))
    found = load_stored(path)
    full = np.iinfo(found.dtype).max
    for channel, mask in enumerate(masks):
        if mask and not (channel == 3 and header == 40):  # that header has no mask of alpha
            low = (mask & -mask).bit_length() - 1
            expected = np.rint(((words & mask) >> low) * (full / (mask >> low)))
        else:
            expected = np.full(words.shape, full)
        assert np.array_equal(found[..., channel], expected), "rgba"[channel]
    assert metadata_of(path).opaque == (header == 40 or not masks[3])


@pytest.mark.parametrize("unused", [0, 255, 77])
def test_the_unused_byte_of_bmp_is_not_alpha(tmp_path: Path, unused: int) -> None:
    words = rng.integers(0, 1 << 24, (5, 7)).astype("<u4") | np.uint32(unused << 24)
    path = written(tmp_path, "a.bmp", bmp(words, (), compression=0))
    assert (load_stored(path)[..., 3] == 255).all()
    assert np.array_equal(load_stored(path)[..., :3], np.asarray(Image.open(path).convert("RGB")))


def test_bmp_top_down(tmp_path: Path) -> None:
    words = rng.integers(0, 1 << 32, (5, 7), np.uint64).astype("<u4")
    data = bytearray(bmp(words[::-1], MASKS["rgba"], header=108))
    data[22:26] = struct.pack("<i", -5)
    path = written(tmp_path, "a.bmp", bytes(data))
    assert np.array_equal(load_stored(path)[..., 0], words & 255)
    assert np.array_equal(load_stored(path), np.asarray(Image.open(path)))


def test_alpha_of_bmp_is_written_with_a_mask(tmp_path: Path) -> None:
    pixels = rng.integers(0, 256, (5, 7, 4), np.uint8)
    pg.save(tmp_path / "a.bmp", pixels)
    with Image.open(tmp_path / "a.bmp") as opened:
        assert opened.mode == "RGBA"
        assert np.array_equal(np.asarray(opened), pixels)
    assert np.array_equal(load_stored(tmp_path / "a.bmp"), pixels)


@pytest.mark.parametrize(
    ("masks", "error"),
    [
        ((0xFF0000, 0, 0xFF, 0), "has masks 0xff0000, 0x0"),
        ((0xFF00, 0xFF00, 0xFF, 0), "has masks"),
        ((0xF0F0000, 0xFF00, 0xFF, 0), "has masks"),
    ],
)
def test_impossible_masks_of_bmp(tmp_path: Path, masks: tuple[int, ...], error: str) -> None:
    words = np.zeros((5, 7), "<u4")
    refused(f"truncated or corrupt .{error}", pg.load, written(tmp_path, "a.bmp", bmp(words, masks, header=108)))


def test_bmp_that_ends_early(tmp_path: Path) -> None:
    data = bmp(np.zeros((5, 7), "<u4"), MASKS["rgba"], header=108)
    refused("truncated or corrupt .ends before its picture", pg.load, written(tmp_path, "a.bmp", data[:-1]))
    refused("truncated or corrupt|not a picture", pg.load, written(tmp_path, "a.bmp", data[:60]))


# FITS

TYPES = {"u1": 8, "i2": 16, "i4": 32, "f4": -32, "f8": -64}


def fits(values: np.ndarray[Any, Any], **keys: object) -> bytes:
    """A FITS file of (planes, height, width) or (height, width), row 0 at the bottom."""
    head = {"SIMPLE": "T", "BITPIX": TYPES[values.dtype.str[1:]], "NAXIS": values.ndim}
    head |= {f"NAXIS{axis}": size for axis, size in enumerate(values.shape[::-1], 1)} | keys
    cards = "".join(f"{name:8}= {value!s:>20}".ljust(80) for name, value in head.items()) + "END".ljust(80)
    data = values.astype(values.dtype.newbyteorder(">")).tobytes()
    return cards.ljust(-(-len(cards) // 2880) * 2880).encode() + data + bytes(-len(data) % 2880)


def test_fits_without_channels(tmp_path: Path) -> None:
    """A damaged header, of which OpenImageIO 3.2 makes a picture of 0 channels."""
    data = fits(np.zeros((3, 4, 4), np.uint8)).replace(b"NAXIS2", b"3AXIS2").replace(b"NAXIS3", b"NAXI43")
    refused(r"a\.fits: truncated or corrupt \(it has no channels\)", pg.load, written(tmp_path, "a.fits", data))


def test_unsigned_fits(tmp_path: Path) -> None:
    physical = rng.integers(0, 65536, (5, 7)).astype(np.uint16)
    physical[0, :3] = 0, 32768, 65535
    data = fits((physical.astype(np.int32) - 32768).astype(np.int16), BZERO="32768.0", BSCALE=1)
    found = load_stored(written(tmp_path, "a.fits", data))
    assert found.dtype == np.uint16
    assert np.array_equal(found[..., 0], physical[::-1])


@pytest.mark.parametrize("dtype", TYPES)
def test_scaled_fits(tmp_path: Path, dtype: str) -> None:
    values = rng.integers(0, 100, (5, 7)).astype(dtype)
    data = fits(values, BZERO="1.5D1", BSCALE="-0.25")
    found = pg.load(written(tmp_path, "a.fits", data))
    assert np.array_equal(found[..., 0], (15 - 0.25 * values[::-1]).astype(np.float32))


@pytest.mark.parametrize("planes", [1, 2, 3, 4])
def test_planes_of_fits(tmp_path: Path, planes: int) -> None:
    values = rng.integers(0, 256, (planes, 5, 7)).astype(np.uint8)
    found = load_stored(written(tmp_path, "a.fits", fits(values)))
    expected = values[[0, 0, 0]] if planes == 1 else np.concatenate([values, np.zeros((1, 5, 7))])[:3]
    assert np.array_equal(found[..., :3], np.moveaxis(expected, 0, 2)[::-1])
    assert (found[..., 3] == 255).all()


def test_a_scale_of_fits_that_is_no_number(tmp_path: Path) -> None:
    data = fits(np.zeros((5, 7), np.uint8), BZERO="'many'")
    refused("truncated or corrupt .BZERO or BSCALE: could not convert", pg.load, written(tmp_path, "a.fits", data))


# TGA


def tga(pixels: np.ndarray[Any, Any], attributes: int, alpha: int | None = None) -> bytes:
    """A TGA, row 0 on top; with an extension area if the kind of alpha is given."""
    height, width, channels = pixels.shape
    kind = 3 if channels < 3 else 2
    stored = pixels if channels < 3 else pixels[..., [2, 1, 0, 3][:channels]]
    head = struct.pack("<BBBHHBHHHHBB", 0, 0, kind, 0, 0, 0, 0, 0, width, height, channels * 8, attributes | 0x20)
    data = head + stored.tobytes()
    if alpha is None:
        return data
    extension = struct.pack("<H", 495).ljust(494, b"\0") + bytes([alpha])
    return data + extension + struct.pack("<II", len(data), 0) + b"TRUEVISION-XFILE.\0"


def test_gray_and_alpha_of_tga(tmp_path: Path) -> None:
    pixels = rng.integers(0, 256, (5, 7, 2), dtype=np.uint8)
    path = written(tmp_path, "a.tga", tga(pixels, 8))
    assert np.array_equal(load_stored(path), np.asarray(Image.open(path).convert("RGBA")))
    assert np.array_equal(load_stored(path), pixels[..., [0, 0, 0, 1]])


@pytest.mark.parametrize(("kind", "has_alpha"), [(None, True), (0, False), (1, False), (2, True), (3, True)])
def test_kinds_of_alpha_of_tga(tmp_path: Path, kind: int | None, has_alpha: bool) -> None:
    pixels = rng.integers(0, 256, (5, 7, 4), dtype=np.uint8)
    path = written(tmp_path, "a.tga", tga(pixels, 8, kind))
    pixels[..., 3] = pixels[..., 3] if has_alpha else 255
    assert np.array_equal(load_stored(path), pixels)
    assert metadata_of(path).opaque is not has_alpha


def test_associated_alpha_of_tga(tmp_path: Path) -> None:
    pixels = np.full((5, 7, 4), (50, 100, 0, 100), np.uint8)
    assert load_stored(written(tmp_path, "a.tga", tga(pixels, 8, 4)))[0, 0].tolist() == [128, 255, 0, 100]


@pytest.mark.parametrize(("declared", "alpha"), [(0, 255), (8, 0)])
def test_alpha_of_zero_that_tga_does_not_declare(tmp_path: Path, declared: int, alpha: int) -> None:
    pixels = rng.integers(0, 256, (5, 7, 4), dtype=np.uint8)
    pixels[..., 3] = 0
    assert (load_stored(written(tmp_path, "a.tga", tga(pixels, declared)))[..., 3] == alpha).all()


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5])
def test_files_and_tiles_choose_the_same_samples(tmp_path: Path, samples: int, layout: str) -> None:
    """Whatever the tag ExtraSamples says; near infrared, for example, is no alpha."""
    pytest.importorskip("tifffile")
    from passgraph.tiles.tiff import TiffSource

    photometric, colors = (RGB, 3) if samples > 2 else (BLACK_IS_ZERO, 1)
    meanings = [
        extra
        for count in range(samples - colors + 1)
        for extra in itertools.product((UNSPECIFIED, ASSOCIATED, UNASSOCIATED), repeat=count)
        if count in (0, samples - colors) and extra != (ASSOCIATED, UNASSOCIATED)  # which of two, no tag says
    ]
    for extra, planar in itertools.product(meanings, (False, True)):
        values = numbers((18, WIDTH, samples), 8)
        data = tiff(values, 8, photometric, extra=extra, planar=planar, **LAYOUTS[layout])  # type: ignore[arg-type]
        path = written(tmp_path, "a.tif", data)
        whole = load_stored(path)
        source = TiffSource(path, "frame")
        part = source.read((0, 18, 0, WIDTH))
        source.close()
        if samples == 2:
            assert np.array_equal(part[..., 0], whole[..., 0])
            assert np.array_equal(part[..., 1], whole[..., 3 if any(extra) else 1])
        else:
            assert np.array_equal(part, whole[..., : part.shape[2]]), (extra, planar)
            assert part.shape[2] == 4 or (whole[..., 3] == 255).all(), (extra, planar)


# DPX


@pytest.mark.parametrize("endian", ["big", "little"])
@pytest.mark.parametrize("width", range(1, 9))
def test_every_sample_of_dpx_of_10_bits(tmp_path: Path, width: int, endian: str) -> None:
    """As FFmpeg decodes them; its planes are green, blue, red and alpha."""
    av = pytest.importorskip("av")
    oiio: Any = pytest.importorskip("OpenImageIO")
    values = numbers((5, width, 4), 10)
    path = str(tmp_path / "a.dpx")
    spec = oiio.ImageSpec(width, 5, 4, "uint16")
    for name, value in (("oiio:BitsPerSample", 10), ("oiio:Endian", endian), ("oiio:UnassociatedAlpha", 1)):
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(path)
    assert output.open(path, spec)
    assert output.write_image((values << 6 | values >> 4).astype(np.uint16))
    assert output.close()
    with av.open(path) as opened:
        frame = next(opened.decode(video=0))
    assert frame.format.name.startswith("gbrap10")
    decoded = [np.frombuffer(plane, np.uint16).reshape(5, -1)[:, :width] for plane in frame.planes]
    assert np.array_equal(np.stack([decoded[plane] for plane in (2, 0, 1, 3)], axis=-1), values)
    for _ in range(3):
        assert np.array_equal(load_stored(Path(path)) >> 6, values)
