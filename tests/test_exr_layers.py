"""OpenEXR files of renderers: parts, layers without color, alpha of half floats. Truth: the package OpenEXR."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands import main
from passgraph.pictures import load_stored, metadata_of
from tests.exr_files import mip_mapped_cube, scanlines
from tests.picture_files import refused

openexr = pytest.importorskip("OpenEXR")
rng = np.random.default_rng(5)
SHAPE = 6, 8


def channels(*names: str, dtype: str = "f4") -> dict[str, Any]:
    return {name: rng.random(SHAPE).astype(dtype) for name in names}


def write(path: Path, *parts: tuple[dict[str, Any], dict[str, Any]]) -> Path:
    """Write parts of (attributes, channels); one without a name is a file of one part."""
    if len(parts) == 1:
        openexr.File(dict(parts[0][0]), dict(parts[0][1])).write(str(path))
    else:
        openexr.File([openexr.Part(dict(head), dict(body)) for head, body in parts]).write(str(path))
    return path


def stacked(values: dict[str, Any], *names: str) -> Any:
    return np.stack([values[name] for name in names], axis=-1)


# Which part is the picture

BEAUTY = {"name": "rgba"}, channels("R", "G", "B", "A")
OTHERS = {
    "colors in a layer": ({"name": "diffuse"}, channels("diffuse.R", "diffuse.G", "diffuse.B")),
    "colors": ({"name": "diffuse"}, channels("R", "G", "B")),
    "depth as Y": ({"name": "depth"}, channels("Y")),
    "positions": ({"name": "position"}, channels("X", "Y", "Z")),
    "Cryptomatte": ({"name": "CryptoObject00"}, channels("r", "g", "b", "a")),
}


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("first", [True, False])
def test_the_picture_wins_over_other_parts(tmp_path: Path, other: str, first: bool) -> None:
    parts = [BEAUTY, OTHERS[other]] if first else [OTHERS[other], BEAUTY]
    found = pg.load(write(tmp_path / "a.exr", *parts), raw=True)
    assert np.array_equal(found, stacked(BEAUTY[1], "R", "G", "B", "A"))


def test_the_part_that_alone_has_color_needs_no_name_of_its_own(tmp_path: Path) -> None:
    parts = [({"name": "z"}, channels("Z")), ({"name": "anything"}, (values := channels("R", "G", "B")))]
    assert np.array_equal(pg.load(write(tmp_path / "a.exr", *parts))[..., :3], stacked(values, "R", "G", "B"))


def test_the_first_view_is_read(tmp_path: Path) -> None:
    left, right = channels("R", "G", "B"), channels("R", "G", "B")
    parts = [({"name": "left", "view": "left"}, left), ({"name": "right", "view": "right"}, right)]
    file = write(tmp_path / "a.exr", *parts)
    assert np.array_equal(pg.load(file)[..., :3], stacked(left, "R", "G", "B"))
    assert np.array_equal(pg.load(f"{file}:right")[..., :3], stacked(right, "R", "G", "B"))


@pytest.mark.parametrize(
    ("names", "listed"),
    [
        ([("R", "G", "B"), ("R", "G", "B")], "diffuse, specular"),
        ([("diffuse.R", "diffuse.G", "diffuse.B"), ("specular.R", "specular.G", "specular.B")], "diffuse, specular"),
    ],
)
def test_one_of_several_parts_with_color_must_be_named(tmp_path: Path, names: Any, listed: str) -> None:
    first, second = channels(*names[0]), channels(*names[1])
    file = write(tmp_path / "a.exr", ({"name": "diffuse"}, first), ({"name": "specular"}, second))
    refused(f"several layers with color: {listed}; name one: .*a.exr:diffuse", pg.load, file)
    assert np.array_equal(pg.load(f"{file}:specular")[..., :3], stacked(second, *names[1]))


def test_one_of_several_gray_parts_must_be_named(tmp_path: Path) -> None:
    file = write(tmp_path / "a.exr", ({"name": "depth"}, channels("Y")), ({"name": "ids"}, channels("Y")))
    refused("several layers with color: depth, ids; name one", pg.load, file)


# Layers without color


def bits_of(shape: tuple[int, ...]) -> Any:
    """Floats of any bit pattern but NaN: numbers of objects, as Cryptomatte has them."""
    return rng.integers(0, 0x7F800000, shape, np.uint32).view(np.float32)


CRYPTOMATTE = [
    ("CryptoObject00", {}),
    ("crypto_asset01", {}),
    ("ViewLayer.CryptoMaterial02", {}),
    ("things00", {"cryptomatte/1234abc/name": "things"}),
]


@pytest.mark.parametrize("letters", ["rgba", "RGBA"])
@pytest.mark.parametrize(("layer", "head"), CRYPTOMATTE)
def test_every_bit_of_cryptomatte_is_kept(tmp_path: Path, layer: str, head: dict[str, str], letters: str) -> None:
    values = {f"{layer}.{letter}": bits_of(SHAPE) for letter in letters} | channels("R", "G", "B", "A")
    file = write(tmp_path / "a.exr", (head, values))
    expected = stacked(values, *(f"{layer}.{letter}" for letter in letters))
    found = pg.load(f"{file}:{layer}")
    assert np.array_equal(found.view(np.uint32), expected.view(np.uint32))
    pg.save(tmp_path / "b.exr", found, raw=True)
    pg.save(tmp_path / "c.exr", found, like=f"{file}:{layer}")
    for copy in ("b.exr", "c.exr"):
        with openexr.File(str(tmp_path / copy)) as saved:
            pixels = saved.channels()["RGBA"].pixels
        assert np.array_equal(pixels.view(np.uint32), expected.view(np.uint32))
        assert np.array_equal(pg.load(tmp_path / copy, raw=True).view(np.uint32), expected.view(np.uint32))


def test_a_part_of_cryptomatte(tmp_path: Path) -> None:
    values = {letter: bits_of(SHAPE) for letter in "RGBA"}
    file = write(tmp_path / "a.exr", BEAUTY, ({"name": "crypto_asset00"}, values))
    assert np.array_equal(pg.load(f"{file}:crypto_asset00"), stacked(values, *"RGBA"))


def test_cryptomatte_is_no_picture(tmp_path: Path) -> None:
    values = {f"CryptoObject00.{letter}": bits_of(SHAPE) for letter in "rgba"}
    refused("has no color: its channels are", pg.load, write(tmp_path / "a.exr", ({}, values)))


@pytest.mark.parametrize("letters", ["XYZA", "xyzw", "UVWA"])
def test_layers_without_color_are_read_as_stored(tmp_path: Path, letters: str) -> None:
    values = channels(*(f"N.{letter}" for letter in letters)) | channels("R", "G", "B")
    file = write(tmp_path / "a.exr", ({}, values))
    expected = stacked(values, *(f"N.{letter}" for letter in letters))
    assert np.array_equal(np.sort(pg.load(f"{file}:N"), axis=-1), np.sort(expected, axis=-1))
    assert metadata_of(Path(f"{file}:N")).numbers


def test_a_layer_of_color_is_divided_by_its_alpha_unless_raw(tmp_path: Path) -> None:
    values = channels(*(f"glow.{letter}" for letter in "RGBA")) | channels("R", "G", "B")
    file = write(tmp_path / "a.exr", ({}, values))
    stored = stacked(values, *(f"glow.{letter}" for letter in "RGBA"))
    assert np.array_equal(pg.load(f"{file}:glow", raw=True), stored)
    np.testing.assert_allclose(pg.load(f"{file}:glow")[..., :3], stored[..., :3] / stored[..., 3:], rtol=1e-6)


def test_raw_keeps_every_bit(tmp_path: Path) -> None:
    stored = stacked({letter: bits_of(SHAPE) for letter in "RGBA"}, *"RGBA")
    file = write(tmp_path / "a.exr", ({}, {"RGBA": stored}))
    pg.save(tmp_path / "b.exr", pg.load(file, raw=True), raw=True)
    with openexr.File(str(tmp_path / "b.exr")) as saved:
        assert np.array_equal(saved.channels()["RGBA"].pixels.view(np.uint32), stored.view(np.uint32))


# Alpha of half floats


def half_picture() -> Any:
    """Color with small alpha, and light without any: R = 10 and A = 1e-4 are in a half float's range, R / A is not."""
    stored = np.empty((*SHAPE, 4), np.float16)
    stored[..., :3] = rng.random((*SHAPE, 3)) * 10
    stored[..., 3] = 10.0 ** rng.uniform(-6, 0, SHAPE)
    stored[0, 0] = 10, 10, 10, 1e-4
    stored[1, :, 3] = 0
    return stored


@pytest.fixture
def half(tmp_path: Path) -> tuple[Path, Any]:
    stored = half_picture()
    return write(tmp_path / "half.exr", ({}, {"RGBA": stored.copy()})), stored


def divided(stored: Any) -> Any:
    wide = stored.astype(np.float32)
    return np.dstack([wide[..., :3] / np.where(wide[..., 3:] == 0, 1, wide[..., 3:]), wide[..., 3]])


def test_half_color_is_divided_as_floats(half: tuple[Path, Any]) -> None:
    file, stored = half
    assert np.array_equal(pg.load(file), divided(stored))
    assert np.array_equal(load_stored(file), divided(stored))
    assert np.isfinite(pg.load(file)).all()


def test_tiles_of_half_color_are_divided_as_floats(half: tuple[Path, Any]) -> None:
    from passgraph.tiles.exr import ExrSource

    file, stored = half
    source = ExrSource(file, "frame")
    assert source.dtype == np.float32
    assert np.array_equal(source.read((0, *SHAPE[:1], 0, SHAPE[1])), divided(stored))
    source.close()


@pytest.mark.parametrize("tile", [None, (16, 16)])
def test_half_tiff_with_associated_alpha_is_divided_as_floats(tmp_path: Path, tile: Any) -> None:
    tifffile = pytest.importorskip("tifffile")
    from passgraph.tiles.tiff import TiffSource

    stored = half_picture()
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric="rgb", extrasamples=["assocalpha"], tile=tile)
    assert np.array_equal(pg.load(tmp_path / "a.tif"), divided(stored))
    source = TiffSource(tmp_path / "a.tif", "frame")
    assert np.array_equal(source.read((0, *SHAPE[:1], 0, SHAPE[1])), divided(stored))
    source.close()


def test_half_color_comes_back_exactly(half: tuple[Path, Any], tmp_path: Path) -> None:
    """All of it, with alpha of 0 too, since the other file is OpenEXR."""
    file, stored = half
    pg.save(tmp_path / "b.exr", pg.load(file), like=file, bits=16)
    with openexr.File(str(tmp_path / "b.exr")) as saved:
        assert np.array_equal(saved.channels()["RGBA"].pixels, stored)


def test_half_color_comes_back_exactly_from_tiles(half: tuple[Path, Any], tmp_path: Path) -> None:
    file, stored = half
    same = pg.kernel(source="def same(color: Image) -> vec4: return color[0, 0]")
    pg.tiled(same(pg.Input("frame")), file, tmp_path / "b.exr", dtype="float16", tile=(4, 4), progress=False)
    with openexr.File(str(tmp_path / "b.exr")) as saved:
        assert np.array_equal(saved.channels()["RGBA"].pixels, stored)


# Light without alpha


def apply(*words: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["apply", *words, "--backend", "numpy"])
    assert not ended.value.code


@pytest.mark.parametrize(
    "effect",
    [("gaussian-blur", "--radius-px", "0"), ("gaussian-blur", "--radius-px", "0", "--alpha", "straight"),
     ("gaussian-blur", "--radius-px", "0", "--from-space", "lin_rec709", "--color-config", "ocio://default")],
)  # fmt: skip
@pytest.mark.parametrize("several", [False, True])
def test_effects_keep_light_without_alpha(half: tuple[Path, Any], tmp_path: Path, effect: Any, several: bool) -> None:
    file, stored = half
    output = tmp_path / ("out.%d.exr" if several else "out.exr")
    inputs = [file, write(tmp_path / "other.exr", ({}, {"RGBA": stored.copy()}))] if several else [file]
    apply(effect[0], *map(str, inputs), *effect[1:], "-o", str(output))
    with openexr.File(str(output) % 1 if several else str(output)) as saved:
        np.testing.assert_allclose(saved.channels()["RGBA"].pixels, stored.astype(np.float32), rtol=1e-5, atol=1e-9)


def test_a_blur_mixes_light_without_alpha(tmp_path: Path) -> None:
    """As of stored color: the blur is linear, so it may be computed from it."""
    cv2 = pytest.importorskip("cv2")
    stored = np.zeros((33, 33, 4), np.float32)
    stored[16, 16, :3], stored[8, 8] = (4, 2, 1), (0.5, 0.25, 0.25, 0.5)
    write(tmp_path / "a.exr", ({}, {"RGBA": stored.copy()}))
    apply(
        "gaussian-blur", str(tmp_path / "a.exr"), "--sigma-px", "2", "--radius-px", "8", "-o", str(tmp_path / "b.exr")
    )
    expected = cv2.GaussianBlur(stored, (17, 17), 2, borderType=cv2.BORDER_REPLICATE)
    np.testing.assert_allclose(pg.load(tmp_path / "b.exr", raw=True), expected, atol=1e-6)


def test_colors_of_invisible_pixels_of_other_formats_do_not_become_light(tmp_path: Path) -> None:
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[..., 0], pixels[0, 0, 3] = 255, 255
    pg.save(tmp_path / "a.png", pixels)
    for alpha in ("premultiplied", "straight"):
        words = ("gaussian-blur", str(tmp_path / "a.png"), "--radius-px", "0", "--alpha", alpha)
        apply(*words, "-o", str(tmp_path / "b.exr"))
        stored = pg.load(tmp_path / "b.exr", raw=True)
        assert stored[..., 0].sum() == 1
        assert stored[0, 0].tolist() == [1, 0, 0, 1]


# Cube maps, and channels with fewer samples than pixels


def test_all_faces_of_a_mip_mapped_cube(tmp_path: Path) -> None:
    from passgraph.tiles.exr import ExrSource

    values = {letter: rng.random((96, 16), np.float32) for letter in "RGB"}
    file = tmp_path / "cube.exr"
    file.write_bytes(mip_mapped_cube(values, 16))
    assert np.array_equal(pg.load(file)[..., :3], stacked(values, *"RGB"))
    source = ExrSource(file, "frame")
    assert np.array_equal(source.read((8, 90, 2, 15)), stacked(values, *"RGB")[8:90, 2:15])
    source.close()


@pytest.mark.parametrize("names", ["Y RY BY", "R G B"])
def test_channels_of_fewer_samples_are_named(tmp_path: Path, names: str) -> None:
    first, *others = names.split()
    values = {first: rng.random((8, 8), np.float32)} | {name: rng.random((4, 4), np.float32) for name in others}
    file = tmp_path / "a.exr"
    file.write_bytes(scanlines(values, dict.fromkeys(others, 2)))
    refused(
        r"a\.exr: has channels with fewer samples than pixels, such as luminance and chroma; expected one sample a "
        "pixel; save it as RGB",
        pg.load,
        file,
    )


def test_files_made_by_hand_are_valid(tmp_path: Path) -> None:
    values = {letter: rng.random((8, 8), np.float32) for letter in "RGB"}
    (tmp_path / "a.exr").write_bytes(scanlines(values, {}))
    with openexr.File(str(tmp_path / "a.exr")) as made:
        assert np.array_equal(made.channels()["RGB"].pixels, stacked(values, *"RGB"))
