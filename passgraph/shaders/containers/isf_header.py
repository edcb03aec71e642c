"""What the header of an ISF file says: a JSON object in the first comment (Interactive Shader Format, version 2)."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.graph.formulas import Formula
from passgraph.language.types import BOOL, FLOAT, INT, VEC2, VEC4, Scalar, Type, Vector, component_count
from passgraph.shaders.containers.effect import ShaderParameter
from passgraph.shaders.containers.isf_sizes import size_formula

MAX_INPUTS, MAX_PASSES, MAX_IMPORTED = 256, 64, 32
_HEADER = re.compile(r"\s*/\*(.*?)\*/", re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w{0,63}")
#: Type of an input → that of its uniform; None for pictures.
_TYPES: dict[str, Type | None] = {
    "float": FLOAT, "bool": BOOL, "event": BOOL, "long": INT, "point2d": VEC2, "color": VEC4,
    "image": None, "audio": None, "audiofft": None, "cube": None,
}  # fmt: skip


@dataclass(frozen=True)
class IsfPass:
    """One pass: its buffer (empty for the picture itself), that buffer's size (None for the picture's), and more."""

    target: str
    size: tuple[str, str]
    persistent: bool
    is_float: bool

    def formulas(self, values: Mapping[str, Any], where: str) -> tuple[Formula, Formula] | None:
        """Its size as formulas, once parameters are known."""
        if not any(self.size):
            return None
        width, height = (text or name for text, name in zip(self.size, ("$WIDTH", "$HEIGHT"), strict=True))
        return size_formula(width, values, f"{where}: WIDTH"), size_formula(height, values, f"{where}: HEIGHT")


@dataclass(frozen=True)
class IsfHeader:
    """An ISF header."""

    description: str
    credit: str
    parameters: Mapping[str, ShaderParameter]
    images: tuple[str, ...]
    imported: Mapping[str, object]  # name → path
    passes: tuple[IsfPass, ...]


def is_isf(text: str) -> bool:
    """Whether a text begins with a comment that holds an object."""
    found = _HEADER.match(text)
    return found is not None and found[1].lstrip().startswith("{")


def read_header(text: str, file: str) -> IsfHeader:
    """The header of an ISF file.

    Raises
    ------
    InputError
        For what is not JSON, with line and column, and for entries that ISF does not have.
    """
    found = _HEADER.match(text)
    if found is None:
        raise InputError(f"{file}: an ISF file begins with a comment that holds a JSON object")
    try:
        said = json.loads(found[1])
    except json.JSONDecodeError as error:
        before = text[: found.start(1) + error.pos]
        line, column = before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
        shown_line = text.splitlines()[line - 1] if line <= len(text.splitlines()) else ""
        raise InputError(
            f"{file}:{line}: the header is no JSON: {error.msg}\n    {shown_line}\n    {' ' * (column - 1)}^"
        ) from None
    except RecursionError:
        raise InputError(f"{file}: the header nests too deeply") from None
    return _header(_object(said, f"{file}: the header"), file)


def _header(said: Mapping[str, Any], file: str) -> IsfHeader:
    parameters: dict[str, ShaderParameter] = {}
    images: list[str] = []
    for number, given in enumerate(_list(said.get("INPUTS", []), f"{file}: INPUTS", MAX_INPUTS)):
        where = f"{file}: INPUTS[{number}]"
        one = _object(given, where)
        name = _name(one.get("NAME"), where)
        if name in parameters or name in images:
            raise InputError(f"{where}: there are two inputs {name!r}")
        kind = str(one.get("TYPE", "")).lower()
        if kind not in _TYPES:
            raise InputError(f"{where}: TYPE is one of {', '.join(_TYPES)}; got {shown(one.get('TYPE'))}")
        type_ = _TYPES[kind]
        if type_ is None:
            images.append(name)
        else:
            parameters[name] = _parameter(name, type_, one, where)
    passes = tuple(
        _pass(_object(one, f"{file}: PASSES[{i}]"), f"{file}: PASSES[{i}]")
        for i, one in enumerate(_list(said.get("PASSES", []), f"{file}: PASSES", MAX_PASSES))
    )
    # The frame comes first, whatever stands before it.
    images.sort(key=lambda name: name != "inputImage")
    return IsfHeader(
        str(said.get("DESCRIPTION", "")), str(said.get("CREDIT", "")), parameters, tuple(images),
        _imported(said.get("IMPORTED", {}), file), passes or (IsfPass("", ("", ""), False, False),),
    )  # fmt: skip


def _parameter(name: str, type_: Scalar | Vector | Type, one: Mapping[str, Any], where: str) -> ShaderParameter:
    low, high = (_limit(one.get(key), type_, f"{where}: {key}") for key in ("MIN", "MAX"))
    choices: dict[str, int] = {}
    if type_ is INT and "VALUES" in one:
        values = [int(_number(v, f"{where}: VALUES")) for v in _list(one["VALUES"], f"{where}: VALUES", 4096)]
        labels = [str(label) for label in _list(one.get("LABELS", []), f"{where}: LABELS", 4096)]
        labels += [str(value) for value in values[len(labels) :]]
        choices = dict(zip(labels, values, strict=False))
    if "DEFAULT" in one:
        default = _default(one["DEFAULT"], type_, f"{where}: DEFAULT")
    elif choices:
        default = next(iter(choices.values()))
    elif type_ is FLOAT and low is not None and low > 0:
        default = low
    else:
        default = _default(0, type_, where)
    if type_ is BOOL:
        low = high = None
    # A default beyond its range is what hosts begin with, so that the range reaches to it.
    if isinstance(default, (int, float)):
        low = low if low is None else min(low, default)
        high = high if high is None else max(high, default)
    return ShaderParameter(name, type_, default, low, high, str(one.get("LABEL", "")), choices)


def _default(given: Any, type_: Type, where: str) -> Any:
    count = component_count(type_)
    if count == 1:
        number = _number(given, where)
        return bool(number) if type_ is BOOL else int(number) if type_ is INT else float(number)
    parts = given if isinstance(given, list) else [given] * count
    numbers = [float(_number(part, where)) for part in parts[:count]]
    # Colours may lack their alpha.
    return tuple(numbers + [1.0] * (count - len(numbers)))


def _limit(given: Any, type_: Type, where: str) -> Any:
    if given is None or type_ is BOOL:
        return None
    count = component_count(type_)
    if isinstance(given, list) and count > 1:
        if len(given) < count:
            raise InputError(f"{where} must be {count} numbers, got {shown(given)}")
        return tuple(float(_number(part, where)) for part in given[:count])
    return float(_number(given, where))


def _pass(one: Mapping[str, Any], where: str) -> IsfPass:
    one = {key.upper(): value for key, value in one.items()}
    target = one.get("TARGET", "")
    if target:
        target = _name(target, where)
    sizes = tuple(str(one.get(key, "")) for key in ("WIDTH", "HEIGHT"))
    return IsfPass(target, (sizes[0], sizes[1]), _flag(one.get("PERSISTENT")), _flag(one.get("FLOAT")))


def _imported(said: Any, file: str) -> dict[str, object]:
    """By name: version 2 has an object, version 1 a list."""
    where = f"{file}: IMPORTED"
    if isinstance(said, list):
        rows = [_object(one, where) for one in _list(said, where, MAX_IMPORTED)]
        return {_name(one.get("NAME"), where): one.get("PATH") for one in rows}
    found = _object(said, where)
    if len(found) > MAX_IMPORTED:
        raise InputError(f"{where}: {len(found)} pictures; at most {MAX_IMPORTED}")
    return {_name(name, where): _object(one, where).get("PATH") for name, one in found.items()}


def _flag(given: Any) -> bool:
    return given is True or str(given).lower() in ("1", "1.0", "true", "yes")


def _object(given: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(given, dict):
        raise InputError(f"{where} must be an object, got {shown(given)}")
    return given


def _list(given: Any, where: str, most: int) -> list[Any]:
    if not isinstance(given, list):
        raise InputError(f"{where} must be a list, got {shown(given)}")
    if len(given) > most:
        raise InputError(f"{where} has {len(given)} entries; at most {most}")
    return given


def _name(given: Any, where: str) -> str:
    if not isinstance(given, str) or not _NAME.fullmatch(given):
        raise InputError(f"{where}: a name has letters, digits and underscores, got {shown(given)}")
    return given


def _number(given: Any, where: str) -> float:
    try:
        number = float(given)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not abs(number) < 3.4e38:
        raise InputError(f"{where} must be a number, got {shown(given)}")
    return number
