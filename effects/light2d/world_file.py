"""Flat worlds as JSON files: parsed, validated and bounded, never executed."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from math import isfinite, radians
from os import PathLike
from typing import Any, TypeVar

import passgraph as pg
from passgraph import arguments
from passgraph.effects.annotations import check_fields
from passgraph.effects.light2d.sprites import Mover
from passgraph.effects.light2d.world import Light2D, Point, Wall, Window
from passgraph.effects.quantities import Color
from passgraph.reading import read_text

Made = TypeVar("Made")
MAX_FILE_BYTES = 4 << 20
MAX_WALLS = 4096
MAX_CORNERS = 65536
MAX_LIGHTS = 1024
MAX_MOVERS = 32


@dataclass(frozen=True, slots=True)
class World2D:
    """A flat world.

    Attributes
    ----------
    window : the part shown in pictures
    walls, lights, movers : obstacles, lamps, and things whose shadows are sprites
    ambient : linear RGB of ambient light
    floor : linear RGB of the floor
    """

    window: Window
    walls: tuple[Wall, ...] = ()
    lights: tuple[Light2D, ...] = ()
    movers: tuple[Mover, ...] = ()
    ambient: Color = (0.02, 0.02, 0.03)
    floor: Color = (0.5, 0.47, 0.42)

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> World2D:
        """Load a world from a JSON file.

        An object of: ``window`` [left, bottom, right, top], y up, required; ``ambient`` and ``floor`` [r, g, b],
        linear; ``walls``, a list of {"box": [left, bottom, right, top]}, {"polygon": [[x, y], …]}, closed, or
        {"path": [[x, y], …]}, open; ``lights``, a list of {"at": [x, y], "radius": …, "size": …, "color": [r, g, b]},
        see `Light2D`; ``movers``, a list of {"at": [x, y], "half": [width, height], "angle_deg": …}, see `Mover`.
        At most 4 MiB, 4096 walls with 65,536 corners together, 1024 lights, 32 movers.

        Raises
        ------
        passgraph.InputError
            For an invalid file, with the file and the position in it.
        """
        path = arguments.path(path, "the world to load")
        text = read_text(path, "a world file", MAX_FILE_BYTES)
        try:
            given = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise pg.InputError(f"{path}: is not JSON ({error})") from error
        return world_from(given, str(path))

    @classmethod
    def shipped(cls) -> World2D:
        """Return the world that comes with passgraph.

        >>> len(World2D.shipped().lights)
        4
        """
        text = (files("passgraph.assets") / "world2d.json").read_text(encoding="utf-8")
        return world_from(json.loads(text), "world2d.json")

    def fitted(self, size: tuple[int, int]) -> Window:
        """Return the window, extended about its center until pixels are square.

        >>> World2D(Window(0, 0, 4, 4)).fitted((8, 4))
        Window(left=-2.0, bottom=0.0, right=6.0, top=4.0)
        """
        w = self.window
        unit = max((w.right - w.left) / size[0], (w.top - w.bottom) / size[1])
        x, y = 0.5 * (w.left + w.right), 0.5 * (w.bottom + w.top)
        half = 0.5 * unit * size[0], 0.5 * unit * size[1]
        return Window(x - half[0], y - half[1], x + half[0], y + half[1])


def world_from(given: object, where: str) -> World2D:
    """Return a world from parsed JSON; ``where`` begins error messages."""
    root = _object(given, where, {"window"}, {"walls", "lights", "movers", "ambient", "floor"})
    window = _numbers(root["window"], 4, f"{where}: window")
    walls = tuple(_wall(item, at) for item, at in _items(root, "walls", MAX_WALLS, where))
    if sum(len(wall.points) for wall in walls) > MAX_CORNERS:
        raise pg.InputError(f"{where}: walls have more than {MAX_CORNERS} corners together")
    lights = tuple(_light(item, at) for item, at in _items(root, "lights", MAX_LIGHTS, where))
    movers = tuple(_mover(item, at) for item, at in _items(root, "movers", MAX_MOVERS, where))
    colors = {name: _color(root[name], f"{where}: {name}") for name in ("ambient", "floor") if name in root}
    return _checked(where, lambda: World2D(Window(*window), walls, lights, movers, **colors))


def _wall(given: object, where: str) -> Wall:
    one = _object(given, where, set(), {"box", "polygon", "path"})
    if len(one) != 1:
        raise pg.InputError(f"{where}: needs one of box, polygon, path, got {', '.join(one) or 'none'}")
    if "box" in one:
        left, bottom, right, top = _numbers(one["box"], 4, f"{where}.box")
        if not (left < right and bottom < top):
            raise pg.InputError(f"{where}.box: needs left < right and bottom < top")
        return Wall.box(left, bottom, right, top)
    kind, points = next(iter(one.items()))
    if not isinstance(points, list) or not 2 <= len(points) <= MAX_CORNERS:
        raise pg.InputError(f"{where}.{kind}: expected a list of 2 to {MAX_CORNERS} points [x, y]")
    corners = tuple(_point(point, f"{where}.{kind}[{n}]") for n, point in enumerate(points))
    return _checked(where, lambda: Wall(corners, closed=kind == "polygon"))


def _light(given: object, where: str) -> Light2D:
    one = _object(given, where, {"at"}, {"radius", "size", "color"})
    numbers = {name: _number(one[name], f"{where}.{name}") for name in ("radius", "size") if name in one}
    color = _color(one["color"], f"{where}.color") if "color" in one else (1.0, 1.0, 1.0)
    return _checked(where, lambda: Light2D(_point(one["at"], f"{where}.at"), color, **numbers))


def _mover(given: object, where: str) -> Mover:
    one = _object(given, where, {"at"}, {"half", "angle_deg"})
    half = _point(one.get("half", [0.5, 0.5]), f"{where}.half")
    if min(half) <= 0.0:
        raise pg.InputError(f"{where}.half: must be above 0")
    return Mover(
        _point(one["at"], f"{where}.at"), half, radians(_number(one.get("angle_deg", 0), f"{where}.angle_deg"))
    )


def _object(given: object, where: str, needed: set[str], allowed: set[str]) -> Mapping[str, Any]:
    if not isinstance(given, dict):
        raise pg.InputError(f"{where}: expected an object, got {type(given).__name__}")
    unknown = [name for name in given if name not in needed | allowed]
    if unknown:
        raise pg.InputError(f"{where}: unknown {unknown[0]!r}; there are {', '.join(sorted(needed | allowed))}")
    for name in sorted(needed - given.keys()):
        raise pg.InputError(f"{where}: {name} is missing")
    return given


def _items(root: Mapping[str, Any], name: str, most: int, where: str) -> list[tuple[object, str]]:
    given = root.get(name, [])
    if not isinstance(given, list) or len(given) > most:
        got = f"{len(given)}" if isinstance(given, list) else type(given).__name__
        raise pg.InputError(f"{where}: {name} must be a list of at most {most}, got {got}")
    return [(item, f"{where}: {name}[{number}]") for number, item in enumerate(given)]


def _number(given: object, where: str) -> float:
    # JSON's integers may be too large for floats
    if isinstance(given, bool) or not isinstance(given, (int, float)) or not abs(given) < 1e9 or not isfinite(given):
        raise pg.InputError(f"{where}: expected a number of magnitude below 1e9, got {str(given)[:40]!r}")
    return float(given)


def _numbers(given: object, count: int, where: str) -> tuple[float, ...]:
    if not isinstance(given, list) or len(given) != count:
        raise pg.InputError(f"{where}: expected {count} numbers in a list")
    return tuple(_number(value, f"{where}[{n}]") for n, value in enumerate(given))


def _point(given: object, where: str) -> Point:
    x, y = _numbers(given, 2, where)
    return x, y


def _color(given: object, where: str) -> Color:
    r, g, b = _numbers(given, 3, where)
    if min(r, g, b) < 0.0:
        raise pg.InputError(f"{where}: must be 0 or more")
    return r, g, b


def _checked(where: str, make: Callable[[], Made]) -> Made:
    """Call a constructor; an error names the place in the file."""
    try:
        return make()
    except pg.GraphError as error:
        raise pg.InputError(f"{where}: {error}") from error
