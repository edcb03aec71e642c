"""JPEG files with a gain map, made from the specifications; their formula in NumPy is the truth."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands import main
from passgraph.gain_map import Gain
from passgraph.image_files import opened_image
from passgraph.pictures import load_stored, metadata_of
from tests.picture_files import refused

rng = np.random.default_rng(11)
NAMESPACE = "http://ns.adobe.com/hdr-gain-map/1.0/"
PROPERTIES = {"GainMapMin": -0.5, "GainMapMax": 2.5, "Gamma": 1.5, "OffsetSDR": 0.02, "OffsetHDR": 0.01,
              "HDRCapacityMin": 0, "HDRCapacityMax": 2.3}  # fmt: skip
CHANNELS = {**PROPERTIES, "GainMapMax": (2.5, 2.0, 1.5), "Gamma": (1.5, 1.0, 0.7)}


def jpeg(pixels: np.ndarray[Any, Any], *segments: tuple[int, bytes], **options: Any) -> bytes:
    """A JPEG with further segments behind its start."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=95, subsampling=0, **options)
    data = stream.getvalue()
    packed = b"".join(bytes([0xFF, marker]) + struct.pack(">H", len(body) + 2) + body for marker, body in segments)
    return data[:2] + packed + data[2:]


def xmp(**properties: Any) -> tuple[int, bytes]:
    flat = {name: value for name, value in properties.items() if not isinstance(value, tuple)}
    lists = {name: value for name, value in properties.items() if isinstance(value, tuple)}
    inner = "".join(
        f"<g:{name}><rdf:Seq>{''.join(f'<rdf:li>{item}</rdf:li>' for item in value)}</rdf:Seq></g:{name}>"
        for name, value in lists.items()
    )
    text = (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'<rdf:Description xmlns:g="{NAMESPACE}" g:Version="1.0"'
        + "".join(f' g:{name}="{value}"' for name, value in flat.items())
        + f">{inner}</rdf:Description></rdf:RDF></x:xmpmeta>"
    )
    return 0xE1, b"http://ns.adobe.com/xap/1.0/\0" + text.replace("g:", "hdrgm:").replace(":g=", ":hdrgm=").encode()


def iso(properties: dict[str, Any], *, common: bool = False, flags: int = 0x40) -> tuple[int, bytes]:
    """ISO 21496-1, annex C: fractions with denominators of 1000, or a common one."""
    several = any(isinstance(value, tuple) for value in properties.values())
    triples = {name: value if isinstance(value, tuple) else (value,) * 3 for name, value in properties.items()}

    def fraction(name: str, channel: int) -> bytes:
        return struct.pack(">i", round(1000 * triples[name][channel])) + (b"" if common else struct.pack(">I", 1000))

    body = struct.pack(">HHB", 0, 0, flags | 0x80 * several | 8 * common) + (struct.pack(">I", 1000) if common else b"")
    body += fraction("HDRCapacityMin", 0) + fraction("HDRCapacityMax", 0)
    for channel in range(3 if several else 1):
        for name in ("GainMapMin", "GainMapMax", "Gamma", "OffsetSDR", "OffsetHDR"):
            body += fraction(name, channel)
    return 0xE2, b"urn:iso:std:iso:ts:21496:-1\0" + body


ISO_VERSION = 0xE2, b"urn:iso:std:iso:ts:21496:-1\0" + bytes(4)


def smooth(*shape: int) -> np.ndarray[Any, Any]:
    """Bytes that JPEG keeps nearly."""
    small = rng.integers(30, 256, (4, 4, *shape[2:]), np.uint8)
    return np.asarray(Image.fromarray(small).resize((shape[1], shape[0]), Image.Resampling.BICUBIC))


def decoded(data: bytes) -> np.ndarray[Any, Any]:
    return np.asarray(Image.open(io.BytesIO(data)))


def expected_hdr(base: bytes, gains: bytes, properties: dict[str, Any]) -> np.ndarray[Any, Any]:
    """The formula of the specifications, in float64."""
    encoded = np.atleast_3d(decoded(base)) / 255.0
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    height, width = light.shape[:2]
    found = np.atleast_3d(decoded(gains)).astype(np.float64)
    for axis, size in ((0, height), (1, width)):
        places = (np.arange(size) + 0.5) * found.shape[axis] / size - 0.5
        known = np.arange(found.shape[axis])
        found = np.apply_along_axis(
            lambda line, places=places, known=known: np.interp(places, known, line), axis, found
        )
    value = {name: np.asarray(numbers, np.float64) for name, numbers in properties.items()}
    gain = (found / 255) ** (1 / value["Gamma"])
    boost = 2 ** (value["GainMapMin"] * (1 - gain) + value["GainMapMax"] * gain)
    return np.broadcast_to((light + value["OffsetSDR"]) * boost - value["OffsetHDR"], (height, width, 3))


FILES = {
    "Adobe": lambda p: ([xmp()], [xmp(**p)]),
    "ISO": lambda p: ([ISO_VERSION], [iso(p)]),
    "ISO, one denominator": lambda p: ([ISO_VERSION], [iso(p, common=True)]),
    "both": lambda p: ([xmp(), ISO_VERSION], [xmp(**{**p, "GainMapMax": 9}), iso(p)]),
}


@pytest.mark.parametrize("properties", [PROPERTIES, CHANNELS], ids=["one", "channels"])
@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("progressive", [False, True])
def test_base_picture_and_hdr_rendition(
    tmp_path: Path, kind: str, properties: dict[str, Any], progressive: bool
) -> None:
    of_base, of_map = FILES[kind](properties)
    base = jpeg(smooth(48, 64, 3), *of_base, progressive=progressive)
    gains = jpeg(smooth(12, 16, 3) if properties is CHANNELS else smooth(12, 16), *of_map)
    path = tmp_path / "photo.jpg"
    path.write_bytes(base + gains)
    stored = load_stored(path)
    assert stored.dtype == np.uint8
    assert np.array_equal(stored[..., :3], decoded(base))
    assert np.array_equal(load_stored(Path("photo.jpg"), path.read_bytes()), stored)
    for found in (pg.load(f"{path}:hdr"), pg.load(path, layer="hdr")):
        expected = expected_hdr(base, gains, properties)
        np.testing.assert_allclose(found[..., :3], expected, rtol=2e-5, atol=2e-5)
        assert (found[..., 3] == 1).all()
    assert expected.max() > 1.5
    assert metadata_of(Path(f"{path}:hdr")).get("hdrHeadroom") == pytest.approx(2**2.3)
    assert metadata_of(path).get("hdrgm:Version") is None


@pytest.mark.parametrize("kind", FILES)
def test_libultrahdr_reads_the_same(tmp_path: Path, kind: str) -> None:
    """OpenImageIO's own result, made by libultrahdr in half floats from tables: within 2 %."""
    oiio = pytest.importorskip("OpenImageIO")
    of_base, of_map = FILES[kind](PROPERTIES)
    path = tmp_path / "photo.jpg"
    path.write_bytes(jpeg(smooth(48, 64, 3), *of_base) + jpeg(smooth(48, 64), *of_map))
    reader = oiio.ImageInput.open(str(path))
    if str(reader.spec().format) != "half":
        pytest.skip("this OpenImageIO has no libultrahdr")
    np.testing.assert_allclose(
        pg.load(f"{path}:hdr")[..., :3], reader.read_image("float")[..., :3], rtol=0.02, atol=1e-3
    )


def test_what_stands_between_the_pictures(tmp_path: Path) -> None:
    """A preview without metadata, and a film."""
    base, gains = jpeg(smooth(24, 32, 3), xmp()), jpeg(smooth(24, 32), xmp(**PROPERTIES))
    path = tmp_path / "photo.jpeg"
    path.write_bytes(base + bytes(100) + b"\xff\xd8\xff\x00" + jpeg(smooth(8, 8, 3)) + gains + b"ftyp" + bytes(50))
    found = pg.load(f"{path}:hdr")[..., :3]
    np.testing.assert_allclose(found, expected_hdr(base, gains, PROPERTIES), rtol=2e-5, atol=2e-5)


def test_turned_photos(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    base, gains = jpeg(smooth(24, 32, 3), xmp(), exif=exif), jpeg(smooth(24, 32), xmp(**PROPERTIES))
    path = tmp_path / "photo.jpg"
    path.write_bytes(base + gains)
    turned = expected_hdr(base, gains, PROPERTIES).swapaxes(0, 1)[:, ::-1]
    np.testing.assert_allclose(pg.load(f"{path}:hdr")[..., :3], turned, rtol=2e-5, atol=2e-5)


def test_gray_photos(tmp_path: Path) -> None:
    base, gains = jpeg(smooth(24, 32), xmp()), jpeg(smooth(24, 32), xmp(**PROPERTIES))
    path = tmp_path / "photo.jpg"
    path.write_bytes(base + gains)
    expected = expected_hdr(base, gains, PROPERTIES)
    np.testing.assert_allclose(pg.load(f"{path}:hdr")[..., :3], expected, rtol=2e-5, atol=2e-5)


def test_properties_that_are_left_out(tmp_path: Path) -> None:
    base, gains = jpeg(smooth(24, 32, 3), xmp()), jpeg(smooth(24, 32), xmp(GainMapMax=2, HDRCapacityMax=2))
    path = tmp_path / "photo.jpg"
    path.write_bytes(base + gains)
    full = {"GainMapMin": 0, "GainMapMax": 2, "Gamma": 1, "OffsetSDR": 1 / 64, "OffsetHDR": 1 / 64}
    found = pg.load(f"{path}:hdr")[..., :3]
    np.testing.assert_allclose(found, expected_hdr(base, gains, full), rtol=2e-5, atol=2e-5)


def test_interpolation_by_another_library() -> None:
    """OpenCV and this code agree where pixels of the map lie."""
    cv2 = pytest.importorskip("cv2")
    gains = rng.integers(0, 256, (5, 7, 1), np.uint8)
    linear = Gain((0.0,) * 3, (1.0,) * 3, (1.0,) * 3, (1.0,) * 3, (0.0,) * 3, 1.0)  # type: ignore[arg-type]
    for height, width in ((20, 28), (13, 9), (5, 7), (1, 50)):
        found = np.log2(linear.applied(np.zeros((height, width, 3), np.uint8), gains)[..., 0])
        expected = cv2.resize(gains[..., 0].astype(np.float32) / 255, (width, height), interpolation=cv2.INTER_LINEAR)
        np.testing.assert_allclose(found, expected, atol=2e-3 if height == 20 else 1e-5)


@pytest.mark.parametrize(
    ("segment", "error"),
    [
        (xmp(GainMapMax=2), "its gain map has no HDRCapacityMax; read .*photo.jpg without :hdr"),
        (xmp(**PROPERTIES, BaseRenditionIsHDR="True"), "its base picture is the HDR rendition"),
        (xmp(**{**PROPERTIES, "GainMapMax": (1, 2)}), "its gain map has 2 values for a property; expected 1 or 3"),
        (xmp(**{**PROPERTIES, "GainMapMax": "nan"}), "its gain map has metadata that is no number"),
        (xmp(**{**PROPERTIES, "Gamma": 0}), "its gain map has metadata that is no number"),
        (xmp(**{**PROPERTIES, "GainMapMax": "wide"}), "could not convert string to float"),
        (iso(PROPERTIES, flags=0), "its gain map is for other primaries than those of the base picture"),
        (iso(PROPERTIES, flags=0x44), "its base picture is the HDR rendition"),
        (iso({**PROPERTIES, "HDRCapacityMin": 3}), "its base picture is the HDR rendition"),
        ((0xE2, iso(PROPERTIES)[1][:50]), "unpack requires a buffer"),
        ((0xE2, b"urn:iso:std:iso:ts:21496:-1\0" + b"\0\1\0\0\0"), "its gain map has version 1; expected 0"),
        ((0xE1, xmp()[1][:29] + b"<!DOCTYPE x>" + xmp(**PROPERTIES)[1][29:]), "its metadata is no XMP"),
        ((0xE1, xmp(**PROPERTIES)[1][:-5]), "no element found|unclosed|not well-formed"),
    ],
)
def test_gain_maps_that_are_not_read(tmp_path: Path, segment: tuple[int, bytes], error: str) -> None:
    base = jpeg(smooth(24, 32, 3), xmp())
    path = tmp_path / "photo.jpg"
    path.write_bytes(base + jpeg(smooth(24, 32), segment))
    refused(f"photo.jpg:hdr: .*{error}", pg.load, f"{path}:hdr")
    assert np.array_equal(load_stored(path)[..., :3], decoded(base))


def test_a_gain_map_that_was_cut_off(tmp_path: Path) -> None:
    base, gains = jpeg(smooth(24, 32, 3), xmp()), jpeg(smooth(24, 32), xmp(**PROPERTIES))
    path = tmp_path / "photo.jpg"
    path.write_bytes(base)
    assert np.array_equal(load_stored(path)[..., :3], decoded(base))
    refused("photo.jpg:hdr: it has no gain map", pg.load, f"{path}:hdr")
    path.write_bytes(base + gains[: len(gains) // 2 + 300])
    refused("truncated or corrupt", pg.load, f"{path}:hdr")
    path.write_bytes(base[:-200])
    refused("truncated or corrupt", pg.load, path)


def test_a_gain_map_larger_than_its_picture(tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"
    path.write_bytes(jpeg(smooth(24, 32, 3), xmp()) + jpeg(smooth(24, 33), xmp(**PROPERTIES)))
    refused("a gain map of 33×24 pixels for 32×24", pg.load, f"{path}:hdr")


def test_jpeg_without_gain_map(tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"
    path.write_bytes(jpeg(smooth(24, 32, 3)))
    refused("no layer 'hdr'; it has none", pg.load, f"{path}:hdr")


def test_memory_is_checked_before_decoding(tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"
    path.write_bytes(jpeg(smooth(24, 32, 3), xmp()) + jpeg(smooth(24, 32), xmp(**PROPERTIES)))
    refused("expected at most 40000", pg.load, f"{path}:hdr", max_bytes=40000)
    assert pg.load(path, max_bytes=40000).shape == (24, 32, 4)


@pytest.mark.parametrize("words", [("photo.jpg:hdr",), ("photo.jpg", "--layer", "hdr"), (".", "--layer", "hdr")])
def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]) -> None:
    """The result holds linear light, and states its headroom."""
    monkeypatch.chdir(tmp_path)
    base, gains = jpeg(smooth(24, 32, 3), xmp()), jpeg(smooth(24, 32), xmp(**PROPERTIES))
    Path("photo.jpg").write_bytes(base + gains)
    output = "out/%d.exr" if words[0] == "." else "out.exr"
    Path("out").mkdir()
    with pytest.raises(SystemExit) as ended:
        main(["apply", "gaussian-blur", *words, "--radius-px", "0", "-o", output, "--backend", "numpy"])
    assert not ended.value.code
    written = Path(output % 1 if "%" in output else output)
    expected = expected_hdr(base, gains, PROPERTIES)
    np.testing.assert_allclose(pg.load(written)[..., :3], expected, rtol=2e-5, atol=2e-5)
    with opened_image(written) as image:
        assert image.spec.getattribute("hdrHeadroom") == pytest.approx(2**2.3)
        assert image.spec.getattribute("ICCProfile") is None
