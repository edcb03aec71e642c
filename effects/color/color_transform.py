"""Color transforms of OpenColorIO: color spaces, displays and views, looks and LUT files, as one fusible pass."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import passgraph as pg
from passgraph.arguments import near
from passgraph.color_tags import ColorSpace
from passgraph.effects.checked import effect
from passgraph.effects.color.ocio_files import LutFiles, advice_on
from passgraph.effects.parameters import Text
from passgraph.effects.quantities import Exposure

if TYPE_CHECKING:
    import PyOpenColorIO as ocio

#: Used where neither ``config`` nor the environment variable OCIO names one: OpenColorIO's built-in default.
DEFAULT_CONFIG = "ocio://default"
Words = Annotated[str, Text()]
Contrast = Annotated[float, pg.Range(0.001, 100)]
#: Names of color spaces, views or configs that an error lists.
MOST_NAMED = 12
#: Scene-linear middle gray, about which contrast turns.
MIDDLE_GRAY = 0.18


def _result_space(
    src: str | None = None,
    dst: str | None = None,
    display: str | None = None,
    view: str | None = None,
    look: str | None = None,
    file: str | None = None,
    direction: str = "forward",
    config: str | None = None,
    **_: object,
) -> ColorSpace | None:
    """Return the color space of the results of `color_transform` with these parameters; None if it is the source's."""
    if file is not None:
        return ColorSpace(f"of LUT {file}")
    found = _config(config)
    if not (dst or display or look):
        display = found.getDefaultDisplay()
    result = dst
    if display is not None:
        result = found.getDisplayViewColorSpaceName(display, view or found.getDefaultView(display))
        result = display if result == _OF_THE_DISPLAY else result
    if result is None:
        return None  # a look alone
    source = src or _library().ROLE_SCENE_LINEAR
    return converted_space(found, *((source, result) if direction == "forward" else (result, source)))


#: OpenColorIO's name of a shared view's color space, which is the one with the display's name.
_OF_THE_DISPLAY = "<USE_DISPLAY_NAME>"


def converted_space(config: ocio.Config, source: str, result: str) -> ColorSpace | None:
    """Return the color space ``result`` of a config; None if a conversion from ``source`` changes nothing."""
    before, after = _found(config, source), _found(config, result)
    if after is None or after.isData() or (before is not None and before.getName() == after.getName()):
        return None
    return ColorSpace(after.getName(), after.getInteropID())


def space_between(source: str, result: str, config: str | None) -> ColorSpace | None:
    """Return the color space ``result`` of a config that `color_transform` takes, as `converted_space`."""
    return converted_space(_config(config), source, result)


@effect("color-transform", result_space=_result_space)
def color_transform(
    frame: pg.Target,
    src: Words | None = None,
    dst: Words | None = None,
    display: Words | None = None,
    view: Words | None = None,
    look: Words | None = None,
    file: Words | None = None,
    direction: Literal["forward", "inverse"] = "forward",
    interpolation: Literal["best", "linear", "nearest"] = "best",
    exposure_stops: Exposure | pg.Value | pg.Derived = 0.0,
    contrast: Contrast | pg.Value | pg.Derived = 1.0,
    gamma: Contrast | pg.Value | pg.Derived = 1.0,
    config: Words | None = None,
    into: pg.TargetSpec | None = None,
    name: str = "color_transform",
) -> pg.Target:
    """Convert to another color space, a display and view, or through a LUT file, by OpenColorIO.

    Name what the picture is in (``src``) and one of ``dst``, ``display`` or ``file``; ``look`` goes with ``dst`` and
    ``display``, or alone. Where nothing is named, the picture is for the default display. It needs the extra ``color``
    (``pip install 'passgraph[color]'``).

    Parameters
    ----------
    frame : alpha is not associated and stays as it is
    src : color space of the picture, a name, alias or role of the config; left out, the role scene_linear
    dst : color space of the result
    display : display that the result is for; with neither dst, look nor file, the config's default display
    view : view of that display; left out, the display's default view
    look : look of the config, or several with commas, as OpenColorIO writes them
    file : path of a LUT or transform file: .cube .3dl .csp .spi1d .spi3d .spimtx .clf .ctf .cdl .cc .ccc .lut …
    direction : "inverse" undoes the transform
    interpolation : of LUT files: "best" is tetrahedral for 3-D tables and linear for others; "nearest" is linear in
        OpenColorIO: trilinear for 3-D tables
    exposure_stops : added in scene-linear light before the transform of a display, factor 2 a stop
    contrast : power about middle gray (0.18) in scene-linear light, before the transform of a display
    gamma : 1/gamma is the power that the display's code values are raised to, after the transform of a display
    config : path of a config file, or "ocio://" and the name of a built-in one; left out, that of the environment
        variable OCIO, else OpenColorIO's default
    into : where it goes; left out, a float32 target with the name ``name``
    name : of the pass

    Source: OpenColorIO 2, Academy Software Foundation. Its lossless GPU shader is translated; results agree with its
    lossless CPU processor, see docs/color.md.

    Examples
    --------
    >>> import numpy as np
    >>> linear = color_transform(pg.Input("frame"), src="sRGB - Texture", dst="Linear Rec.709 (sRGB)")
    >>> with pg.compile(linear) as program:
    ...     picture = program(frame=np.full((1, 1, 4), 0.5, np.float32))["color_transform"]
    >>> picture[0, 0].round(4).tolist() == [np.float32(0.214)] * 3 + [0.5]
    True
    """
    ocio = _library()
    found = _config(config)
    if not (dst or display or look or file):
        display = found.getDefaultDisplay()
    steps = {"exposure_stops": (exposure_stops, 0.0), "contrast": (contrast, 1.0), "gamma": (gamma, 1.0)}
    changed = {step: value for step, (value, neutral) in steps.items() if not _is_same(value, neutral)}
    if changed and display is None:
        raise pg.GraphError(
            f"color_transform: {', '.join(changed)} goes with display=; name a display, or leave it out"
        )
    try:
        named = _Named(src, dst, display, view, look, file, interpolation)
        transform = _transform(found, named, frozenset(changed))
        way = ocio.TRANSFORM_DIR_FORWARD if direction == "forward" else ocio.TRANSFORM_DIR_INVERSE
        processor = _LUT_FILES.processor(found, transform, way)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        advice = "" if file is None else advice_on(file)
        raise pg.GraphError(f"color_transform: {' '.join(str(error).split())}{advice}") from None
    from passgraph.shaders.containers.ocio import read_processor

    kernel = read_processor(processor, name)
    uniforms = {_UNIFORMS[step]: value for step, value in changed.items()}
    return kernel(frame, into or pg.target(name, "rgba32f"), uniforms)


_LUT_FILES = LutFiles()
#: What OpenColorIO calls the uniforms of its exposure and contrast transform.
_UNIFORMS = {
    "exposure_stops": "ocio_exposure_contrast_exposureVal",
    "contrast": "ocio_exposure_contrast_contrastVal",
    "gamma": "ocio_exposure_contrast_gammaVal",
}


def _is_same(value: object, neutral: float) -> bool:
    return not isinstance(value, (pg.Value, pg.Derived)) and value == neutral


def _library() -> Any:
    try:
        import PyOpenColorIO
    except ImportError as error:
        raise pg.GraphError(f"color_transform: needs OpenColorIO ({error}); pip install 'passgraph[color]'") from None
    return PyOpenColorIO


def _config(named: str | None) -> ocio.Config:
    ocio = _library()
    path = named or os.environ.get("OCIO") or DEFAULT_CONFIG
    try:
        return ocio.Config.CreateFromFile(path)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        built_in = [row[0] for row in ocio.BuiltinConfigRegistry().getBuiltinConfigs()]
        hint = near(path.removeprefix("ocio://"), built_in) or f"; built-in ones are ocio:// and {_some(built_in)}"
        raise pg.GraphError(f"color_transform: config {path!r} cannot be read: {error}{hint}") from None


@dataclass(frozen=True)
class _Named:
    """What the caller named, as for :func:`color_transform`."""

    src: str | None
    dst: str | None
    display: str | None
    view: str | None
    look: str | None
    file: str | None
    interpolation: str


def _transform(config: ocio.Config, named: _Named, changed: frozenset[str]) -> ocio.Transform:
    """Return the transform that was named; raise GraphError for names that the config does not have.

    ``changed`` are the steps of a display that have run values: exposure_stops, contrast and gamma.
    """
    ocio = _library()
    goals = [word for word in ("dst", "display", "file") if getattr(named, word) is not None]
    if len(goals) > 1:
        raise pg.GraphError(f"color_transform: takes one of dst, display and file; got {', '.join(goals)}")
    if named.file is not None:
        return _file_transform(named, named.file)
    source = _color_space(config, named.src or ocio.ROLE_SCENE_LINEAR)
    if named.look is not None:
        for word in named.look.replace(",", " ").replace(":", " ").split():
            _among("look", word.lstrip("+-"), [*config.getLookNames()])
    if named.display is not None:
        return _display_transform(config, named, named.display, source, changed)
    target = source if named.dst is None else _color_space(config, named.dst)
    if named.look is not None:
        return ocio.LookTransform(src=source, dst=target, looks=named.look)
    return ocio.ColorSpaceTransform(src=source, dst=target)


def _file_transform(named: _Named, file: str) -> ocio.Transform:
    ocio = _library()
    if named.src or named.look:
        raise pg.GraphError("color_transform: a LUT file knows no color spaces; leave src and look out")
    if not os.path.isfile(file):
        raise pg.GraphError(f"color_transform: there is no file {file}")
    kinds = {"best": ocio.INTERP_BEST, "linear": ocio.INTERP_LINEAR, "nearest": ocio.INTERP_NEAREST}
    return ocio.FileTransform(src=os.path.abspath(file), interpolation=kinds[named.interpolation])


def _display_transform(
    config: ocio.Config, named: _Named, display: str, source: str, changed: frozenset[str]
) -> ocio.Transform:
    """Return the looks, the changed exposure and contrast, a display's view, and the changed gamma, in this order."""
    ocio = _library()
    _among("display", display, [*config.getDisplays()])
    shown = named.view or config.getDefaultView(display)
    _among(f"view of {display!r}", shown, [*config.getViews(display)])
    steps = ocio.GroupTransform()
    if named.look is not None:
        steps.appendTransform(ocio.LookTransform(src=source, dst=source, looks=named.look))
    if changed - {"gamma"}:
        linear = ocio.ROLE_SCENE_LINEAR
        steps.appendTransform(ocio.ColorSpaceTransform(src=source, dst=linear))
        steps.appendTransform(
            ocio.ExposureContrastTransform(
                ocio.EXPOSURE_CONTRAST_LINEAR,
                pivot=MIDDLE_GRAY,
                dynamicExposure="exposure_stops" in changed,
                dynamicContrast="contrast" in changed,
            )
        )
        source = linear
    bypass = named.look is not None
    steps.appendTransform(ocio.DisplayViewTransform(src=source, display=display, view=shown, looksBypass=bypass))
    if "gamma" in changed:
        steps.appendTransform(
            ocio.ExposureContrastTransform(ocio.EXPOSURE_CONTRAST_LINEAR, pivot=1.0, dynamicGamma=True)
        )
    return steps


def _found(config: ocio.Config, name: str) -> ocio.ColorSpace | None:
    """Return a color space by its name, an alias or a role; None for other texts, also those that are no UTF-8."""
    return config.getColorSpace(name) if name.isprintable() else None


def _color_space(config: ocio.Config, name: str) -> str:
    if _found(config, name) is None:
        _among("color space", name, [*config.getColorSpaceNames(), *config.getRoleNames()])
    return name


def _among(what: str, name: str, known: list[str]) -> None:
    if name not in known:
        hint = near(name, known) or f"; it has {_some(known)}"
        raise pg.GraphError(f"color_transform: the config has no {what} {name!r}{hint}")


def _some(names: list[str]) -> str:
    """The first names of a list, as many as an error shows."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more
