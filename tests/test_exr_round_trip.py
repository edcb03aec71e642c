"""Layers, parts, windows and attributes of OpenEXR files from input to output, as OpenEXR and OpenImageIO read them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands import main
from passgraph.errors import InputError

openexr = pytest.importorskip("OpenEXR")
oiio = pytest.importorskip("OpenImageIO")
rng = np.random.default_rng(9)

SAME = ("gaussian-blur", "--radius-px", "0")
QUARTER = ("brightness-contrast", "--brightness", "0.25")
TYPES = {"R": "f2", "G": "f2", "B": "f2", "A": "f2", "Z": "f4", "id": "u4", "N.X": "f2", "N.Y": "f2", "N.Z": "f2"}


def apply(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["apply", *map(str, words)])
    return int(ended.value.code or 0)


def numbers(dtype: str, shape: tuple[int, int]) -> Any:
    """Random bits that are no NaN in half floats and below 1; in Z every bit pattern may be."""
    if dtype == "u4":
        return rng.integers(0, 2**32, shape, np.uint32)
    return rng.random(shape).astype(dtype)


def layered(path: Path, size: tuple[int, int] = (40, 300), **header: Any) -> dict[str, Any]:
    """A file of half floats, floats and integers, one NaN with a payload and ids as floats among them."""
    channels = {name: numbers(dtype, size[::-1]) for name, dtype in TYPES.items()}
    channels["A"][:] = 1
    channels["Z"].view(np.uint32)[0, :3] = 0x7F800001, 0x80000000, 0x00000001
    for name in ("crypto00.R", "crypto00.G", "crypto00.B", "crypto00.A"):
        channels[name] = rng.integers(0, 2**32, size[::-1], np.uint32).view(np.float32)
    openexr.File({"compression": openexr.ZIP_COMPRESSION} | header, dict(channels)).write(str(path))
    return channels


def stored(path: Path, part: int = 0) -> tuple[dict[str, Any], dict[str, Any]]:
    """Header and channels as the package OpenEXR reads them."""
    with openexr.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.parts[part].channels.items()}
        return dict(file.parts[part].header), channels


def same_bits(channels: dict[str, Any], expected: dict[str, Any], names: Any) -> bool:
    return all(channels[n].dtype == expected[n].dtype and channels[n].tobytes() == expected[n].tobytes() for n in names)


@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ"])
def test_other_channels_keep_their_bits(tmp_path: Path, compression: str) -> None:
    channels = layered(tmp_path / "in.exr", compression=getattr(openexr, f"{compression}_COMPRESSION"))
    assert apply(*QUARTER, tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    _, found = stored(tmp_path / "out.exr")
    assert set(found) == set(channels)
    assert same_bits(found, channels, set(channels) - set("RGB"))
    for name in "RGB":
        assert found[name].dtype == np.float16
        np.testing.assert_allclose(found[name], channels[name].astype(float) * 0.25, rtol=1e-3, atol=1e-7)


def test_a_half_file_does_not_grow(tmp_path: Path) -> None:
    layered(tmp_path / "in.exr")
    assert apply(*SAME, tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    assert (tmp_path / "out.exr").stat().st_size <= 1.02 * (tmp_path / "in.exr").stat().st_size


def test_openimageio_reads_it(tmp_path: Path) -> None:
    channels = layered(tmp_path / "in.exr")
    assert apply(*QUARTER, tmp_path / "in.exr", "-o", f"{tmp_path}/out.exr:comp") == 0
    file = oiio.ImageInput.open(str(tmp_path / "out.exr"))
    names = file.spec().channelnames
    for index, name in enumerate(names):
        kind = str(file.spec().channelformat(index))
        values = file.read_image(0, 0, index, index + 1, kind)[..., 0]
        if name in channels:
            assert values.tobytes() == channels[name].tobytes()
        else:
            assert (name[:5], kind) == ("comp.", "half")
    assert len(names) == len(channels) + 4
    file.close()


def test_the_result_becomes_a_layer(tmp_path: Path) -> None:
    channels = layered(tmp_path / "in.exr")
    assert apply(*QUARTER, tmp_path / "in.exr", "-o", f"{tmp_path}/out.exr:comp") == 0
    _, found = stored(tmp_path / "out.exr")
    assert set(found) - set(channels) == {f"comp.{letter}" for letter in "RGBA"}
    assert same_bits(found, channels, channels)
    assert found["comp.R"].dtype == np.float16
    brighter = pg.load(tmp_path / "out.exr", layer="comp")
    np.testing.assert_allclose(brighter[..., :3], pg.load(tmp_path / "in.exr")[..., :3] * 0.25, rtol=1e-3, atol=1e-7)
    # Again, into a layer that is there.
    assert apply(*QUARTER, f"{tmp_path}/out.exr:comp", "-o", f"{tmp_path}/again.exr:comp") == 0
    _, again = stored(tmp_path / "again.exr")
    assert set(again) == set(found)
    np.testing.assert_allclose(
        pg.load(tmp_path / "again.exr:comp")[..., :3], brighter[..., :3] * 0.25, rtol=1e-3, atol=1e-7
    )
    assert same_bits(again, channels, channels)


def test_a_picture_in_another_format_becomes_a_layer(tmp_path: Path) -> None:
    pg.save(tmp_path / "in.png", np.full((4, 6, 3), 51, np.uint8))
    assert apply(*SAME, tmp_path / "in.png", "-o", f"{tmp_path}/out.exr:comp") == 0
    _, found = stored(tmp_path / "out.exr")
    assert set(found) == {"comp.R", "comp.G", "comp.B"}
    np.testing.assert_allclose(found["comp.R"], 0.2, rtol=1e-6)


def test_layers_are_dropped_when_asked(tmp_path: Path) -> None:
    layered(tmp_path / "in.exr")
    assert apply(*SAME, tmp_path / "in.exr", "-o", tmp_path / "out.exr", "--drop-layers") == 0
    _, found = stored(tmp_path / "out.exr")
    assert set(found) == set("RGBA")
    assert found["R"].dtype == np.float16


@pytest.mark.parametrize(("bits", "dtype"), [("16", "f2"), ("32", "f4")])
def test_bits_of_the_result_alone(tmp_path: Path, bits: str, dtype: str) -> None:
    channels = layered(tmp_path / "in.exr")
    assert apply(*SAME, tmp_path / "in.exr", "-o", tmp_path / "out.exr", "--bits", bits) == 0
    _, found = stored(tmp_path / "out.exr")
    assert found["R"].dtype == np.dtype(dtype)
    assert same_bits(found, channels, set(channels) - set("RGBA"))


def windows(data: tuple[int, ...], display: tuple[int, ...]) -> dict[str, Any]:
    boxes = {"dataWindow": data, "displayWindow": display}
    return {name: (np.int32(box[:2]), np.int32(box[2:])) for name, box in boxes.items()}


def test_attributes_are_kept(tmp_path: Path) -> None:
    """Also those of types that no Python package writes: bytes of the header are compared."""
    source = tmp_path / "in.exr"
    spec = oiio.ImageSpec(20, 10, 4, "half")
    spec.attribute("smpte:TimeCode", "timecode", (0x01020304, 0x11223344))
    spec.attribute("chromaticities", "float[8]", (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767))
    spec.attribute("capDate", "2024:05:06 07:08:09")
    spec.attribute("worldToCamera", "matrix", tuple(range(16)))
    spec.attribute("cryptomatte/1234567/manifest", '{"a": "00000001"}')
    spec.attribute("compression", "zip")
    file = oiio.ImageOutput.create(str(source))
    assert file.open(str(source), spec)
    assert file.write_image(rng.random((10, 20, 4), np.float32))
    file.close()
    assert apply(*SAME, source, "-o", tmp_path / "out.exr") == 0
    old, new = ((tmp_path / name).read_bytes() for name in ("in.exr", "out.exr"))
    for name in (b"timeCode", b"chromaticities", b"capDate", b"worldToCamera", b"cryptomatte/1234567/manifest"):
        start = old.index(name + b"\0")
        length = 120
        assert old[start : start + length].split(b"\0")[0] == name
        value = start + len(name) + 1
        kind_end = old.index(b"\0", value) + 1
        size = int.from_bytes(old[kind_end : kind_end + 4], "little")
        assert old[start : kind_end + 4 + size] in new


@pytest.mark.parametrize("data", [(-8, -6, 47, 35), (4, 3, 20, 9), (30, -6, 60, 9)])
def test_windows_are_kept(tmp_path: Path, data: tuple[int, ...]) -> None:
    """Overscan, a crop, and both: nothing that is stored is lost, and an effect that changes nothing changes no bit."""
    size = data[2] - data[0] + 1, data[3] - data[1] + 1
    channels = layered(tmp_path / "in.exr", size, **windows(data, (0, 0, 39, 29)))
    assert apply(*SAME, tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    header, found = stored(tmp_path / "out.exr")
    assert [box.tolist() for box in header["dataWindow"]] == [list(data[:2]), list(data[2:])]
    assert [box.tolist() for box in header["displayWindow"]] == [[0, 0], [39, 29]]
    assert same_bits(found, channels, channels)


def test_effects_read_and_write_the_overscan(tmp_path: Path) -> None:
    channels = layered(tmp_path / "in.exr", (56, 42), **windows((-8, -6, 47, 35), (0, 0, 39, 29)))
    blur = ("gaussian-blur", "--radius-px", "3")
    assert apply(*blur, tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    plain = np.stack([channels[letter].astype(np.float32) for letter in "RGBA"], axis=-1)
    pg.save(tmp_path / "plain.exr", plain)
    assert apply(*blur, tmp_path / "plain.exr", "-o", tmp_path / "expected.exr", "--bits", "16") == 0
    _, found = stored(tmp_path / "out.exr")
    _, expected = stored(tmp_path / "expected.exr")
    assert same_bits(found, {**channels, **{n: expected.get(n, channels["A"]) for n in "RGB"}}, "RGB")
    assert pg.load(tmp_path / "in.exr").shape == (30, 40, 4)
    assert pg.load(tmp_path / "in.exr", overscan=True).shape == (42, 56, 4)


@pytest.mark.parametrize("many", [False, True])
def test_a_further_picture_without_overscan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], many: bool
) -> None:
    """The display window is computed as without overscan, and what lies outside of it stays."""
    monkeypatch.chdir(tmp_path)
    channels = layered(Path("in.1.exr"), (56, 42), **windows((-8, -6, 47, 35), (0, 0, 39, 29)))
    pg.save("z.1.exr", rng.random((30, 40), np.float32))
    words = ("in.#.exr", "--depth", "z.#.exr") if many else ("in.1.exr", "--depth", "z.1.exr")
    fog = ("fog", "--density", "0.5", *words)
    assert apply(*fog, "-o", "out.#.exr" if many else "out.1.exr") == 0
    assert "z.1.exr: has no overscan as in.1.exr has" in capsys.readouterr().err
    assert apply(*fog, "-o", "plain.#.exr" if many else "plain.1.exr", "--drop-layers") == 0
    _, found = stored(Path("out.1.exr"))
    np.testing.assert_array_equal(pg.load("out.1.exr"), pg.load("plain.1.exr"))
    assert same_bits({"R": found["R"][:6]}, {"R": channels["R"][:6]}, "R")
    # One that has it is read with it.
    assert apply("fog", words[0], "--depth", f"{words[0]}:N.X", "-o", "own.#.exr" if many else "own.1.exr") == 0
    assert not np.array_equal(stored(Path("own.1.exr"))[1]["R"][:6], channels["R"][:6])


def test_light_that_leaves_a_crop_is_kept(tmp_path: Path) -> None:
    """A blur brings light out of the data window, which grows; elsewhere other channels are 0, as readers take them."""
    channels = layered(tmp_path / "in.exr", (17, 7), **windows((4, 3, 20, 9), (0, 0, 39, 29)))
    assert apply("gaussian-blur", "--radius-px", "2", tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    header, found = stored(tmp_path / "out.exr")
    assert [box.tolist() for box in header["dataWindow"]] == [[0, 0], [39, 29]]
    assert found["R"][2, 4:21].all()
    inner = {name: values[3:10, 4:21] for name, values in found.items()}
    assert same_bits(inner, channels, ("Z", "id", "N.X", "crypto00.R"))
    assert not any(values[0].any() or values[-1].any() for name, values in found.items() if name not in "RGBA")


def parts_of(path: Path) -> dict[str, Any]:
    """Color, a tiled part, a part of lossy compression and one of deep samples."""
    shape = 30, 40
    color = {letter: numbers("f2", shape) for letter in "RGB"}
    depth = {"Z": numbers("f4", shape)}
    lossy = {letter: numbers("f2", shape) for letter in "RGB"}
    tiles = openexr.TileDescription()
    tiles.xSize = tiles.ySize = 16
    parts = [
        openexr.Part({"compression": openexr.PIZ_COMPRESSION}, dict(color), "rgba"),
        openexr.Part({"type": openexr.tiledimage, "tiles": tiles}, dict(depth), "depth"),
        openexr.Part({"compression": openexr.DWAA_COMPRESSION}, lossy, "diffuse"),
    ]
    openexr.File(parts).write(str(path))
    return color


def test_other_parts_are_copied(tmp_path: Path) -> None:
    """Not decoded: what DWA has lost already is not lost again, and tiles stay tiles."""
    color = parts_of(tmp_path / "in.exr")
    assert apply(*QUARTER, tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    for part in (1, 2):
        header, found = stored(tmp_path / "out.exr", part)
        old_header, old = stored(tmp_path / "in.exr", part)
        assert same_bits(found, old, old)
        assert [str(header[name]) for name in ("type", "compression", "name")] == [
            str(old_header[name]) for name in ("type", "compression", "name")
        ]
    _, found = stored(tmp_path / "out.exr")
    np.testing.assert_allclose(found["R"], color["R"].astype(float) * 0.25, rtol=1e-3, atol=1e-7)


def test_a_part_by_name_is_replaced(tmp_path: Path) -> None:
    color = parts_of(tmp_path / "in.exr")
    assert apply(*QUARTER, f"{tmp_path}/in.exr:diffuse", "-o", f"{tmp_path}/out.exr:diffuse") == 0
    assert same_bits(stored(tmp_path / "out.exr")[1], color, color)
    was, now = (pg.load(tmp_path / f"{name}.exr", layer="diffuse") for name in ("in", "out"))
    np.testing.assert_allclose(now[..., :3], was[..., :3] * 0.25, rtol=1e-3, atol=1e-7)
    assert stored(tmp_path / "out.exr", 1)[0]["type"] == openexr.tiledimage


def test_deep_parts_pass_through(tmp_path: Path) -> None:
    samples = {name: np.empty((6, 8), object) for name in "AZ"}
    for y, x in np.ndindex(6, 8):
        for name in "AZ":
            samples[name][y, x] = rng.random((x + y) % 3, np.float32) if (x + y) % 3 else None
    color = openexr.Part({}, {letter: numbers("f2", (6, 8)) for letter in "RGB"}, "rgba")
    how = {"type": openexr.deepscanline, "compression": openexr.ZIPS_COMPRESSION}
    openexr.File([color, openexr.Part(how, dict(samples), "samples")]).write(str(tmp_path / "in.exr"))
    assert apply(*QUARTER, tmp_path / "in.exr", "-o", tmp_path / "out.exr") == 0
    header, found = stored(tmp_path / "out.exr", 1)
    assert header["type"] == openexr.deepscanline
    for name, y, x in ((name, *place) for name in "AZ" for place in np.ndindex(6, 8)):
        assert np.array_equal(found[name][y, x], samples[name][y, x])
    assert apply(*QUARTER, f"{tmp_path}/in.exr:samples", "-o", tmp_path / "out.exr") == 2


@pytest.mark.parametrize("output", ["out.####.exr", "out/", "out.####.exr:comp"])
def test_sequences(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str) -> None:
    monkeypatch.chdir(tmp_path)
    shots = {number: layered(Path(f"shot.{number:04d}.exr")) for number in (7, 8, 9)}
    assert apply(*QUARTER, "shot.####.exr", "-o", output) == 0
    for number, channels in shots.items():
        name = f"out/shot.{number:04d}.exr" if output == "out/" else f"out.{number:04d}.exr"
        _, found = stored(Path(name))
        assert same_bits(found, channels, set(channels) - set("RGB"))
        changed = "comp.R" if "comp" in output else "R"
        np.testing.assert_allclose(found[changed], channels["R"].astype(float) * 0.25, rtol=1e-3, atol=1e-7)


@pytest.mark.parametrize("many", [False, True])
def test_a_result_of_another_size_is_stored_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], many: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    for number in (1, 2):
        layered(Path(f"shot.{number}.exr"))
    words = ("shot.#.exr", "-o", "out.#.exr") if many else ("shot.1.exr", "-o", "out.1.exr")
    assert apply("resize", "--scale", "0.5", *words) == 0
    said = capsys.readouterr().err
    assert "out.1.exr: has another size than its input" in said
    assert said.count("warning") == 1
    assert set(stored(Path("out.1.exr"))[1]) == set("RGBA")


def test_color_tags_of_a_converted_result(tmp_path: Path) -> None:
    """The color that is replaced has tags of its own; those of a layer are the file's."""
    layered(tmp_path / "in.exr", chromaticities=(0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767))
    space = ("--from-space", "ACEScg", "--to-space", "Linear Rec.709 (sRGB)")
    assert apply(*SAME, tmp_path / "in.exr", *space, "-o", tmp_path / "out.exr") == 0
    np.testing.assert_allclose(stored(tmp_path / "out.exr")[0]["chromaticities"][:2], (0.64, 0.33), rtol=1e-6)
    assert apply(*SAME, tmp_path / "in.exr", *space, "-o", f"{tmp_path}/out.exr:comp") == 0
    np.testing.assert_allclose(stored(tmp_path / "out.exr")[0]["chromaticities"][:2], (0.713, 0.293), rtol=1e-6)


def test_saved_in_python(tmp_path: Path) -> None:
    channels = layered(tmp_path / "in.exr")
    picture = pg.load(tmp_path / "in.exr")
    pg.save(tmp_path / "out.exr:comp", picture, layers_of=tmp_path / "in.exr")
    _, found = stored(tmp_path / "out.exr")
    assert same_bits(found, channels, channels)
    # Into a file that is there, which is replaced when the new one is complete.
    pg.save(tmp_path / "out.exr:matte", picture[..., 0], layers_of=tmp_path / "out.exr")
    _, found = stored(tmp_path / "out.exr")
    assert same_bits(found, channels, channels)
    assert {"comp.R", "matte.Y"} < set(found)
    pg.save(tmp_path / "out.exr:Z", picture[..., 0], layers_of=tmp_path / "out.exr")
    assert stored(tmp_path / "out.exr")[1]["Z"].tobytes() == picture[..., 0].tobytes()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        pg.save(tmp_path / "small.exr", picture[::2, ::2], layers_of=tmp_path / "in.exr")
    assert "small.exr: is 20×150 pixels, and" in str(said[0].message)
    assert set(stored(tmp_path / "small.exr")[1]) == set("RGBA")


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("out.exr:Z", {"layers_of": "in.exr"}, r"Z is one channel, and the picture has colors; expected gray"),
        ("out.png", {"layers_of": "in.exr"}, r"out\.png: PNG has no layers; save as \.exr"),
        ("out.exr", {"layers_of": "in.png"}, r"layers_of must be an OpenEXR file \(\.exr\), got in\.png"),
        ("out.exr", {"layers_of": "none.exr"}, r"none\.exr: no such file"),
        ("out.exr", {"layers_of": "cut.exr"}, r"cut\.exr: truncated or corrupt"),
    ],
)
def test_saves_that_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, settings: dict[str, Any], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    layered(Path("in.exr"))
    content = Path("in.exr").read_bytes()
    Path("cut.exr").write_bytes(content[: len(content) // 2])
    pg.save("in.png", np.zeros((4, 4)))
    with pytest.raises(InputError, match=said):
        pg.save(name, rng.random((300, 40, 4)), **settings)
    assert not Path(name).exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".passgraph")]


def test_32_bits_are_for_floats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    layered(tmp_path / "in.exr")
    for output in ("out.tif", "out.#.tif"):
        assert apply(*SAME, tmp_path / "in.exr", "-o", tmp_path / output, "--bits", "32") == 2
        assert "--bits 32 is for floats (.exr .npy .hdr .pfm); give 8 or 16, or write those" in capsys.readouterr().err


def test_a_layer_in_a_format_without(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    layered(tmp_path / "in.exr")
    assert apply(*SAME, tmp_path / "in.exr", "-o", f"{tmp_path}/out.jpg:comp") == 2
    assert "has no layers" in capsys.readouterr().err


def test_workers_of_a_cluster_keep_layers(tmp_path: Path) -> None:
    """A worker reads the file with its overscan, and writes the copy."""
    distributed = pytest.importorskip("distributed")
    from passgraph.files import Pictures, ToPictures

    channels = layered(tmp_path / "in.exr", (56, 42), **windows((-8, -6, 47, 35), (0, 0, 39, 29)))
    half = pg.kernel(source="def half(c: Image) -> vec4: return vec4(c[0, 0].rgb * 0.5, c[0, 0].a)")
    sink = ToPictures({1: tmp_path / "out.exr"}, keep_layers=True, layer="comp")
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None)
    with (
        cluster,
        distributed.Client(cluster) as client,
        pg.compile(half(pg.Input("frame")), backend="numpy") as program,
    ):
        summary = pg.frames(program, Pictures({1: tmp_path / "in.exr"}, overscan=True), sink, client=client)
    assert (summary.written, summary.failed) == (1, ())
    _, found = stored(tmp_path / "out.exr")
    assert same_bits(found, channels, channels)
    np.testing.assert_allclose(found["comp.R"], channels["R"].astype(float) / 2, rtol=1e-3, atol=1e-7)
