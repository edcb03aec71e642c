"""Write an effect as a folder that a browser runs: effect.json, effect.bin, the runtime and a page."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.webgpu.recorder import RecordingBackend
from passgraph.errors import InputError
from passgraph.files.program_folder import FILE as PROGRAM
from passgraph.formats import FORMATS, Format
from passgraph.graph.run_values import FILLED_IN, OUTPUT_SIZE, Value, is_object_type
from passgraph.graph.targets import InputSpec, Outputs, Target, checked_size, named_outputs
from passgraph.language import symbols
from passgraph.pictures import encode_png
from passgraph.plan.build import build
from passgraph.plan.data import Options, Plan
from passgraph.plan.dependencies import inputs_behind
from passgraph.plan.limits import check_memory
from passgraph.reading import read_bytes
from passgraph.run.caller_arrays import Admission, bound_to
from passgraph.viewer.subject import Control
from passgraph.web.document import written_plan
from passgraph.web.orbit import Orbit, PoseTable
from passgraph.web.size_rules import resizable_rules
from passgraph.writing import is_temporary, made_folder, write_files

#: Files that every export has, copied from here.
PAGE = Path(__file__).parent / "page"
#: What the page and its test read; a folder that has other files is not written into.
DOCUMENT, DATA, POSES = "effect.json", "effect.bin", "orbit.bin"
#: Largest file of sound.
MOST_SOUND_BYTES = 256 << 20
#: Size where neither an input nor the caller says one.
SIZE = (1280, 720)


@dataclass(frozen=True)
class Described:
    """The description of an effect on its page.

    Attributes
    ----------
    name, summary : of the effect
    controls : its parameters that the page can set, with ranges
    fixed : parameters that are constants of the export: name → value
    frame_time : the parameter with the seconds of a frame, if there is one
    choices : of a parameter with choices, label → number
    signals : inputs that the page fills: "keyboard" and "audio"
    sound : the file that the page plays, as it is
    """

    name: str = "effect"
    summary: str = ""
    controls: tuple[Control, ...] = ()
    fixed: Mapping[str, object] = field(default_factory=dict)
    frame_time: str | None = None
    choices: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    signals: Sequence[str] = ()
    sound: Path | None = None


@dataclass(frozen=True)
class Written:
    """The result of an export.

    Attributes
    ----------
    folder : of the files
    values : names of the values that the page sets
    constants : names of values that are constants of the export, such as the camera
    resizable : True if it runs on pictures of any size; else they are scaled to the size of the export
    plan : the plan that it runs
    poses : number of azimuths, elevations and distances of a camera that orbits; None if it is a constant
    """

    folder: Path
    values: tuple[str, ...]
    constants: tuple[str, ...]
    resizable: bool
    plan: Plan
    poses: tuple[int, ...] | None = None


def export_web(
    outputs: Outputs, folder: str | os.PathLike[str], /, *, size: tuple[int, int] | None = None,
    described: Described | None = None, options: Options | None = None, orbit: Orbit | None = None,
    progress: Callable[..., None] = lambda *_: None, **given: Any,
) -> Written:  # fmt: skip
    """Write an effect for the browser: effect.json, effect.bin, the runtime passgraph.js and a page.

    Serve the folder (``python -m http.server``) and open it in a browser with WebGPU.  No device is needed here.

    Parameters
    ----------
    outputs
        One target, several, or ``{name: target}``, as for `passgraph.compile`.
    folder
        Is created.  Files of an earlier export there are replaced.
    size
        (width, height) of the output, and of open inputs without a picture; default: the size of the first picture,
        else 1280x720.  An output of another size than a picture has this size alone.
    described
        Name, controls and constants that the page shows; by default found in the graph.
    options
        Optimizations to switch off, as for `passgraph.compile`.
    orbit
        Poses of the camera that the page can choose from.  Python computes each, which takes seconds; default: none.
    progress
        Is called with a text, and the counts of poses done and in all.
    given
        Pictures that the page begins with, and values that become constants of the export, such as ``camera=``.

    Returns
    -------
    Written
        What the page can set, and what is constant.

    Raises
    ------
    InputError
        For a value that a Python function computes, with its name; for a folder with other files.
    GraphError, BackendError
        As for `passgraph.compile`, with WebGPU's default limits.

    Examples
    --------
    >>> import tempfile
    >>> import passgraph as pg
    >>> from passgraph.web import export_web
    >>> dim = pg.kernel(source="def dim(color: Image, by: float = 0.5) -> vec4: return color[0, 0] * by")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = export_web(dim(pg.Input("frame"), pg.Value("by", default=0.5)), folder, size=(64, 48))
    ...     sorted(path.name for path in written.folder.iterdir())[:3], written.values, written.resizable
    (['effect.bin', 'effect.json', 'index.html'], ('by',), True)
    """
    named, said = named_outputs(outputs), described or Described()
    specs = inputs_behind(list(named.values()))
    pictures = {name: value for name, value in given.items() if name in specs}
    wanted = None if size is None else checked_size(size, "the output")
    bound, arrays = _bound(named, specs, pictures, wanted)
    options, limits = options or Options(), RecordingBackend().limits
    has_open = any(spec.default is None for spec in specs.values())
    is_scaled = wanted is not None and any(np.shape(picture)[1::-1] != wanted for picture in pictures.values())
    plan = build(named, None if has_open and not is_scaled else wanted or SIZE, bound, options, limits)
    check_memory(plan, None)
    constants = _constants(plan, {n: v for n, v in given.items() if n not in specs})
    rules = None if is_scaled else resizable_rules(named, plan, bound, options, limits)
    files = _files(plan, arrays, pictures)
    embedded = {
        n: arrays[n] for n, spec in specs.items() if n not in files and (n in pictures or spec.default is not None)
    }
    poses = None if orbit is None else PoseTable(plan, {**constants, OUTPUT_SIZE.name: plan.size}, orbit, progress)
    document, data = written_plan(plan, rules, constants, embedded, poses)
    for number, name in enumerate(files):
        document["inputs"][name]["picture"] = f"input{number}.png"
    controls = _controls(plan, said, constants, document)
    fixed = sorted(name for name in constants if poses is None or name != poses.camera)
    document |= {
        "name": said.name, "summary": said.summary,
        "sizeFrom": next((name for name, spec in specs.items() if spec.default is None and name in plan.inputs), None),
        "parameters": controls, "fixed": {name: _shown(value) for name, value in said.fixed.items()},
        "constants": fixed, "frameTime": said.frame_time, "signals": list(said.signals), "sound": None,
    }  # fmt: skip
    beside = {f"input{number}.png": png for number, png in enumerate(files.values())}
    if said.sound is not None:
        document["sound"] = f"sound{said.sound.suffix.lower()}"
        beside[document["sound"]] = read_bytes(said.sound, "sound", MOST_SOUND_BYTES)
    if poses is not None:
        document["orbit"], beside[POSES] = poses.described(POSES), poses.numbers.tobytes()
    written, counts = Path(folder), None if poses is None else tuple(map(len, poses.axes))
    _write(written, document, data, beside)
    return Written(written, tuple(c["name"] for c in controls), tuple(fixed), rules is not None, plan, counts)


def _bound(
    outputs: Mapping[str, Target], specs: Mapping[str, InputSpec], pictures: Mapping[str, Any],
    size: tuple[int, int] | None,
) -> tuple[dict[str, tuple[Format, tuple[int, int]]], dict[str, NDArray[Any]]]:  # fmt: skip
    """Return format and size of each input, and its picture; black where none is given."""
    first = next((np.shape(picture) for picture in pictures.values()), None)
    width, height = size or (SIZE if first is None else (first[1], first[0]))
    blank: dict[str, Any] = {}
    for name, spec in specs.items():
        if name not in pictures and spec.default is None:
            format_ = spec.format or FORMATS["rgba8"]
            across, down = spec.size or (width, height)
            blank[name] = np.zeros((down, across, format_.channels), format_.number)
    arrays = Admission(specs, outputs.values(), "keep").pictures({**blank, **pictures}, lambda _: None)
    return {name: bound_to(arrays[name], spec) for name, spec in specs.items()}, arrays


def _constants(plan: Plan, given: Mapping[str, Any]) -> dict[str, object]:
    """Return the values that are constants of the export: those given, and objects such as cameras."""
    for name in given:
        if name not in plan.values:
            known = ", ".join([*plan.inputs, *plan.values]) or "nothing"
            raise InputError(f"there is no input or value {name!r} in this graph; it takes {known}")
    objects = {n: v.default for n, v in plan.values.items() if is_object_type(v.type) and n not in FILLED_IN}
    return {name: value for name, value in {**objects, **given}.items() if value is not None}


def _controls(
    plan: Plan, said: Described, constants: Mapping[str, object], document: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Return the controls of the page's run values; a value without a description gets its control from the graph."""
    known = {control.name: control for control in said.controls}
    ranges: dict[str, dict[str, Any]] = {}
    for step in document["steps"]:
        for stage in step.get("stages", ()):
            for place in stage["values"]:
                ranges.setdefault(place["value"], place.get("range", {}))
    controls = []
    for name, handle in plan.values.items():
        if name in constants or name in FILLED_IN or name not in ranges:
            continue
        control = known.get(name) or _control_of(handle, ranges[name])
        choices = said.choices.get(name, {})
        default = choices.get(control.default, control.default) if choices else control.default
        controls.append({**asdict(control), "default": _shown(default), "choices": list(map(list, choices.items()))})
    return controls


def _control_of(handle: Value, limits: Mapping[str, Any]) -> Control:
    kinds = {float: "float", int: "int", bool: "bool", symbols.uint: "int"}
    kind = kinds.get(handle.type, "vector")  # type: ignore[call-overload]
    return Control(handle.name, kind, handle.default, limits.get("low"), limits.get("high"))


def _shown(value: object) -> Any:
    """Convert a value to JSON types."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (tuple, list)):
        return [_shown(part) for part in value]
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


def _files(plan: Plan, arrays: Mapping[str, NDArray[Any]], pictures: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the pictures that are files of their own, by input; pictures of 8 bits are PNG, smaller than texels."""
    files = {}
    for name in plan.inputs:
        array = arrays[name]
        if name in pictures and array.dtype == np.uint8 and array.shape[2] == 4:
            files[name] = encode_png(Path(f"{name}.png"), np.ascontiguousarray(array))
    return files


def _write(folder: Path, document: Mapping[str, Any], data: bytes, files: Mapping[str, bytes]) -> None:
    """Write the folder; a page never reads a document beside the data of another one."""
    place = made_folder(folder)
    pages = {path.name: path.read_bytes() for path in sorted(PAGE.iterdir()) if path.is_file()}
    ours = {*pages, DOCUMENT, DATA, POSES, PROGRAM}
    names = [path.name for path in place.iterdir() if not is_temporary(path.name)]
    other = [name for name in names if name not in ours and not _GIVEN.fullmatch(name)]
    if other:
        raise InputError(
            f"{folder}: has other files, such as {sorted(other)[0]!r}; expected a new folder, or one of an earlier "
            "export. Give another one"
        )
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    write_files(place, {**pages, **files, DATA: data, DOCUMENT: text.encode()})


_GIVEN = re.compile(r"input\d+\.png|sound\.\w+")
