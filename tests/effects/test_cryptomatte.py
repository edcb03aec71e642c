"""Cryptomatte: hashes against pairs that Psyop published, mattes against files that the package OpenEXR wrote."""

from __future__ import annotations

import contextlib
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands import main
from passgraph.cryptomatte import Cryptomatte, hash_of, number_of
from passgraph.effects import cryptomatte
from passgraph.errors import GraphError, InputError

openexr = pytest.importorskip("OpenEXR")
rng = np.random.default_rng(2)
#: Names and numbers in the manifests of Psyop's sample images (github.com/Psyop/Cryptomatte, sample_images).
PUBLISHED = {
    "default": 0x42C9679F, "default_111": 0xAD58C73A, "leftAsset": 0xCE406A47, "rightAsset": 0x8F3CCBDE,
    "ball_asset": 0x79B62F5E, "toroidal_asset": 0x1539C043, "name, with, comma": 0x62FA4DB8, "равнина": 0x9623511E,
    'name containing a "quote"  ': 0xAF8BFA09, "name_containing/slash": 0xB0A04231, "/obj/box:polygons:1": 0x9D416418,
    "/shop/mat3/standard_surface1": 0x0247C000,
}  # fmt: skip
NAMES = ("ball", "ball_2", "floor", "sky")
BACKENDS = [
    "numpy",
    "reference",
    pytest.param("gl", marks=pytest.mark.gl),
    pytest.param("opencl", marks=pytest.mark.opencl),
    pytest.param("webgpu", marks=pytest.mark.webgpu),
]


@pytest.mark.parametrize(("name", "number"), PUBLISHED.items())
def test_published_numbers(name: str, number: int) -> None:
    assert hash_of(name) == number
    assert struct.pack("<f", number_of(name)) == struct.pack("<I", number)


def test_no_number_is_nan_infinite_or_tiny() -> None:
    """In one of 128 hashes the exponent is 0 or 255 before one bit is flipped."""
    bits = np.array([hash_of(f"object {i}") for i in range(20_000)], np.uint32)
    exponents = bits >> 23 & 255
    assert exponents.min() == 1
    assert exponents.max() == 254


def coverages(shape: tuple[int, int], count: int = 6) -> tuple[Any, Any]:
    """Numbers and coverages by rank, (rank, height, width): the largest first, together 1."""
    objects = np.array([hash_of(name) for name in NAMES], np.uint32)
    shares = rng.dirichlet([0.5] * len(NAMES), shape).astype(np.float32)
    shares[shares < 0.05] = 0
    order = np.argsort(-shares, axis=-1)
    ranked = np.take_along_axis(shares, order, axis=-1).transpose(2, 0, 1)
    numbers = np.where(ranked > 0, objects[order].transpose(2, 0, 1), 0).astype(np.uint32)
    empty = [(0, count - len(NAMES)), (0, 0), (0, 0)]
    return np.pad(numbers, empty), np.pad(ranked, empty)


def written(
    path: Path, name: str = "crypto_object", manifest: str | None = None, parts: bool = False, long: bool = False,
    **more: str,
) -> tuple[Any, Any]:  # fmt: skip
    numbers, shares = coverages((12, 17))
    words = ("red", "green", "blue", "alpha") if long else "RGBA"
    layers: dict[str, Any] = {}
    for layer in range(3):
        for place in range(2):
            rank = 2 * layer + place
            layers[f"{name}{layer:02}.{words[2 * place]}"] = numbers[rank].view(np.float32).copy()
            layers[f"{name}{layer:02}.{words[2 * place + 1]}"] = shares[rank].copy()
    text = json.dumps({n: f"{hash_of(n):08x}" for n in NAMES}) if manifest is None else manifest
    key = f"cryptomatte/{hash_of(name):08x}"[:-1]
    header = {f"{key}/name": name, f"{key}/hash": "MurmurHash3_32", f"{key}/conversion": "uint32_to_float32"}
    header |= {f"{key}/manifest": text} if text else {}
    header |= {f"{key}/{n}": value for n, value in more.items()}
    color = {letter: rng.random((12, 17), np.float32) for letter in "RGB"}
    if not parts:
        openexr.File(dict(header), color | layers).write(str(path))
        return numbers, shares
    made = [openexr.Part(dict(header), color, "rgba")]
    for layer in range(3):
        one = {n.rpartition(".")[2]: a for n, a in layers.items() if n.startswith(f"{name}{layer:02}")}
        made.append(openexr.Part({}, one, f"{name}{layer:02}"))
    openexr.File(made).write(str(path))
    return numbers, shares


def expected(numbers: Any, shares: Any, names: tuple[str, ...]) -> Any:
    """By the bits of the numbers, in float64."""
    wanted = np.array([hash_of(name) for name in names], np.uint32)
    return np.where(np.isin(numbers, wanted), shares.astype(float), 0).sum(axis=0)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("names", [("ball",), ("ball*",), ("ball", "sky"), ("*",)])
def test_mattes(tmp_path: Path, backend: str, names: tuple[str, ...]) -> None:
    numbers, shares = written(tmp_path / "shot.exr")
    shot = Cryptomatte.load(tmp_path / "shot.exr")
    found = tuple({"*": NAMES, "ball*": NAMES[:2]}.get(names[0], names))
    with pg.compile(cryptomatte([pg.Input(one) for one in shot.layers], shot.find(names)), backend=backend) as program:
        matte = program(**shot.ranks())["matte"]
    assert matte.shape == (12, 17, 1)
    np.testing.assert_allclose(matte[..., 0], expected(numbers, shares, found), atol=2e-7)


@pytest.mark.parametrize("backend", BACKENDS)
def test_many_objects(backend: str) -> None:
    """A number that lies between two others is none of them."""
    many = np.sort(rng.permutation(np.array([hash_of(f"o{i}") for i in range(3000)], np.uint32))).view(np.float32)
    pairs = np.zeros((30, 100, 4), np.float32)
    pairs[..., 0], pairs[..., 1] = many.reshape(30, 100), 0.75
    pairs[..., 2], pairs[..., 3] = np.nextafter(pairs[..., 0], np.float32(np.inf)), 0.25
    chosen = many[::2]
    with pg.compile(cryptomatte([pg.Input("ranks")], chosen), backend=backend) as program:
        matte = program(ranks=pairs)["matte"][..., 0]
    assert np.array_equal(matte, np.where(np.isin(pairs[..., 0], chosen), np.float32(0.75), np.float32(0)))


@pytest.mark.parametrize("how", [{"parts": True}, {"long": True}, {"name": "ViewLayer.CryptoObject"}])
def test_ways_of_renderers(tmp_path: Path, how: dict[str, Any]) -> None:
    """Layers as parts, channels by long names, and names with a dot, as of Blender."""
    numbers, shares = written(tmp_path / "shot.exr", **how)
    assert apply("shot.exr", "--name", "floor", "-o", "matte.exr", folder=tmp_path) == 0
    np.testing.assert_allclose(
        pg.load(tmp_path / "matte.exr")[..., 0], expected(numbers, shares, ("floor",)), atol=2e-7
    )


def apply(*words: str, folder: Path) -> int:
    with contextlib.chdir(folder), pytest.raises(SystemExit) as ended:
        main(["apply", "cryptomatte", *words])
    return int(ended.value.code or 0)


def test_names_in_a_file_beside(tmp_path: Path) -> None:
    (tmp_path / "names.json").write_text(json.dumps({"ball": f"{hash_of('ball'):08x}"}))
    written(tmp_path / "shot.exr", manifest="", manif_file="names.json")
    assert list(Cryptomatte.load(tmp_path / "shot.exr").numbers) == ["ball"]


def test_without_names_they_are_hashed(tmp_path: Path) -> None:
    numbers, shares = written(tmp_path / "shot.exr", manifest="")
    assert apply("shot.exr", "--name", "sky", "-o", "matte.exr", folder=tmp_path) == 0
    np.testing.assert_allclose(pg.load(tmp_path / "matte.exr")[..., 0], expected(numbers, shares, ("sky",)), atol=2e-7)
    with pytest.raises(InputError, match="the file does not list names, so give them in full"):
        Cryptomatte.load(tmp_path / "shot.exr").find(["s*"])


def test_an_object_by_a_pixel(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    numbers, shares = written(tmp_path / "shot.exr")
    top = next(name for name in NAMES if hash_of(name) == numbers[0, 3, 5])
    shot = Cryptomatte.load(tmp_path / "shot.exr")
    assert shot.name_of(shot.pick(5, 3)) == top
    assert apply("shot.exr", "--pick", "5,3", "-o", "matte.png", folder=tmp_path) == 0
    np.testing.assert_allclose(
        pg.load(tmp_path / "matte.png")[..., 0], expected(numbers, shares, (top,)), atol=0.5 / 255 + 1e-6
    )
    assert apply("shot.exr", "--pick", "17,3", "-o", "matte.png", folder=tmp_path) == 2
    assert "has 17×12 pixels, and (17, 3) is none of them" in capsys.readouterr().err
    assert apply("shot.exr", "--pick", "x", "-o", "matte.png", folder=tmp_path) == 2
    assert "expected X,Y in pixels from the top left, such as 640,360" in capsys.readouterr().err


def test_the_matte_becomes_a_layer_of_its_shot(tmp_path: Path) -> None:
    numbers, shares = written(tmp_path / "shot.exr")
    assert apply("shot.exr", "--name", "ball", "-o", "out.exr:matte", folder=tmp_path) == 0
    with (
        openexr.File(str(tmp_path / "shot.exr"), separate_channels=True) as old,
        openexr.File(str(tmp_path / "out.exr"), separate_channels=True) as new,
    ):
        found = {name: channel.pixels for name, channel in new.channels().items()}
        assert all(channel.pixels.tobytes() == found.pop(name).tobytes() for name, channel in old.channels().items())
        assert list(found) == ["matte.Y"]
        np.testing.assert_allclose(found["matte.Y"], expected(numbers, shares, ("ball",)), atol=2e-7)
        assert Cryptomatte.load(tmp_path / "out.exr").numbers


@pytest.mark.parametrize("inputs", ["shot.####.exr", "shot.*.exr", "."])
def test_sequences(tmp_path: Path, inputs: str) -> None:
    """Objects may show in later frames only, and be listed there."""
    shots = {}
    for number in (1, 2, 3):
        listed = {name: f"{hash_of(name):08x}" for name in NAMES[: number + 1]}
        shots[number] = written(tmp_path / f"shot.{number:04}.exr", manifest=json.dumps(listed))
    assert apply(inputs, "--name", "sky", "--name", "b*", "-o", "out/", folder=tmp_path) == 0
    for number, (numbers, shares) in shots.items():
        matte = pg.load(tmp_path / "out" / f"shot.{number:04}.exr")[..., 0]
        np.testing.assert_allclose(matte, expected(numbers, shares, ("sky", "ball", "ball_2")), atol=2e-7)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("shot.exr",), "which objects of crypto_object? Give --name NAME or --pick X,Y; it has ball, ball_2, floor"),
        (("shot.exr", "--name", "bell"), "crypto_object has no object 'bell'; it has ball, ball_2, floor, sky"),
        (("shot.exr", "--name", "x", "--cryptomatte", "y"), "has no Cryptomatte 'y'; it has crypto_object"),
        (("plain.exr", "--name", "x"), "has no Cryptomatte; expected attributes cryptomatte/.../name"),
        (("photo.png", "--name", "x"), "Cryptomattes are in OpenEXR files (.exr)"),
        (("shot.exr", "plain.exr", "--name", "x"), "cryptomatte reads one INPUT"),
        (("outside.exr", "--name", "x"), "its list of names '../names.json' is not beside it"),
        (("damaged.exr", "--name", "x"), "the list of names is damaged"),
        (("other.exr", "--name", "x"), "has the hash 'md5'; expected 'MurmurHash3_32'"),
    ],
)
def test_mistakes(tmp_path: Path, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    written(tmp_path / "shot.exr")
    written(tmp_path / "outside.exr", manifest="", manif_file="../names.json")
    written(tmp_path / "damaged.exr", manifest='{"a": "none"}')
    written(tmp_path / "other.exr", hash="md5")
    pg.save(tmp_path / "plain.exr", np.zeros((2, 2)))
    pg.save(tmp_path / "photo.png", np.zeros((2, 2)))
    assert apply(*words, "-o", "matte.exr", folder=tmp_path) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(("ranks", "numbers"), [([], [1.0]), (["x"], [1.0]), (None, []), (None, [np.nan])])
def test_refused_arguments(ranks: Any, numbers: list[float]) -> None:
    with pytest.raises(GraphError, match=r"cryptomatte: (ranks|numbers) must be"):
        cryptomatte([pg.Input("ranks")] if ranks is None else ranks, numbers)
