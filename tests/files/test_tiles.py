"""Tiles: the results are those of the whole picture, bit for bit, whatever the tiles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.ndimage

import passgraph as pg
from passgraph.backends.registry import open_backend
from passgraph.effects.filters.blur import gaussian_blur, gaussian_weights
from tests.files.tile_graphs import GRAPHS, frame, inputs, kernel, picture, same, untiled

SIZE = (41, 29)
#: Divides nothing, smaller than the halo, one row, one column, larger than the picture.
TILES = [(17, 13), (3, 2), (41, 1), (1, 29), (500, 500)]


def in_tiles(graph: Any, given: dict[str, Any], like: Any, **options: Any) -> tuple[Any, Any]:
    result = np.full_like(like, np.nan)
    grid = pg.tiled(graph, given, result, progress=False, **options)
    return result, grid


def needed(graph: pg.Target, given: dict[str, Any]) -> dict[str, Any]:
    with pg.compile(graph, "null") as program:
        return {name: given[name] for name in program.inputs}


@pytest.mark.sampled
@pytest.mark.parametrize("border", ["clamp", "zero", "mirror", "reflect-101"])
@pytest.mark.parametrize("name", GRAPHS)
def test_tiles_are_the_whole_bit_for_bit(name: str, border: str) -> None:
    graph, given = GRAPHS[name](border), inputs(*SIZE)
    expected = untiled(graph, **given)
    for tile in TILES:
        result, grid = in_tiles(graph, needed(graph, given), expected, tile=tile)
        assert same(result, expected), tile
        assert len(grid) == -(-SIZE[0] // grid.core[0]) * -(-SIZE[1] // grid.core[1])


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(1, 1), (40, 1), (1, 40), (2, 33), (33, 3)])
@pytest.mark.parametrize("border", ["clamp", "zero", "mirror", "reflect-101"])
def test_pictures_smaller_than_the_halo(size: tuple[int, int], border: str) -> None:
    graph, given = GRAPHS["deep"](border), inputs(*size)
    expected = untiled(graph, **given)
    for tile in [(1, 1), (7, 2), (64, 64)]:
        assert same(in_tiles(graph, needed(graph, given), expected, tile=tile)[0], expected), tile


def test_all_windows_have_one_shape_and_lie_inside() -> None:
    graph, given = GRAPHS["blur"]("clamp"), inputs(*SIZE)
    _, grid = in_tiles(graph, needed(graph, given), untiled(graph, **given), tile=(16, 8))
    assert (grid.halo.left, grid.halo.right, grid.halo.up, grid.halo.down) == (7, 7, 7, 7)
    assert grid.window == (30, 22)
    seen = np.zeros(SIZE[::-1], int)
    for tile in grid:
        top, bottom, left, right = tile.window
        assert (right - left, bottom - top) == grid.window
        assert 0 <= top < bottom <= SIZE[1]
        assert 0 <= left < right <= SIZE[0]
        seen[tile.core[0] : tile.core[1], tile.core[2] : tile.core[3]] += 1
    assert (seen == 1).all()


def test_one_program_is_compiled_for_all_tiles(monkeypatch: pytest.MonkeyPatch) -> None:
    from passgraph.run.execution import Execution

    made = []
    monkeypatch.setattr("passgraph.tiles.tile_run.Execution", lambda *given: made.append(given) or Execution(*given))
    graph, given = GRAPHS["deep"]("clamp"), inputs(*SIZE)
    _, grid = in_tiles(graph, needed(graph, given), untiled(graph, **given), tile=(7, 5))
    assert len(grid) == 36
    assert len(made) == 1


def test_a_gaussian_in_tiles_is_scipys() -> None:
    """Truth from outside: weights in float64, borders that repeat the last pixel."""
    given = picture(90, 70)
    half = gaussian_weights(2.0, 7)
    weights = np.array([*half[:0:-1], *half])
    expected = given.astype(np.float64)
    for axis in (1, 0):
        expected = scipy.ndimage.correlate1d(expected, weights, axis, mode="nearest")
    graph = gaussian_blur(frame(), sigma_px=2.0, radius_px=7)
    result, _ = in_tiles(graph, {"frame": given}, given, tile=(32, 16))
    assert np.abs(result - expected).max() < 1e-6


# Borders that lead to the other side


@pytest.mark.parametrize("name", ["blur", "deep"])
def test_repeat_takes_tiles_as_large_as_the_picture_where_it_must(name: str) -> None:
    graph, given = GRAPHS[name]("repeat"), inputs(*SIZE)
    expected = untiled(graph, **given)
    result, grid = in_tiles(graph, needed(graph, given), expected, tile=(8, 8))
    assert grid.core == SIZE
    assert same(result, expected)


def test_repeat_along_rows_takes_bands() -> None:
    graph = kernel("soft3")(frame("repeat"), into=pg.target("soft", "rgb32f"))
    given = picture(*SIZE, 3)
    expected = untiled(graph, frame=given)
    result, grid = in_tiles(graph, {"frame": given}, expected, tile=(8, 8))
    assert grid.core == (SIZE[0], 8)
    assert same(result, expected)


def test_repeat_that_does_not_fit_is_refused_with_its_pass() -> None:
    graph, given = GRAPHS["blur"]("repeat"), picture(3000, 2000)
    with pytest.raises(pg.InputError, match="pass 'gaussian_blur_x' reads 'frame' beyond its border by the rule 'rep"):
        pg.tiled(graph, given, np.empty_like(given), memory="200 MB", progress=False)


# What else a graph may have


def test_a_picture_made_of_coordinates_alone() -> None:
    made = kernel("gradient")(into=pg.target("made", "rgba32f", scale=1.0))
    with pg.compile(made, size=SIZE) as program:
        expected = program()["made"]
    result = np.zeros_like(expected)
    pg.tiled(made, None, result, size=SIZE, tile=(16, 16), progress=False)
    assert same(result, expected)


@pytest.mark.parametrize("static", [False, True])
def test_a_table_is_read_whole_by_every_tile(static: bool) -> None:
    table = pg.Input("table", static=static)
    graph = kernel("looked_up")(frame("mirror"), table, into=pg.target("looked", "rgba32f"))
    given = {"frame": picture(*SIZE), "table": picture(16, 1, seed=3)}
    expected = untiled(graph, **given)
    assert same(in_tiles(graph, given, expected, tile=(16, 16))[0], expected)


def test_a_table_may_be_computed_first() -> None:
    """Passes of another size that read nothing of the picture run as they are, coordinates and borders too."""
    table = kernel("placed")(pg.Input("table").border("repeat"), into=pg.target("ready", "rgba32f"), name="ready")
    made = kernel("gradient")(into=pg.target("made", "rgba32f", size=(9, 1)), name="made")
    first = kernel("looked_up")(frame("mirror"), table, into=pg.target("first", "rgba32f"), name="first")
    graph = kernel("looked_up")(first.border("zero"), made, into=pg.target("second", "rgba16f"), name="second")
    given = {"frame": picture(*SIZE), "table": picture(16, 1, seed=3)}
    with pg.compile(graph, size=SIZE) as program:
        expected = program(**given)["second"]
    assert same(in_tiles(graph, given, expected, tile=(16, 16))[0], expected)


def test_a_static_table_may_be_as_large_as_the_picture() -> None:
    graph = kernel("looked_up")(frame(), pg.Input("table", static=True), into=pg.target("looked", "rgba32f"))
    given = {"frame": picture(16, 4), "table": picture(16, 4, seed=3)}
    expected = untiled(graph, **given)
    assert same(in_tiles(graph, given, expected, tile=(5, 2))[0], expected)


def test_static_passes_run_for_every_tile() -> None:
    still = pg.Input("still", static=True)
    graph = kernel("unsharp")(frame(), gaussian_blur(still, 1.0), 0.5, into=pg.target("made", "rgba32f"))
    given = {"frame": picture(*SIZE), "still": picture(*SIZE, seed=4)}
    expected = untiled(graph, **given)
    assert same(in_tiles(graph, given, expected, tile=(16, 16))[0], expected)


def test_several_results_and_values() -> None:
    color = frame()
    soft = gaussian_blur(color, 1.0)
    sharp = kernel("unsharp")(color, soft, pg.Value("amount"), into=pg.target("sharp", "rgba16f"))
    given = picture(*SIZE)
    with pg.compile([soft, sharp]) as program:
        expected = program(frame=given, amount=0.5)
    results = {name: np.zeros_like(given) for name in expected}
    pg.tiled([soft, sharp], given, results, values={"amount": 0.5}, tile=(16, 16), progress=False)
    assert all(same(results[name], expected[name]) for name in expected)


@pytest.mark.parametrize("off", ["cull", "fuse", "order", "alias", "static", "simplify"])
def test_each_optimisation_may_be_off(off: str) -> None:
    graph, given = GRAPHS["deep"]("mirror"), inputs(*SIZE)
    expected = untiled(graph, **given)
    options = pg.Options(**{off: False})
    assert same(in_tiles(graph, needed(graph, given), expected, tile=(16, 16), options=options)[0], expected)


def test_a_program_keeps_its_settings() -> None:
    graph, given = kernel("vignette")(frame(), 0.5, into=pg.target("seen", "rgba32f")), picture(*SIZE)
    with pg.compile(graph) as program:
        program(frame=given)
        program.set("seen", "amount", 0.125)
        expected = program(frame=given)["seen"]
        result = np.zeros_like(expected)
        pg.tiled(program, given, result, tile=(16, 16), progress=False)
        assert same(result, expected)
        assert same(program(frame=given)["seen"], expected)


def test_values_of_the_outputs_size_are_the_whole_pictures() -> None:
    aspect = pg.OUTPUT_SIZE.map(lambda size: size[0] / size[1])
    graph, given = kernel("vignette")(frame(), aspect, into=pg.target("seen", "rgba32f")), picture(*SIZE)
    expected = untiled(graph, frame=given)
    assert same(in_tiles(graph, {"frame": given}, expected, tile=(16, 16))[0], expected)


def test_kernels_made_for_known_sizes_know_the_whole_pictures() -> None:
    text = """def sized(color: Image) -> vec4:
    share = vec2(color.size - pixel()) / vec2(output_size())
    return vec4(share, color[-2, 0].b, 1.0)"""
    graph = pg.kernel(source=text, known_sizes=True)(frame(), into=pg.target("sized", "rgba32f"))
    given = picture(*SIZE)
    expected = untiled(graph, frame=given)
    assert same(in_tiles(graph, {"frame": given}, expected, tile=(16, 16))[0], expected)


def test_a_source_may_be_computed_on_the_same_backend() -> None:
    """The thread that reads ahead needs the backend's turn while tiles are computed."""
    first = gaussian_blur(pg.Input("frame"), 1.0, into=pg.target("first", "rgba32f"))
    second = kernel("sobel")(frame(), into=pg.target("second", "rgba32f"))
    given = picture(*SIZE)
    expected = untiled(second, frame=untiled(first, frame=given))
    with open_backend("numpy") as backend, pg.lazily_tiled(first, given, backend=backend, tile=(16, 16)) as source:
        result, _ = in_tiles(second, {"frame": source}, expected, tile=(16, 16), backend=backend)
    assert same(result, expected)


@pytest.mark.parametrize("backend", ["opencl", "gl"])
def test_other_backends_compute_tiles_too(backend: str) -> None:
    graph, given = kernel("placed")(frame("mirror"), into=pg.target("deep", "rgba16f")), inputs(*SIZE)
    with pg.compile(graph, backend) as program:
        expected = program(frame=given["frame"])["deep"]
    result, _ = in_tiles(graph, {"frame": given["frame"]}, expected, tile=(16, 16), backend=backend)
    assert same(result, expected)


# What the planner decides


@pytest.mark.parametrize("memory", ["70 MB", "100 MB", "1 GB"])
def test_memory_decides_how_large_tiles_are(memory: str) -> None:
    given = np.zeros((1200, 2000, 4), np.uint8)
    graph = gaussian_blur(frame(), 2.0, radius_px=7, into=pg.target("soft", "rgba8"))
    grid = pg.tiled(graph, given, np.zeros_like(given), memory=memory, progress=False)
    assert grid.bytes <= {"70 MB": 70, "100 MB": 100, "1 GB": 1000}[memory] * 10**6
    assert len(grid) >= 2


def test_too_little_memory_says_how_much_it_takes() -> None:
    given = picture(*SIZE)
    with pytest.raises(pg.InputError, match=r"memory of 1 MB is too little: a tile of 1x1 pixels, read with 15x15"):
        pg.tiled(GRAPHS["blur"]("clamp"), given, np.empty_like(given), memory="1 MB", progress=False)


def test_a_picture_may_be_larger_than_any_target() -> None:
    """100,000 pixels wide, of which no array is made."""
    given = np.broadcast_to(picture(1, 3, 4), (3, 100_000, 4))
    graph = kernel("vignette")(gaussian_blur(frame(), 1.0), 0.5, into=pg.target("seen", "rgba32f"))
    result = np.zeros((3, 100_000, 4), np.float32)
    pg.tiled(graph, given, result, tile=(10_000, 3), progress=False)
    x = (np.arange(100_000) + 0.5) / 100_000 - 0.5
    assert np.allclose(result[1, :, 0] / result[1, 50_000, 0], 1.0 - 0.5 * x * x, atol=1e-6)


def test_progress_is_told_after_each_tile() -> None:
    seen: list[tuple[int, int]] = []
    given = picture(20, 10)
    pg.tiled(GRAPHS["sobel"]("clamp"), given, np.empty_like(given), tile=(7, 10),
             progress=lambda done, total: seen.append((done, total)))  # fmt: skip
    assert seen == [(1, 3), (2, 3), (3, 3)]
