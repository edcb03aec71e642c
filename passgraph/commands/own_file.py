"""Graphs in a user's file: a Python module is run, since it is the user's own; kernel text is only parsed."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from math import isfinite
from pathlib import Path
from traceback import extract_tb
from types import CodeType
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.arguments import near, shown
from passgraph.commands.shader_files import ShaderFileEffect
from passgraph.effects.checked import Mark
from passgraph.effects.effect_table import Effect, summary_of
from passgraph.effects.parameters import Parameter as EffectParameter
from passgraph.errors import InputError
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import TargetSpec, named_outputs
from passgraph.language.ir import Parameter
from passgraph.language.kernel import kernel_from_text
from passgraph.language.parameter_limits import ends
from passgraph.language.types import (
    FLOAT,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    component_count,
    element_of,
    innermost,
)
from passgraph.reading import check_regular, read_text

Graph = Mapping[str, pg.Target]
#: Largest kernel text, in bytes.
MAX_TEXT_BYTES = 1 << 20
#: Names of inputs by the kind of input that an effect takes.
TAKEN: dict[str, tuple[str, ...]] = {"nothing": (), "picture": ("frame",), "picture+depth": ("frame", "depth")}


def graphs_of(path: Path, name: str | None = None) -> dict[str, Graph]:
    """Return a file's graphs by name: a module's ``outputs``, else its targets, else its effects, else its kernels.

    ``name`` selects one of any of these instead.

    Raises
    ------
    InputError
        For a file that cannot be read, raises an error, or has no graphs.
    """
    if path.suffix == ".py":
        names = names_of(path)
    else:
        parsed = kernel_of_text(path)
        names = {parsed.name: parsed}
    if name is not None:
        return {name: _one(name, names, path)}
    if "outputs" in names:
        return {"outputs": _named(names["outputs"], path)}
    targets = {name: value for name, value in names.items() if isinstance(value, pg.Target) and value.made_by}
    if targets:
        return {"targets": targets}
    effects = _effects(names, path)
    if effects:
        return effects
    kernels = [value for value in names.values() if isinstance(value, PixelKernel)]
    if not kernels:
        raise InputError(f"{path}: has neither outputs nor targets nor kernels (@pg.kernel) at the top of the module")
    return {kernel.name: _alone(kernel) for kernel in kernels}


def names_of(path: Path) -> dict[str, Any]:
    """Run a user's Python module and return its top-level names."""
    check_regular(path, "a Python module")
    return _run(path)


def kernel_of_text(path: Path) -> PixelKernel[Any]:
    """Parse a kernel's text, without running it."""
    text = read_text(path, "a text of kernels", MAX_TEXT_BYTES)
    return PixelKernel(kernel_from_text(text, file=str(path)))


def _one(name: str, names: Mapping[str, Any], path: Path) -> Graph:
    effects, value = _effects(names, path), names.get(name)
    if name in effects:
        return effects[name]
    if isinstance(value, PixelKernel):
        return _alone(value)
    if value is not None and (name == "outputs" or (isinstance(value, pg.Target) and value.made_by)):
        return _named(value, path)
    known = [key for key, one in names.items() if isinstance(one, PixelKernel | pg.Target)] + list(effects)
    raise InputError(f"{path}: has no {shown(name)}{near(name, known)}; it has {', '.join(known) or 'none'}")


def own_effects(names: Mapping[str, Any], path: Path) -> dict[str, Effect]:
    """Return the effects among a module's names (see `passgraph.effects.effect`), without those that it imports."""
    effects: dict[str, Effect] = {}
    for function in names.values():
        mark = getattr(function, "effect", None)
        if isinstance(mark, Mark) and function.__module__ == path.stem:
            place = f"{path}:{function.__name__}"
            effects[mark.name] = Effect(mark.name, place, mark.takes, summary_of(function.__doc__), function)
    return effects


def _effects(names: Mapping[str, Any], path: Path) -> dict[str, Graph]:
    """Return the module's own effects that take pictures, applied to inputs."""
    return {name: on_inputs(one) for name, one in own_effects(names, path).items() if one.takes in TAKEN}


def _needed(parameters: Iterable[EffectParameter], name: str) -> dict[str, pg.Target]:
    """Return inputs for an effect's required pictures; other parameters need a default to be checked."""
    needed = [parameter for parameter in parameters if parameter.required]
    number = next((parameter for parameter in needed if parameter.type != "picture"), None)
    if number is not None:
        raise InputError(f"effect {name}: nothing is made up for its parameter {number.name!r}; give it a default")
    return {parameter.name: pg.Input(parameter.name) for parameter in needed}


def on_inputs(effect: Effect) -> Graph:
    """Apply an effect to inputs named after its parameters."""
    if isinstance(effect, ShaderFileEffect):
        return effect.on_inputs()
    if effect.takes not in TAKEN:
        raise InputError(
            f"effect {effect.name} takes a {effect.takes}, which nothing is made up for; use: passgraph compare "
            f"{effect.name}"
        )
    return named_outputs(effect.build(*map(pg.Input, TAKEN[effect.takes]), **_needed(effect.parameters, effect.name)))


class _AsWritten(SourceFileLoader):
    """A loader without Python's bytecode cache.

    The cache compares a file's size and its modification time in seconds, which miss a quick change of one digit.
    """

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.get_data(self.path), self.path)


def _run(path: Path) -> dict[str, Any]:
    spec = spec_from_file_location(path.stem, path, loader=_AsWritten(path.stem, str(path)))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    # Dataclasses and type hints look up their module by name; a module of this name from another file stays.
    known = sys.modules.get(path.stem)
    if known is None or isinstance(getattr(known.__spec__, "loader", None), _AsWritten):
        sys.modules[path.stem] = module
    # It may import files in its folder, as when it is run as a script.
    sys.path.insert(0, str(path.resolve().parent))
    try:
        spec.loader.exec_module(module)
    except pg.PassgraphError:
        raise
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"while {path} was run") from None
    except SystemExit as error:
        raise InputError(f"{path}: ends the process when it is run ({_exit_call(error)}); take that out") from error
    except Exception as error:
        raise InputError(f"{path}: fails when run: {type(error).__name__}: {error}{_line(error, path)}") from error
    finally:
        sys.path.pop(0)
    return {name: value for name, value in vars(module).items() if not name.startswith("_")}


def _line(error: Exception, path: Path) -> str:
    """Return the last line of the file in an error's traceback; the text of a SyntaxError has it already."""
    numbers = [place.lineno for place in extract_tb(error.__traceback__) if place.filename == str(path)]
    return "" if not numbers or isinstance(error, SyntaxError) else f" (line {numbers[-1]})"


def _exit_call(error: SystemExit) -> str:
    return "sys.exit()" if error.code is None else f"sys.exit({shown(error.code)})"


def _named(outputs: Any, path: Path) -> Graph:
    if isinstance(outputs, (pg.Target, TargetSpec, Mapping, list, tuple)):
        return named_outputs(outputs)
    raise InputError(f"{path}: outputs must be a target, several, or a mapping, got {type(outputs).__name__}")


def _alone(kernel: PixelKernel[Any]) -> Graph:
    """Apply a kernel to inputs named after its images.

    Numbers without a default are the middle of their ranges, else 0.5, or 1 for ints. All but ``Const`` parameters are
    run values, which ``--set`` may set.
    """
    given: dict[str, Any] = {}
    for parameter in kernel.parameters:
        default = parameter.default if parameter.has_default else _ranged(parameter)
        plain = isinstance(innermost(parameter.type), (Scalar, Vector, Matrix))
        run_value = plain and not parameter.const
        given[parameter.name] = pg.Value(parameter.name, default=default) if run_value else default
    return named_outputs(kernel(**given))


def _ranged(parameter: Parameter) -> Any:
    """Return a value for a parameter without a default: the middle of its range, if it has one."""
    limits, type_ = parameter.range, parameter.type
    if limits is None:
        return _argument(parameter.name, type_)
    low, high = ends(limits, type_)
    middle = (low + high) / 2 if isfinite(low) and isfinite(high) else low if isfinite(low) else high
    one = middle if element_of(type_) is FLOAT else int(middle)
    if limits.odd:
        one = 2 * (int(one) // 2) + 1
    number = min(max(one, low), high) if isfinite(middle) else 1
    return number if isinstance(type_, Scalar) else np.full(component_count(type_), number)


def _argument(name: str, type_: Type) -> Any:
    if isinstance(type_, ImageType):
        return pg.Input(name)
    if isinstance(type_, Scalar):
        return {"float": 0.5, "int": 1, "uint": 1, "bool": True}[type_.name]
    if isinstance(type_, Vector):
        return (_argument(name, type_.element),) * type_.size
    if isinstance(type_, Matrix):
        return [[float(row == column) for column in range(type_.columns)] for row in range(type_.rows)]
    if isinstance(type_, Array):
        return [_argument(name, type_.element)] * type_.length
    assert isinstance(type_, Struct)
    raise InputError(f"parameter {name!r} is a {type_}; give it a default, or write outputs = … with its value")
