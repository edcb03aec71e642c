"""Each type of picture that is written, from each that is read, by the command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands import main
from passgraph.image_formats import READABLE, WRITABLE
from passgraph.pictures import load_stored
from tests.test_misread import fits

CODES = np.random.default_rng(2).integers(0, 256, (6, 7, 3), np.uint8)
ALPHA = ("png", "tif", "webp", "bmp", "tga", "exr", "jxl", "dpx", "npy", "sgi")
FLOATS = (".exr", ".hdr", ".pfm", ".npy")


def made_by_oiio(path: Path, pixels: Any) -> None:
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "uint8")
    spec.attribute("oiio:UnassociatedAlpha", 1)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(pixels)
    assert output.close()


def source(folder: Path, suffix: str, *, alpha: bool) -> Path | None:
    """A file of the type with the codes; None for a type that is only read, and not made here."""
    path = folder / f"in{suffix}"
    pixels = np.dstack([CODES, np.full((6, 7), 255, np.uint8)]) if alpha else CODES
    if suffix in WRITABLE:
        pixels = pixels[..., :1] if suffix == ".pgm" else pixels
        pg.save(path, pixels.astype(np.float32) / 255 if suffix in FLOATS else pixels)
    elif suffix in (".gif", ".jp2", ".ico", ".apng"):
        Image.fromarray(pixels).save(path, format={".jp2": "JPEG2000", ".apng": "PNG"}.get(suffix))
    elif suffix in (".dds", ".sgi"):
        Image.fromarray(pixels).save(path)
    elif suffix == ".fits":
        path.write_bytes(fits(np.moveaxis(CODES, 2, 0)[:, ::-1]))
    elif suffix == ".rla":
        made_by_oiio(path, pixels)
    else:
        return None
    return path


#: Types that no library here writes, or only by a name that another suffix tries already.
NOT_MADE = {".iff", ".psd", ".cin", ".pic", ".j2k", ".pbm"}
#: Types without loss that Pillow or this module made.
EXACT = (".apng", ".dds", ".fits", ".ico", ".sgi")
READ = [suffix for suffixes in READABLE.values() for suffix in suffixes] + [".npy"]


@pytest.mark.parametrize("alpha", [False, True], ids=["rgb", "rgba"])
@pytest.mark.parametrize("read", READ)
def test_each_type_is_written_from_each_that_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: str, alpha: bool
) -> None:
    """The picture is opaque, also after a blur whose weights sum to 1 nearly."""
    path = source(tmp_path, read, alpha=alpha) if not alpha or read[1:] in ALPHA else None
    if path is None:
        assert alpha or read in NOT_MADE
        return
    monkeypatch.chdir(tmp_path)
    loaded = pg.load(path)
    if read in EXACT:
        assert np.array_equal(load_stored(path)[..., :3], CODES)
    for written in WRITABLE:
        if written == ".pgm" and read != ".pgm":
            continue  # colors are refused, which another test has
        words = ["gaussian-blur", str(path), "-o", f"out{written}", "--sigma-px", "0.8", "--backend", "numpy"]
        with pytest.raises(SystemExit) as ended:
            main(["apply", *words])
        assert not ended.value.code, written
        found = pg.load(f"out{written}")
        assert found.shape == loaded.shape
        assert found[..., 3].min() > 0.99999, written
