"""Color transforms against OpenColorIO's lossless CPU processor, which shares no code with the translated shader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest

import passgraph as pg
from passgraph.effects import color_transform, gaussian_blur
from passgraph.errors import GraphError
from passgraph.shaders.containers.ocio import read_processor
from tests.conftest import require

CG = "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
STUDIO = "ocio://studio-config-v4.0.0_aces-v2.0_ocio-v2.5"
ACES1 = "ocio://studio-config-v2.2.0_aces-v1.3_ocio-v2.4"
FRAME = pg.Input("frame")
rng = np.random.default_rng(1)
#: Code values, for what is encoded; scene-linear light with negative and bright values, for what is not.
CODES = rng.random((24, 32, 4), np.float32)
LIGHT = np.concatenate([rng.random((16, 32, 4)), rng.random((8, 32, 4)) * 8 - 0.5]).astype(np.float32)
#: Relative to 1 + |x|.
CLOSE = 1e-5
#: Where one step of float32 is worth more than that (inverse gamut mapping, film densities), no result in float32 is
#: closer: ours may be this many times as far from the shader's exact meaning as OpenColorIO's own is.
TIMES_AS_FAR = 20.0


def shown(config: str, transform: Any, picture: np.ndarray, inverse: bool = False) -> np.ndarray:
    way = ocio.TRANSFORM_DIR_INVERSE if inverse else ocio.TRANSFORM_DIR_FORWARD
    processor = ocio.Config.CreateFromFile(config).getProcessor(transform, way)
    made = picture.copy()
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGBA(made)
    return made


def ran(target: pg.Target, picture: np.ndarray, backend: str = "numpy") -> np.ndarray:
    with pg.compile({"result": target}, backend=backend) as program:
        return np.array(program(frame=picture)["result"])


def apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.max(np.abs(a - b) / (1 + np.abs(b))))


def check_agrees(target: pg.Target, expected: np.ndarray, picture: np.ndarray) -> None:
    found = ran(target, picture)
    assert np.isfinite(found).all()
    if apart(found, expected) > CLOSE:
        exact = ran(target, picture, "reference")
        assert apart(found, exact) <= TIMES_AS_FAR * apart(expected, exact)


SPACES = ["ACEScct", "ARRI LogC3 (EI800)", "sRGB Encoded Rec.709 (sRGB)", "CIE XYZ-D65 - Scene-referred", "ACEScc"]


def check_space(config: str, name: str) -> None:
    """Both directions."""
    known = ocio.Config.CreateFromFile(config)
    for src, dst in ((name, "scene_linear"), ("scene_linear", name)):
        is_light = known.getColorSpace(src).getEncoding() == "scene-linear"
        picture = LIGHT if is_light else CODES
        expected = shown(config, ocio.ColorSpaceTransform(src, dst), picture)
        check_agrees(color_transform(FRAME, src=src, dst=dst, config=config), expected, picture)


@pytest.mark.parametrize("name", SPACES)
def test_a_color_space_is_what_opencolorio_makes_of_it(name: str) -> None:
    check_space(STUDIO, name)


@pytest.mark.slow
@pytest.mark.parametrize("config", [CG, STUDIO, ACES1], ids=["cg", "studio", "aces1"])
def test_every_color_space_of_the_built_in_configs(config: str) -> None:
    for name in ocio.Config.CreateFromFile(config).getColorSpaceNames():
        check_space(config, name)


def check_view(config: str, display: str, view: str, inverse: bool) -> None:
    transform, picture = ocio.DisplayViewTransform("scene_linear", display, view), CODES if inverse else LIGHT
    expected = shown(config, transform, picture, inverse)
    way = "inverse" if inverse else "forward"
    made = color_transform(FRAME, display=display, view=view, direction=way, config=config)  # type: ignore[arg-type]
    check_agrees(made, expected, picture)


def test_a_display_is_what_opencolorio_makes_of_it() -> None:
    check_view(ACES1, "sRGB - Display", "ACES 1.0 - SDR Video", False)
    check_view(CG, "sRGB - Display", "ACES 2.0 - SDR 100 nits (Rec.709)", False)
    check_view(CG, "sRGB - Display", "Un-tone-mapped", True)


@pytest.mark.slow
@pytest.mark.parametrize("config", [CG, STUDIO, ACES1], ids=["cg", "studio", "aces1"])
def test_every_display_and_view_of_the_built_in_configs(config: str) -> None:
    known = ocio.Config.CreateFromFile(config)
    for display in known.getDisplays():
        for view in known.getViews(display):
            for inverse in (False, True):
                check_view(config, display, view, inverse)


@pytest.mark.slow
@pytest.mark.parametrize("config", [CG, STUDIO], ids=["cg", "studio"])
def test_every_transform_has_the_same_bits_on_opencl(config: str) -> None:
    require("opencl")
    known = ocio.Config.CreateFromFile(config)
    spaces = [name for name in known.getColorSpaceNames() if name != "scene_linear"]
    cases: list[dict[str, Any]] = [{"src": "scene_linear", "dst": name} for name in spaces]
    cases += [{"src": name, "dst": "scene_linear"} for name in spaces]
    for display in known.getDisplays():
        for view in known.getViews(display):
            cases += [{"display": display, "view": view, "direction": way} for way in ("forward", "inverse")]
    for case in cases:
        made = color_transform(FRAME, config=config, **case)
        picture = CODES if case.get("direction") == "inverse" else LIGHT
        np.testing.assert_array_equal(ran(made, picture, "opencl"), ran(made, picture), err_msg=str(case))


@pytest.mark.parametrize("backend", ["gl", "opencl"])
def test_devices_agree(backend: str) -> None:
    """Where the shader computes with operations that are exact, with the same bits."""
    require(backend)
    made = color_transform(FRAME, display="sRGB - Display", config=CG)
    np.testing.assert_array_equal(ran(made, LIGHT, backend), ran(made, LIGHT))


# Files


def lut_file(folder: Path, kind: str, seed: int) -> Path:
    """A LUT file of a random grade, baked by OpenColorIO."""
    r = np.random.default_rng(seed)
    steps = [
        ocio.ExponentTransform([*r.uniform(0.5, 1.5, 3).tolist(), 1.0]),
        ocio.CDLTransform(slope=r.uniform(0.7, 1.3, 3).tolist(), offset=r.uniform(-0.03, 0.03, 3).tolist()),
        ocio.MatrixTransform.Sat(float(r.uniform(0.4, 1.4)), [0.2126, 0.7152, 0.0722]),
    ]
    config = ocio.Config.CreateFromFile(CG)
    space = ocio.ColorSpace(name="graded")
    # A file of curves holds nothing that mixes channels.
    source, steps = ("ACES2065-1", steps[:2]) if kind == "spi1d" else ("ACEScg", steps)
    space.setTransform(ocio.GroupTransform(steps), ocio.COLORSPACE_DIR_FROM_REFERENCE)
    config.addColorSpace(space)
    baker = ocio.Baker(config, kind, source, "graded")
    baker.setCubeSize(int(r.choice([5, 9, 17, 33])))
    file = folder / f"look{seed}.{BAKED[kind]}"
    file.write_text(baker.bake())
    return file


BAKED = {
    "resolve_cube": "cube", "iridas_cube": "cube", "flame": "3dl", "lustre": "3dl", "cinespace": "csp",
    "spi1d": "spi1d", "spi3d": "spi3d", "truelight": "cub", "iridas_itx": "itx",
    "Academy/ASC Common LUT Format": "clf", "Color Transform Format": "ctf",
}  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("interpolation", ["best", "linear"])
@pytest.mark.parametrize("kind", list(BAKED))
def test_lut_files(kind: str, interpolation: Any, tmp_path: Path) -> None:
    """Baked by OpenColorIO in each format that it writes."""
    check_lut(lut_file(tmp_path, kind, 0), interpolation)


def check_lut(file: Path, interpolation: Any) -> None:
    kinds = {"best": ocio.INTERP_BEST, "linear": ocio.INTERP_LINEAR}
    expected = shown(CG, ocio.FileTransform(str(file), interpolation=kinds[interpolation]), CODES)
    assert apart(expected, CODES) > 0.01, "the LUT changes the picture"
    found = ran(color_transform(FRAME, file=str(file), interpolation=interpolation), CODES)
    assert apart(found, expected) < CLOSE


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(BAKED))
def test_twenty_lut_files_of_each_kind(kind: str, tmp_path: Path) -> None:
    for seed in range(1, 21):
        check_lut(lut_file(tmp_path, kind, seed), "best")


@pytest.mark.sampled
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["spi1d", "resolve_cube"])
def test_the_inverse_of_a_lut_file(kind: str, seed: int, tmp_path: Path) -> None:
    """OpenColorIO's GPU shaders look up the inverse of a 3-D LUT in a table, as its default processor does."""
    file = lut_file(tmp_path, kind, seed)
    transform = ocio.FileTransform(str(file))
    codes = CODES * np.float32(0.8) + np.float32(0.1)
    graded = shown(CG, transform, codes)
    found = ran(color_transform(FRAME, file=str(file), direction="inverse"), graded)
    processor = ocio.Config.CreateFromFile(CG).getProcessor(transform, ocio.TRANSFORM_DIR_INVERSE)
    default = graded.copy()
    processor.getDefaultCPUProcessor().applyRGBA(default)
    assert apart(found, default) < CLOSE
    inside = ((graded > 0.01) & (graded < 0.99)).all(axis=2)
    assert inside.mean() > 0.2
    assert apart(found[inside], codes[inside]) < (CLOSE if kind == "spi1d" else 1e-2)


def test_a_cube_whose_axes_differ(tmp_path: Path) -> None:
    """Rows, columns and slices are not exchanged: each entry is a number of its own."""
    entries = "\n".join(f"{r / 2:.3f} {g / 4:.3f} {b / 8:.3f}" for b in range(3) for g in range(3) for r in range(3))
    file = tmp_path / "axes.cube"
    file.write_text(f"LUT_3D_SIZE 3\n{entries}\n")
    found = ran(color_transform(FRAME, file=str(file)), CODES)
    np.testing.assert_allclose(found[..., :3], CODES[..., :3] / [1, 2, 4], atol=1e-6)
    np.testing.assert_array_equal(found[..., 3], CODES[..., 3])


def test_a_long_lut_is_folded(tmp_path: Path) -> None:
    """More entries than a texture is wide, not monotonous."""
    values = np.sin(np.linspace(0, 40, 20000)) * 0.5 + 0.5
    file = tmp_path / "long.cube"
    file.write_text("LUT_1D_SIZE 20000\n" + "\n".join(f"{v:.7f} {v * v:.7f} {1 - v:.7f}" for v in values))
    expected = shown(CG, ocio.FileTransform(str(file)), CODES)
    found = ran(color_transform(FRAME, file=str(file)), CODES)
    # 1 / 20000 of the domain is 300 steps of float32 near 1: that much of a step's slope is rounding.
    assert apart(found, expected) < 40 / 20000 * 20000 * 2**-22


# Grades

GRADES: dict[str, Callable[[np.random.Generator], Any]] = {
    "cdl": lambda r: ocio.CDLTransform(
        slope=r.uniform(0.5, 2, 3).tolist(), offset=r.uniform(-0.1, 0.1, 3).tolist(),
        power=r.uniform(0.5, 2, 3).tolist(), sat=float(r.uniform(0, 2)),
    ),
    "exposure and contrast": lambda r: ocio.ExposureContrastTransform(
        ocio.EXPOSURE_CONTRAST_LINEAR, exposure=float(r.uniform(-3, 3)), contrast=float(r.uniform(0.5, 2)),
        gamma=float(r.uniform(0.5, 2)), pivot=0.18,
    ),
    "primary": lambda r: _primary(r),
    "tone": lambda r: _tone(r),
    "curve": lambda r: _curve(r),
}  # fmt: skip


def _rgbm(r: np.random.Generator, low: float, high: float) -> Any:
    return ocio.GradingRGBM(*r.uniform(low, high, 4).tolist())


def _primary(r: np.random.Generator) -> Any:
    values = ocio.GradingPrimary(ocio.GRADING_LOG)
    values.brightness, values.contrast, values.gamma = _rgbm(r, -10, 10), _rgbm(r, 0.8, 1.2), _rgbm(r, 0.8, 1.2)
    values.saturation = float(r.uniform(0.5, 1.5))
    return ocio.GradingPrimaryTransform(values, ocio.GRADING_LOG)


def _tone(r: np.random.Generator) -> Any:
    values = ocio.GradingTone(ocio.GRADING_LOG)
    values.scontrast = float(r.uniform(0.5, 1.5))
    return ocio.GradingToneTransform(values, ocio.GRADING_LOG)


def _curve(r: np.random.Generator) -> Any:
    points = [0.0, float(r.uniform(0, 0.2)), 0.5, float(r.uniform(0.3, 0.7)), 1.0, float(r.uniform(0.8, 1.2))]
    curve = ocio.GradingBSplineCurve(points)
    same = ocio.GradingBSplineCurve([0.0, 0.0, 1.0, 1.0])
    return ocio.GradingRGBCurveTransform(ocio.GradingRGBCurve(same, curve, same, curve), ocio.GRADING_LOG)


@pytest.mark.sampled
@pytest.mark.parametrize("kind", list(GRADES))
def test_random_grades(kind: str) -> None:
    for seed in range(3):
        transform = GRADES[kind](np.random.default_rng(seed))
        expected = shown(CG, transform, CODES)
        assert apart(expected, CODES) > 0.001
        processor = ocio.Config.CreateFromFile(CG).getProcessor(transform)
        made = read_processor(processor, "grade")(FRAME, pg.target("grade", "rgba32f"), {})
        check_agrees(made, expected, CODES)


# What runs bring, and where it runs


def test_exposure_contrast_and_gamma_change_without_a_new_program() -> None:
    names = {"exposure_stops": (0.0, 2.0), "contrast": (1.0, 1.5), "gamma": (1.0, 2.2)}
    values = {name: pg.Value(name, float) for name in names}
    made = color_transform(FRAME, display="sRGB - Display", view="Un-tone-mapped", config=CG, **values)
    plain = color_transform(FRAME, display="sRGB - Display", view="Un-tone-mapped", config=CG)
    with pg.compile({"result": made}) as program:
        neutral = program(frame=LIGHT, **{name: low for name, (low, _) in names.items()})["result"]
        assert apart(np.array(neutral), ran(plain, LIGHT)) < 1e-4
        graded = np.array(program(frame=LIGHT, exposure_stops=2.0, contrast=1.0, gamma=1.0)["result"])
        assert apart(graded, ran(plain, (LIGHT * [4, 4, 4, 1]).astype(np.float32))) < 1e-4
        steep = program(frame=np.full_like(LIGHT, 0.18), exposure_stops=0.0, contrast=1.7, gamma=2.2)["result"]
    gray = ran(plain, np.full_like(LIGHT, 0.18))[0, 0, 0]
    assert abs(float(steep[0, 0, 0]) - float(gray) ** 2.2) < 1e-4, "contrast turns about 0.18"


def test_two_luts_in_one_graph(tmp_path: Path) -> None:
    """Each has inputs of its own: a curve and its inverse."""
    for name, power in (("squares", 2.0), ("roots", 0.5)):
        lines = [f"{v:.7f} {v:.7f} {v:.7f}" for v in np.linspace(0, 1, 4097) ** power]
        (tmp_path / f"{name}.cube").write_text("LUT_1D_SIZE 4097\n" + "\n".join(lines))
    squared = color_transform(FRAME, file=str(tmp_path / "squares.cube"), name="squared")
    found = ran(color_transform(squared, file=str(tmp_path / "roots.cube"), name="rooted"), CODES)
    clear = CODES > 0.05  # below, the root's LUT is steep between its entries
    np.testing.assert_allclose(found[clear], CODES[clear], atol=1e-4)


def test_exposure_goes_before_the_default_display_too() -> None:
    named = color_transform(FRAME, display="sRGB - Display", config=CG, exposure_stops=1.0)
    np.testing.assert_array_equal(ran(color_transform(FRAME, config=CG, exposure_stops=1.0), LIGHT), ran(named, LIGHT))


def test_the_default_display_is_shown_where_nothing_is_named() -> None:
    config = ocio.Config.CreateFromFile(CG)
    display = config.getDefaultDisplay()
    transform = ocio.DisplayViewTransform("scene_linear", display, config.getDefaultView(display))
    check_agrees(color_transform(FRAME, config=CG), shown(CG, transform, LIGHT), LIGHT)


def test_it_fuses_with_its_neighbors_and_runs_in_tiles() -> None:
    frame = pg.Input("frame", "rgba32f", (32, 24))
    graded = color_transform(frame, src="ACEScg", dst="ACEScct", config=CG, name="to_log")
    back = color_transform(graded, src="ACEScct", dst="ACEScg", config=CG, name="to_linear")
    with pg.compile(back) as program:
        assert len(program.plan.steps) == 1
    picture = np.tile(LIGHT, (8, 8, 1))
    frame = pg.Input("frame", "rgba32f", (picture.shape[1], picture.shape[0]))
    blurred = gaussian_blur(color_transform(frame, display="sRGB - Display", config=CG), radius_px=3)
    whole = ran(blurred, picture)
    out = np.zeros_like(whole)
    pg.tiled(blurred, {"frame": picture}, out, tile=(96, 64))
    np.testing.assert_array_equal(out, whole)


# Errors


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"dst": "ACEScg", "display": "sRGB - Display"}, "one of.*dst, display"),
        ({"dst": "ACESgc"}, "color space 'ACESgc'.*ACEScg"),
        ({"src": "nothing of the kind", "dst": "ACEScg"}, "it has.*ACEScct"),
        ({"display": "sRGB - Displey"}, "display.*sRGB - Display"),
        ({"display": "sRGB - Display", "view": "Rew"}, "view.*Raw"),
        ({"look": "film"}, "look 'film'"),
        ({"file": "missing.cube"}, "no file missing.cube"),
        ({"dst": "ACEScg", "exposure_stops": 1.0}, "exposure_stops goes with display="),
        ({"dst": "ACEScg", "config": "missing.ocio"}, "config 'missing.ocio' cannot be read"),
        ({"dst": "ACEScg", "config": "ocio://cg-config"}, "config 'ocio://cg-config'.*cg-config-v"),
    ],
)
def test_wrong_names_are_told_with_what_there_is(given: dict[str, Any], words: str) -> None:
    with pytest.raises(GraphError, match=f"(?s)color_transform: .*{words}"):
        color_transform(FRAME, **{"config": CG, **given})


def test_a_damaged_file_is_an_error(tmp_path: Path) -> None:
    for text in ("", "LUT_3D_SIZE 3\n0 0 0\n", "LUT_3D_SIZE 4000\n", "LUT_1D_SIZE x\n"):
        file = tmp_path / "damaged.cube"
        file.write_text(text)
        with pytest.raises(GraphError, match="color_transform"):
            color_transform(FRAME, file=str(file))


def test_a_lut_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.shaders.containers.ocio.MAX_LUT_NUMBERS", 100)
    with pytest.raises(pg.InputError, match="at most 100"):
        color_transform(FRAME, src="ADX16", dst="ACEScg", config=STUDIO)
