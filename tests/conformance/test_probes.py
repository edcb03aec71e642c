"""Probes name the facts of a device that is known: one in NumPy whose rounding, grid and filter a test chooses."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from docs.drivers import PAGE, page
from passgraph.backends.registry import open_backend
from passgraph.commands.entry import run as run_command
from passgraph.errors import BackendError, InputError
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from passgraph.verify.conditions import Conditions
from passgraph.verify.probes import measuring
from passgraph.verify.probes.functions import OUTSIDE, errors_of
from passgraph.verify.probes.kept import Results, load, nearest, shipped
from passgraph.verify.probes.probe import DTYPES, Program, Said
from passgraph.verify.probes.reproduction import shader_test, write_reproduction
from passgraph.verify.probes.table import PROBES, conforms
from tests.conformance.test_reproduction import repeated
from tests.conftest import present_devices

Numbers = NDArray[Any]


@dataclass(frozen=True)
class Device:
    """A device by closed forms, with the choices that specifications leave to drivers."""

    language: str = "glsl"
    round_stored: Callable[[Numbers], Numbers] = np.rint
    to_half: Callable[[Numbers], Numbers] = lambda x: x.astype(np.float16)
    weight_bits: int = 8
    grid: int = 256
    owns_left: bool = True
    places: tuple[float, ...] = (2, 6, 10, 14)
    rounds_source: bool = False
    words: Callable[..., Numbers] = lambda a, b, c, d: a * b + c

    def compute(self, program: Program, rows: Numbers) -> Numbers:
        with np.errstate(all="ignore"):
            found = np.asarray(self.words(*rows.view(np.float32).T), DTYPES[program.result])
        return found.view(np.uint32)

    def store(self, format: str, values: Numbers, times: int = 0) -> Numbers:
        if format == "rgba16f":
            with np.errstate(all="ignore"):
                return self.to_half(values)
        steps = 65535 if format == "rgba16" else 255
        exact = values.astype(np.float64)
        if times:
            source = np.rint(exact * steps) / steps if self.rounds_source else exact
            stored = np.zeros_like(exact)
            for _ in range(times):
                stored = np.rint((stored / steps + source * source[:, 3:]) * steps)
            return stored.astype(np.uint8)
        if format == "rgba8_srgb":
            exact = np.asarray(linear_to_srgb(exact))
        with np.errstate(all="ignore"):
            clamped = np.nan_to_num(np.clip(exact, 0.0, 1.0))
        return self.round_stored(clamped * steps).astype(np.uint16 if steps > 255 else np.uint8)

    def load(self, format: str, numbers: Numbers) -> Numbers:
        if format == "rgba16f":
            return numbers.astype(np.float32)
        exact = numbers / 255.0
        return np.asarray(srgb_to_linear(exact) if format == "rgba8_srgb" else exact).astype(np.float32)

    def sample(self, texels: Numbers, at: Numbers, linear: bool) -> Numbers:
        place = at.astype(np.float64) * len(texels) - (0.5 if linear else 0.0)
        whole = np.floor(place)
        share = np.rint((place - whole) * 2.0**self.weight_bits) / 2.0**self.weight_bits if linear else 0.0
        first, second = (texels[np.clip(whole + k, 0, len(texels) - 1).astype(int)] / 255.0 for k in (0, 1))
        return (first * (1 - share) + second * share).astype(np.float32)

    def cover(self, corners: Numbers, size: tuple[int, int], samples: int = 1) -> Numbers:
        snapped = np.rint(corners.astype(np.float64) * self.grid) / self.grid
        places = [(8.0, 8.0)] if samples == 1 else [(place, place) for place in self.places]
        y, x = np.mgrid[: size[1], : size[0]]
        covered = np.zeros((size[1], size[0]), np.float32)
        for right, down in places:
            drawn = np.zeros(covered.shape, bool)
            for triangle in snapped.reshape(-1, 3, 2):
                drawn |= self._inside(triangle, x + right / 16.0, y + down / 16.0)
            covered += drawn
        return covered / np.float32(len(places))

    def _inside(self, triangle: Numbers, x: Numbers, y: Numbers) -> Numbers:
        (x0, y0), (x1, y1), (x2, y2) = triangle
        if (area := (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) == 0.0:
            return np.zeros(x.shape, bool)
        corners = triangle if area > 0 else triangle[::-1]
        inside = np.ones(x.shape, bool)
        for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, 0), strict=True):
            edge = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            is_left = y1 < y0 if self.owns_left else y1 > y0
            inside &= (edge > 0) | ((edge == 0) & (is_left or (y1 == y0 and x1 > x0)))
        return inside


def fact(name: str, device: Device) -> str:
    return PROBES[name].measure[device.language](device)  # type: ignore[index]


def toward_zero(values: Numbers) -> Numbers:
    """Cut 13 bits of the mantissa; what is too large becomes the largest half."""
    cut = (values.view(np.uint32) & np.uint32(0xFFFFE000)).view(np.float32)
    return np.where(np.isfinite(values), np.clip(cut, -65504, 65504), values).astype(np.float16)


PLAIN = Device()


@pytest.mark.parametrize(
    ("name", "device", "expected"),
    [
        ("bytes-stored", PLAIN, "nearest"),
        ("bytes-stored", replace(PLAIN, round_stored=np.floor), "up to 0.999 steps off"),
        ("shorts-stored", PLAIN, "nearest"),
        ("halves-stored", PLAIN, "nearest, halves to even"),
        ("halves-stored", replace(PLAIN, to_half=toward_zero), "toward zero"),
        ("halves-beyond", PLAIN, "65504, ∞, ∞"),
        ("halves-beyond", replace(PLAIN, to_half=toward_zero), "65504, 65504, 65504"),
        ("halves-special", PLAIN, "NaN, ∞, -∞"),
        ("half-denormals", PLAIN, "kept, kept"),
        ("bytes-special", PLAIN, "0, 255, 0"),
        ("bytes-read", PLAIN, "correctly rounded"),
        ("srgb-read", PLAIN, "correctly rounded"),
        ("srgb-stored", PLAIN, "nearest"),
        ("srgb-stored", replace(PLAIN, round_stored=np.ceil), "up to 1.000 steps off"),
        ("filter-bits", PLAIN, "8 bits"),
        ("filter-bits", replace(PLAIN, weight_bits=4), "4 bits"),
        ("filter-bits", replace(PLAIN, weight_bits=20), "float32"),
        ("nearest-tie", PLAIN, "right, left"),
        ("blend-faint", PLAIN, "stored each time: 0"),
        ("blend-source", PLAIN, "not rounded first"),
        ("blend-source", replace(PLAIN, rounds_source=True), "rounded first"),
        ("corner-grid", PLAIN, "1/256 pixel"),
        ("corner-grid", replace(PLAIN, grid=16), "1/16 pixel"),
        ("corner-grid", replace(PLAIN, grid=1 << 16), "1/1024 pixel or finer"),
        ("ties", PLAIN, "left, small y"),
        ("ties", replace(PLAIN, owns_left=False), "right, small y"),
        ("sample-places", PLAIN, "x 2 6 10 14, y 2 6 10 14"),
        ("sample-places", replace(PLAIN, places=(1, 5, 9, 13)), "x 1 5 9 13, y 1 5 9 13"),
        ("fused-fragment", PLAIN, "two roundings"),
        ("fused-fragment", replace(PLAIN, words=lambda a, b, c, d: a.astype(np.float64) * b + c), "one rounding"),
        ("denormals-vertex", replace(PLAIN, words=lambda a, b, c, d: a * b), "kept, kept"),
        ("denormals-vertex", replace(PLAIN, words=lambda a, b, c, d: a * 0), "flushed, flushed"),
        ("min-nan", replace(PLAIN, words=lambda a, b, c, d: np.minimum(a, b)), "NaN, NaN"),
        ("min-nan", replace(PLAIN, words=lambda a, b, c, d: np.fmin(a, b)), "1, 1"),
        ("half-beyond", replace(PLAIN, words=lambda a, b, c, d: a.astype(np.float16).view(np.uint16)), "65504, ∞, ∞"),
        ("round-halves", replace(PLAIN, words=lambda a, b, c, d: np.rint(a)), "to even"),
        ("round-halves", replace(PLAIN, words=lambda a, b, c, d: np.floor(a + 0.5)), "away from zero"),
    ],
)  # fmt: skip
def test_a_fact_is_named(name: str, device: Device, expected: str) -> None:
    assert fact(name, device) == expected


def test_errors_are_those_of_the_results() -> None:
    x = np.linspace(0.01, 4.0, 1000, dtype=np.float32)
    exact = np.exp(x.astype(np.float64)).astype(np.float32)
    promise = measuring_promise("exp")
    assert errors_of("exp", exact, [x], promise).startswith("0.5; 0.5")
    off = np.nextafter(exact, np.float32(np.inf))
    for _ in range(6):
        off = np.nextafter(off, np.float32(np.inf))
    found = errors_of("exp", off, [x], promise)
    assert found.startswith("7")
    assert found.endswith(OUTSIDE)  # 3 ULP are promised


def measuring_promise(name: str) -> Any:
    from passgraph.language.native import OPENCL

    return OPENCL[name]


def test_what_is_outside_of_a_specification_is_marked() -> None:
    assert Said("either", "", ("1", "2")).allows("2")
    assert not Said("either", "", ("1", "2")).allows("3")
    assert conforms("fma", "opencl", "one rounding")
    assert not conforms("fma", "opencl", "two roundings")
    assert conforms("fma", "glsl", "no GLSL 4.00")
    assert not conforms("int-divided-by-zero", "opencl", "ends the process (SIGFPE)")
    assert not conforms("error-exp", "opencl", f"7; 7{OUTSIDE}")


def _lines(*messages: object, end: str = "") -> Any:
    """A process that prints messages, and other lines among them, and ends so."""
    text = "print('of a driver')\n" + "".join(
        f"print({measuring.MARK + json.dumps(m)!r}, flush=True)\n" for m in messages
    )
    command = [sys.executable, "-c", f"import os, signal, time\n{text}{end}"]
    return measuring._Process(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))


def test_a_driver_that_ends_the_process_costs_one_fact(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []

    def process(backend: str, done: list[str]) -> Any:
        asked.append(done)
        if not done:
            ends = "os.kill(os.getpid(), signal.SIGKILL)"
            return _lines({"conditions": {}}, {"begin": "fma"}, {"fact": "one"}, {"begin": "ties"}, end=ends)
        return _lines({"conditions": {}}, {"begin": "mipmaps"}, {"fact": "two"}, {"done": True})

    monkeypatch.setattr(measuring, "_process", process)
    results = measuring.measure("gl")
    assert results.facts == {"fma": "one", "ties": "ends the process (SIGKILL)", "mipmaps": "two"}
    assert asked == [[], ["fma", "ties"]]


def test_a_driver_that_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    processes = [
        _lines({"conditions": {}}, {"begin": "fma"}, end="time.sleep(600)"), _lines({"conditions": {}}, {"done": True}),
    ]  # fmt: skip
    monkeypatch.setattr(measuring, "MOST_SECONDS", 3.0)
    monkeypatch.setattr(measuring, "_process", lambda backend, done: processes.pop(0))
    assert measuring.measure("gl").facts == {"fma": "hangs"}


def test_what_cannot_be_probed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BackendError, match="there are no probes for backend 'reference'; there are for gl, webgpu"):
        measuring.measure("reference")
    monkeypatch.setattr(measuring, "_process", lambda backend, done: _lines(end="os._exit(3)"))
    with pytest.raises(
        BackendError, match=r"its process of probes ended before it began \(ends the process \(status 3"
    ):
        measuring.measure("gl")


@pytest.mark.parametrize("device", ["gl", "webgpu", "opencl"])
def test_probes_run_on_devices(device: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each probe of the language gives a fact, none of them an error of ours."""
    if device not in present_devices():
        pytest.skip(f"{device} is not here")
    file = tmp_path / "facts.json"
    assert run_command(["probe", "--backend", device, "--json", str(file)]) in (0, 1)
    out = capsys.readouterr().out
    assert "nearest known driver: " in out
    found = load(file)
    assert set(found.facts) == {name for name, probe in PROBES.items() if found.language in probe.measure}
    assert not [name for name, fact in found.facts.items() if fact.startswith("error: ")]


#: Backend → a probe with an expression that its driver computes as it must, and a mistake in its text.
RIGHT = {
    "gl": ("no-bit", "findMSB(i)"),
    "webgpu": ("negative-remainder", "i % j"),
    "opencl": ("shift-too-far", "i << v"),
}


@pytest.mark.parametrize("device", RIGHT)
def test_a_reproduction_shows_a_mistake_without_passgraph(device: str, tmp_path: Path) -> None:
    if device not in present_devices():
        pytest.skip(f"{device} is not here")
    name, text = RIGHT[device]
    with open_backend(device) as backend:
        conditions = Conditions.now(backend).as_data()
    facts = {name: "1, 2, 3"}
    results = Results(device, measuring.LANGUAGES[device], conditions, facts)
    folder = tmp_path / "found"
    assert write_reproduction(name, results, folder) == ""
    status, out = repeated(folder, tmp_path)
    allowed = PROBES[name].said[results.language].allowed
    assert (status, out.splitlines()[0].split(";")[0]) == (0, f"device: {results.device['name']}")
    assert f"got {allowed[0]}; allowed {allowed[0]} (" in out
    (source,) = folder.glob("probe.[fwc]*")
    assert text in source.read_text(encoding="utf-8")
    source.write_text(source.read_text(encoding="utf-8").replace(text, f"{text} + 1"), encoding="utf-8")
    status, out = repeated(folder, tmp_path)
    assert status == 1
    assert "computes 1, 2, 3, where" in (folder / "README.txt").read_text(encoding="utf-8")


def test_a_test_of_piglit_has_each_row_with_its_bits() -> None:
    """mix(1e8, 1, 1) is 1, whose bits are 0x3f800000; the words are those of the arguments."""
    probe = PROBES["mix-at-one"]
    text = shader_test("mix", probe.said["glsl"], probe.expressions["glsl"], "1")
    assert "GLSL >= 3.30\n" in text
    words = " ".join(str(int(np.float32(x).view(np.uint32))) for x in (1e8, 1, 1, 0))
    assert text.count("draw rect -1 -1 2 2\nprobe all rgba 0.0 1.0 0.0 1.0\n") == 1
    assert f"uniform uvec4 words {words}\nuniform uint expected {0x3F800000}\n" in text


def test_what_has_no_reproduction_is_said(tmp_path: Path) -> None:
    here = shipped()["mesa-22.3-llvmpipe"]
    for name in ("ties", "fused-forbidden", "min-nan"):
        why = write_reproduction(name, replace(here, language="opencl"), tmp_path / "found")
        assert why == "it is no expression with a list of allowed results"
    assert not (tmp_path / "found").exists()


def test_numpy_is_the_reference(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["probe", "--backend", "numpy"]) == 0
    assert "two roundings" in capsys.readouterr().out


def test_wrong_uses_are_said(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run_command(["probe", "--json", "x.json"]) == 2
    assert "--json writes one backend; got 0. Choose it: --backend gl" in capsys.readouterr().err
    other = tmp_path / "other.json"
    other.write_text('{"cases": []}', encoding="utf-8")
    with pytest.raises(InputError, match="no results of probes; expected a file of: passgraph probe --json FILE"):
        load(other)


def test_kept_results_are_of_the_present_probes() -> None:
    known = shipped()
    assert len({one.title for one in known.values()}) >= 4
    for name, one in known.items():
        assert set(one.facts) == {key for key, probe in PROBES.items() if one.language in probe.measure}, name
        assert not [key for key, text in one.facts.items() if text.startswith("error: ")], name


def test_the_nearest_driver_is_found() -> None:
    known = shipped()
    here = known["mesa-22.3-softpipe"]
    facts = dict(here.facts) | {"ties": "none"}
    name, differing = nearest(Results("gl", "glsl", here.conditions, facts), known) or ("", [])
    assert (name, [one.probe for one in differing]) == ("mesa-22.3-softpipe", ["ties"])
    assert (differing[0].here, differing[0].there) == ("none", here.facts["ties"])


def test_the_page_is_made_of_them() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(shipped())
