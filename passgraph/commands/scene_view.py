"""The view of a scene for ``passgraph render``: camera, light and ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import zip_longest
from math import degrees, fmod, radians
from pathlib import Path
from typing import Any, Literal

import click

from passgraph.arguments import shown
from passgraph.commands.command_graph import load_scene
from passgraph.commands.options import FiniteRange, together
from passgraph.errors import InputError
from passgraph.scene import Camera, Light, Scene
from passgraph.scene.camera import DEFAULT_AZIMUTH_RAD, DEFAULT_ELEVATION_RAD, DEFAULT_FOV_RAD
from passgraph.scene.ground import lacks_ground, seeing_floors
from passgraph.scene.lights import exposed
from passgraph.scene.matrices import MOST_RADIUS

Ground = Literal["auto", "none", "plane"]
#: Values of ``--ground``: with or without a floor; None if the scene decides.
_GROUNDS: dict[Ground, bool | None] = {"auto": None, "none": False, "plane": True}
Color = tuple[float, float, float]
#: Limits of the angle of view, in degrees.
FOV = (0.1, 170.0)


@dataclass(frozen=True)
class View:
    """View options; None if not given. Angles are in degrees."""

    azimuth: float | None = None
    elevation: float | None = None
    distance: float | None = None
    zoom: float | None = None
    fov: float | None = None
    camera: str | None = None
    up: Literal["y", "z"] | None = None
    light: str | None = None
    light_azimuth: float | None = None
    light_elevation: float | None = None
    light_radius: float | None = None
    light_color: Color | None = None
    ground: Ground | None = None
    two_sided: bool | None = None
    turntable: int | None = None

    def given(self) -> list[str]:
        """Return the given options, as written."""
        return [f"--{name.replace('_', '-')}" for name, value in vars(self).items() if value is not None]

    @property
    def placing(self) -> list[str]:
        """Return the given options that place a new camera."""
        return [f for f in self.given() if f in ("--azimuth", "--elevation", "--distance", "--turntable")]


#: Names of the options.
VIEW_FIELDS = tuple(field.name for field in fields(View))


def refuse_view(view: View, effect: str) -> None:
    """Raise InputError if view options are given for a flat world."""
    if view.given():
        raise InputError(f"effect {effect} draws a flat world, which takes no {', '.join(view.given())}; leave it out")


_ANGLE: dict[str, Any] = {"type": FiniteRange(), "metavar": "DEG"}
#: The options of a `View`; the command gets them by its fields' names.
view_options = together(
    click.option("--azimuth", **_ANGLE, help="Direction of the camera: 0 in front (+z), 90 on the right (+x)."),
    click.option(
        "--elevation", type=FiniteRange(-90.0, 90.0), metavar="DEG",
        help=f"Its elevation: 0 level, 90 from above.  [default: azimuth {degrees(DEFAULT_AZIMUTH_RAD):.0f}, "
        f"elevation {degrees(DEFAULT_ELEVATION_RAD):.0f}, or the scene's own camera]",
    ),
    click.option(
        "--distance", type=FiniteRange(0.0, MOST_RADIUS, min_open=True), metavar="LENGTH",
        help="Distance from the camera to the center, scene units.  [default: fits the scene into the picture]",
    ),
    click.option(
        "--zoom", type=FiniteRange(0.0, min_open=True), metavar="FACTOR",
        help="Magnification by the lens.",
    ),
    click.option(
        "--fov", type=FiniteRange(*FOV), metavar="DEG",
        help=f"Vertical angle of view.  [default: {degrees(DEFAULT_FOV_RAD):.0f}]",
    ),
    click.option("--camera", metavar="NAME|NUMBER", help="One of the scene's own cameras.  [default: the first]"),
    click.option(
        "--up", type=click.Choice(["y", "z"]), help="The model's up axis.  [default: z for STL, else y]"
    ),
    click.option("--light", metavar="NAME|NUMBER", help="Use only this light of the scene."),
    click.option("--light-azimuth", **_ANGLE, help="Direction of the light, like --azimuth."),
    click.option(
        "--light-elevation", type=FiniteRange(-90.0, 90.0), metavar="DEG", help="Its elevation; 90: from above."
    ),
    click.option(
        "--light-radius", type=FiniteRange(0.0), metavar="SIZE",
        help="Radius of the light, which softens shadows: of a sun at distance 1 (the real one: 0.0047), of a lamp "
        "in scene units; 0 gives hard shadows.",
    ),
    click.option(
        "--light-color", type=FiniteRange(0.0), nargs=3, metavar="R G B", help="Its linear color; 1 1 1: white."
    ),
    click.option(
        "--ground", type=click.Choice(list(_GROUNDS)),
        help="Floor under the lowest vertex; auto adds one to a scene without.  [default: auto]",
    ),
    click.option(
        "--two-sided", is_flag=True, default=None,
        help="Show both sides of every surface, overriding the model.",
    ),
    click.option(
        "--turntable", type=click.IntRange(1), metavar="FRAMES",
        help="Number of frames once around the scene: numbered files (-o turn.%04d.png) or a video (.mp4, .gif).",
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Seen:
    """A scene with the view options applied, the cameras of its turntable, and notes to print."""

    scene: Scene
    cameras: tuple[Camera, ...] = ()
    lines: tuple[str, ...] = ()


def seen_by(view: View, path: Path | None, size: tuple[int, int]) -> Seen:
    """Read a scene and apply the view options."""
    # the floor is added last: its size depends on the camera, and the camera on the rest of the scene
    scene = load_scene(path, up=view.up, ground=False)
    if view.two_sided:
        scene = scene.two_sided()
    cameras, lines = _cameras(scene, view, size[0] / size[1])
    scene = scene.with_(camera=cameras[0], lights=_lights(scene, view))
    if lacks_ground(scene.nodes, _GROUNDS[view.ground or "auto"]):
        scene = scene.with_ground()
        cameras = [seeing_floors(camera, scene.nodes[-1:]) for camera in cameras]
        lines.append(f"ground: a plane at y = {scene.nodes[-1].bounds[0, 1]:.6g}; --ground none leaves it out")
    return Seen(scene, tuple(cameras if view.turntable else ()), tuple(lines))


# Cameras


def _cameras(scene: Scene, view: View, aspect: float) -> tuple[list[Camera], list[str]]:
    """Return the camera, or those of a turntable, and notes to print."""
    own, lenses = [one.name for one in scene.cameras], [one.lens for one in scene.cameras]
    if view.camera is not None and view.placing:
        raise InputError(
            f"--camera is a view of the scene's own, and {', '.join(view.placing)} would place another; leave out one"
        )
    if view.camera is not None or (own and not view.placing):
        at = chosen("--camera", view.camera or "1", own, "camera", lenses)
        is_ambiguous = view.camera is None and len(own) > 1
        return [_own(scene.cameras[at].camera, view)], [
            f"camera: {_listed(own[:1])} of {len(own)}; --camera NAME or NUMBER chooses"
        ] if is_ambiguous else []
    placed: dict[str, Any] = {"distance": view.distance, "aspect": aspect}
    if view.azimuth is not None:
        placed["azimuth_rad"] = _turn(view.azimuth)
    if view.elevation is not None:
        placed["elevation_rad"] = radians(view.elevation)
    if view.fov is not None:
        placed["vertical_fov_rad"] = radians(view.fov)
    cameras = scene.turntable(view.turntable, **placed) if view.turntable else [scene.seen_from(**placed).camera]
    return [camera.zoomed(view.zoom or 1.0) for camera in cameras], []


def _own(camera: Camera, view: View) -> Camera:
    if view.fov is not None and camera.orthographic:
        raise InputError("--fov is for cameras in perspective, and this one has parallel rays; use --zoom")
    seen = camera if view.fov is None else replace(camera, vertical_fov_rad=radians(view.fov))
    return seen if view.zoom is None else seen.zoomed(view.zoom)


def _turn(degrees: float) -> float:
    """Reduce an angle to less than a full turn and convert it to radians; the reduction is exact in degrees."""
    return radians(fmod(degrees, 360.0))


# Lights


def _lights(scene: Scene, view: View) -> list[Light]:
    """Return the scene's lights, or the chosen or changed one."""
    lights, names = list(scene.lights), [light.name for light in scene.lights]
    if view.light is not None:
        # the exposure is adjusted, so that it is as bright alone as all lights together
        lights = exposed([lights[chosen("--light", view.light, names, "light")]], scene.bounds())
    changes = [flag for flag in view.given() if flag.startswith("--light-")]
    if not changes:
        return lights
    if len(lights) != 1:
        raise InputError(
            f"{', '.join(changes)}: the scene has {len(lights)} lights, {_listed(names)}; say which one with --light"
        )
    (light,) = lights
    if view.light_azimuth is not None or view.light_elevation is not None:
        points = scene.points()
        light = light.around(
            0.5 * (points.min(axis=0) + points.max(axis=0)),
            None if view.light_azimuth is None else _turn(view.light_azimuth),
            None if view.light_elevation is None else radians(view.light_elevation),
        )
    if view.light_radius is not None:
        light = replace(light, radius=view.light_radius)
    return [light if view.light_color is None else replace(light, color=view.light_color)]


# Choices


def chosen(flag: str, given: str, names: Sequence[str], what: str, aliases: Sequence[str] = ()) -> int:
    """Return the chosen item, counted from 0: by name, by alias, or by number from 1.

    >>> chosen("--camera", "side", ["front", "side"], "camera"), chosen("--camera", "1", ["front", "side"], "camera")
    (1, 0)
    >>> chosen("--camera", "wide", ["front", "side"], "camera", ["wide", ""])
    0
    """
    found = [at for at, name in enumerate(names) if name == given]
    found = found or [at for at, name in enumerate(aliases) if name and name == given]
    if len(found) == 1:
        return found[0]
    if not found and given.isascii() and given.isdigit() and len(given) < 9 and 1 <= int(given) <= len(names):
        return int(given) - 1
    if not names:
        raise InputError(f"{flag} {shown(given)}: the scene has no {what} of its own; leave it out")
    wrong = f"{len(found)} have that name" if found else f"the scene has no such {what}"
    raise InputError(f"{flag} {shown(given)}: {wrong}; expected a number or a name of {_listed(names, aliases)}")


def _listed(names: Sequence[str], aliases: Sequence[str] = ()) -> str:
    both = zip_longest(names, aliases, fillvalue="")
    entries = (f"{shown(name)} ({shown(other)})" if other else shown(name) for name, other in both)
    return ", ".join(f"{number} {text}" for number, text in enumerate(entries, 1))
