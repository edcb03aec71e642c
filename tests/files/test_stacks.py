"""`apply` on TIFF stacks: every plane, axes by name, metadata kept; tifffile reads and SciPy computes the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.ndimage
import tifffile

from tests.commands.told import Outcome, refused

STACK = np.random.default_rng(4).integers(0, 65536, (2, 3, 2, 20, 30), np.uint16)
OME = {
    "axes": "TZCYX", "Channel": {"Name": ["DAPI", "GFP"]}, "PhysicalSizeX": 0.25, "PhysicalSizeXUnit": "µm",
    "PhysicalSizeZ": 2.0,
}  # fmt: skip


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tifffile.imwrite("a.ome.tif", STACK, metadata=OME, photometric="minisblack")


def made(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    outcome = Outcome(capsys, "apply", *arguments)
    assert outcome.status == 0, outcome.err
    assert outcome.err == ""
    return outcome.out


def median(planes: Any) -> Any:
    return scipy.ndimage.median_filter(planes, size=(1,) * (planes.ndim - 2) + (3, 3), mode="nearest")


def test_every_plane_of_an_ome_tiff(capsys: pytest.CaptureFixture[str]) -> None:
    assert "b.ome.tif: 12 planes of 30x20 by numpy" in made(capsys, "median", "a.ome.tif", "-o", "b.ome.tif")
    with tifffile.TiffFile("b.ome.tif") as file:
        assert file.is_ome
        assert file.series[0].axes == "TZCYX"
        assert np.array_equal(file.asarray(), median(STACK))
        pixels = tifffile.xml2dict(file.ome_metadata)["OME"]["Image"]["Pixels"]
    assert [channel["Name"] for channel in pixels["Channel"]] == ["DAPI", "GFP"]
    assert (pixels["PhysicalSizeX"], pixels["PhysicalSizeXUnit"], pixels["PhysicalSizeZ"]) == (0.25, "µm", 2.0)


@pytest.mark.parametrize(
    ("options", "axes", "part"),
    [
        (["--channel", "GFP"], "TZYX", np.s_[:, :, 1]),
        (["--channel", "0", "--plane", "z=2"], "TYX", np.s_[:, 2, 0]),
        (["--plane", "t=1", "--plane", "z=0", "--plane", "c=1"], "YX", np.s_[1, 0, 1]),
    ],
)
def test_chosen_planes(options: list[str], axes: str, part: Any, capsys: pytest.CaptureFixture[str]) -> None:
    made(capsys, "median", "a.ome.tif", "-o", "b.ome.tif", *options)
    with tifffile.TiffFile("b.ome.tif") as file:
        assert file.series[0].axes == axes
        assert np.array_equal(file.asarray(), median(STACK[part]))


def test_stacks_of_imagej_and_plain_ones(capsys: pytest.CaptureFixture[str]) -> None:
    tifffile.imwrite("j.tif", STACK[0, :, 0], imagej=True, metadata={"axes": "ZYX", "spacing": 3.5, "unit": "um"})
    made(capsys, "median", "j.tif", "-o", "k.tif")
    with tifffile.TiffFile("k.tif") as file:
        assert np.array_equal(file.asarray(), median(STACK[0, :, 0]))
        assert (file.imagej_metadata["spacing"], file.imagej_metadata["unit"]) == (3.5, "um")
    floats = STACK[0, 0].astype(np.float32) / 7
    tifffile.imwrite("p.tif", floats, photometric="minisblack")
    made(capsys, "median", "p.tif", "-o", "q.tif")
    assert np.array_equal(tifffile.imread("q.tif"), median(floats))


def test_an_effect_that_makes_color_makes_planes_of_color(capsys: pytest.CaptureFixture[str]) -> None:
    made(capsys, "sepia", "a.ome.tif", "-o", "b.ome.tif", "--plane", "t=0")
    with tifffile.TiffFile("b.ome.tif") as file:
        assert file.series[0].axes.endswith("YXS")
        assert file.asarray().shape == (3, 2, 20, 30, 3)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--plane", "q=1"], "there is no axis 'q'; it has t (2), z (3), c (2)"),
        (["--plane", "z=3"], "axis z has places 0 to 2; got '3'"),
        (["--channel", "RFP"], "axis c has places 0 to 1, or DAPI, GFP; got 'RFP'"),
        (["--plane", "3"], "--plane '3': expected AXIS=NUMBER, such as z=3"),
        (["--linear"], "is a stack, whose numbers are not encoded; add --as-stored"),
    ],
)
def test_places_that_are_not_there(options: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert text in refused(capsys, "apply", "median", "a.ome.tif", "-o", "b.tif", *options)


def test_options_for_a_picture_that_is_no_stack(capsys: pytest.CaptureFixture[str]) -> None:
    tifffile.imwrite("one.tif", STACK[0, 0, 0])
    assert "one.tif: is no stack" in refused(capsys, "apply", "median", "one.tif", "-o", "b.tif", "--channel", "0")
    assert "from .tif to .tif" in refused(capsys, "apply", "median", "one.tif", "-o", "b.png", "--plane", "z=0")
