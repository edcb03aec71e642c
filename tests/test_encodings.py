"""Linear light of files that state their transfer function: PNG, DPX; by `pg.load`, the command and `pg.frames`."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands import main
from passgraph.files import Still, ToArrays
from passgraph.image_files import opened_image
from passgraph.pictures import load_stored
from tests.picture_files import refused

CODES = np.arange(0, 256, 17, dtype=np.uint8).reshape(4, 4, 1).repeat(3, axis=2)
VALUES = CODES / 255.0


def srgb(codes: Any) -> Any:
    """IEC 61966-2-1."""
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def png(path: Path, *chunks: tuple[bytes, bytes]) -> Path:
    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", 4, 4, 8, 2, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in CODES)
    parts = [(b"IHDR", head), *chunks, (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts))
    return path


def gamma(value: int) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", value)


#: W3C PNG, third edition, 4.3: what the chunks say.
STATED = {
    "nothing": ((), srgb),
    "sRGB": (((b"sRGB", b"\0"), gamma(45455)), srgb),
    "gAMA 1": ((gamma(100000),), lambda codes: codes),
    "gAMA 1/2.2": ((gamma(45455),), lambda codes: codes**2.2),
    "gAMA 1/1.8": ((gamma(55556),), lambda codes: codes**1.8),
    "cICP linear": (((b"cICP", bytes((1, 8, 0, 1))),), lambda codes: codes),
    "cICP sRGB": (((b"cICP", bytes((1, 13, 0, 1))),), srgb),
    "cICP Display P3": (((b"cICP", bytes((12, 13, 0, 1))),), srgb),
}


@pytest.mark.parametrize("stated", STATED)
def test_linear_light_of_png(tmp_path: Path, stated: str) -> None:
    chunks, light_of = STATED[stated]
    path = png(tmp_path / "a.png", *chunks)
    expected = light_of(VALUES)
    np.testing.assert_allclose(pg.load(path, linear=True)[..., :3], expected, atol=2e-7)
    assert np.array_equal(pg.load(path)[..., :3], VALUES.astype(np.float32))
    assert np.array_equal(load_stored(path)[..., :3], CODES)
    same = pg.kernel(source="def same(color: Image) -> vec4: return color[0, 0]")
    with pg.compile(same(pg.Input("frame")), backend="reference") as program:
        for source in (str(path), {"frame": str(path)}):
            made = ToArrays()
            pg.frames(program, source, made, linear=True)
            np.testing.assert_allclose(made.pictures[0][..., :3], expected, atol=2e-7)
    still = next(iter(Still(path)))
    assert np.array_equal(still.read(), load_stored(path))
    assert np.array_equal(still.pixels(linear=True), load_stored(path, linear=True))


@pytest.mark.parametrize("stated", STATED)
@pytest.mark.parametrize("several", [False, True])
def test_linear_light_of_the_command(tmp_path: Path, stated: str, several: bool) -> None:
    """As floats; and as codes, which are sRGB's then, and say so."""
    chunks, light_of = STATED[stated]
    path = png(tmp_path / "a.png", *chunks)
    inputs = [path, png(tmp_path / "b.png", *chunks)] if several else [path]
    for suffix in ("exr", "png"):
        output = str(tmp_path / ("out.%d." if several else "out.")) + suffix
        words = ["gaussian-blur", *map(str, inputs), "--radius-px", "0", "--linear", "-o", output, "--backend", "numpy"]
        with pytest.raises(SystemExit) as ended:
            main(["apply", *words])
        assert not ended.value.code
        result = Path(output % 1 if several else output)
        if suffix == "exr":
            np.testing.assert_allclose(pg.load(result)[..., :3], light_of(VALUES), atol=2e-6)
            continue
        with opened_image(result) as image:
            assert image.encoding.startswith("srgb")
        assert np.abs(srgb(pg.load(result)[..., :3]) - light_of(VALUES)).max() < 0.01


@pytest.mark.parametrize("codes", [(9, 16, 0, 1), (9, 18, 0, 1)])
def test_light_of_encodings_without_a_curve_here(
    tmp_path: Path, codes: tuple[int, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    path = png(tmp_path / "a.png", (b"cICP", bytes(codes)))
    message = "is encoded as (pq|hlg)_rec2020_display, not sRGB; load it without linear=True"
    refused(message, pg.load, path, linear=True)
    assert pg.load(path).shape == (4, 4, 4)
    with pytest.raises(SystemExit) as ended:
        main(["apply", "gaussian-blur", str(path), "--linear", "-o", str(tmp_path / "b.png"), "--backend", "numpy"])
    assert ended.value.code
    assert "or name its color space: --from-space" in capsys.readouterr().err


@pytest.mark.parametrize(("transfer", "is_light"), [("Linear", True), ("Unspecified video", False)])
def test_linear_light_of_dpx(tmp_path: Path, transfer: str, is_light: bool) -> None:
    oiio: Any = pytest.importorskip("OpenImageIO")
    spec = oiio.ImageSpec(4, 4, 3, "uint16")
    spec.attribute("dpx:Transfer", transfer)
    output = oiio.ImageOutput.create(str(tmp_path / "a.dpx"))
    assert output.open(str(tmp_path / "a.dpx"), spec)
    output.write_image(CODES.astype(np.uint16) * 257)
    output.close()
    expected = VALUES if is_light else srgb(VALUES)
    np.testing.assert_allclose(pg.load(tmp_path / "a.dpx", linear=True)[..., :3], expected, atol=2e-7)
