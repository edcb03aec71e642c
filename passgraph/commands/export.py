"""``passgraph export``: an effect as a folder that runs in a browser, or in Python without its code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.color_spaces import with_straight_alpha
from passgraph.commands.command_graph import (
    RENDER_SIZE,
    accepts,
    effect_output,
    input_of,
    load_depth,
    scene_job,
)
from passgraph.commands.named import KernelEffect
from passgraph.commands.options import (
    EffectCommand,
    complete_effect,
    effect_option,
    given_parameters,
    math_option,
    named_or_refused,
    size_option,
)
from passgraph.commands.running import progress
from passgraph.commands.shader_files import ShaderFileEffect
from passgraph.commands.sound import open_audio, split_sound
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.files.program_folder import export_program
from passgraph.formats import FORMATS
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import Input, Target, named_outputs
from passgraph.language import symbols
from passgraph.language.native import Math
from passgraph.pictures import load_stored, scaled
from passgraph.plan.data import Options
from passgraph.plan.dependencies import inputs_behind, passes_behind
from passgraph.quantise import numbers_of
from passgraph.viewer.subject import Control, Drawing, Loaded, run_values_of
from passgraph.web import Orbit, export_web
from passgraph.web.export import Described

if TYPE_CHECKING:
    from passgraph.shaders.containers.effect import ShaderParameter

#: Kinds of controls whose value kernels and shaders take from run to run, and the type of that value.
_MARKERS: dict[str, object] = {"float": float, "int": int, "bool": bool}


class _Export(EffectCommand):
    """Takes the first argument for the effect, whatever kind of file it is."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and not args[0].startswith("-") and self._named(args) is None:
            args = ["--effect", *args]
        return super().parse_args(ctx, args)


@click.command(cls=_Export)
@click.argument(
    "inputs", metavar="[INPUT...]", nargs=-1, type=click.Path(path_type=Path), shell_complete=complete_effect
)
@effect_option("Effect to export")
@click.option(
    "--web",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder to write: a page, the effect as data, and the modules that run it.",
)
@click.option(
    "--program",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder to write for Python: pg.load_program(DIR) runs it without the effect's code.",
)
@click.option(
    "--orbit",
    is_flag=True,
    help="With --web and a scene: the page turns the camera. Writes a table of poses, which takes seconds.",
)
@click.option(
    "--audio",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="With --web: audio file, or video with sound, that the page plays for a shader that reads sound.",
)
@math_option
@size_option()
@click.option(
    "--linear/--as-stored", default=None, help="Decode pictures from sRGB to linear light first.  [default: by EFFECT]"
)
@click.pass_context
def export(
    ctx: click.Context, /, inputs: tuple[Path, ...], web: Path | None, program: Path | None, orbit: bool,
    audio: Path | None, math: Math, size: tuple[int, int] | None, linear: bool | None, **_: Any,
) -> None:  # fmt: skip
    """Export EFFECT to a folder that runs in a browser with WebGPU (--web), or in Python without its code (--program).

    EFFECT is an effect, a FILE.py of yours (it is run), or a shader file. INPUT is the picture that the page begins
    with, then its depth for effects on depth; a scene for effects that render one. Parameters given here are the
    values that the page begins with. Of a shader that reads sound, the page plays it, with an audio file as INPUT or in
    --audio, or one that the page opens; a shader that reads keys gets those of the page.

    The folder needs no server of its own: python -m http.server --directory DIR. The page loads nothing from elsewhere.
    """
    effect = named_or_refused(ctx, inputs[0] if inputs else None)
    if web is None and program is None:
        raise click.UsageError("expected --web DIR for a page, or --program DIR for Python")
    if orbit and web is None:
        raise click.UsageError("--orbit is for a page; give --web DIR too, or leave it out")
    parameters = given_parameters(ctx)
    pictures, sound = split_sound(effect, tuple(map(str, inputs)), audio)
    inputs = tuple(map(Path, pictures))
    if sound is not None and web is None:
        raise click.UsageError(f"{sound}: a page plays sound; give --web DIR, or leave the sound out")
    open_audio(effect, sound)

    def exported(for_python: bool) -> Exported:
        if effect.takes in ("scene", "world2d"):
            return _of_scene(effect, inputs, size or RENDER_SIZE, dict(parameters))
        return _OfPictures(effect, inputs, size, linear, for_python).exported(parameters)

    if web is not None:
        page = exported(for_python=False)
        described = replace(page.described, signals=effect.signals, sound=sound)
        _write_page(replace(page, described=described), web, math, Orbit() if orbit else None)
    if program is not None:
        _write_program(exported(for_python=True), program, math)


def _write_page(exported: Exported, web: Path, math: Math, orbit: Orbit | None) -> None:
    with progress("exporting") as say:
        written = export_web(
            exported.drawing.outputs,
            web,
            size=exported.drawing.size,
            described=exported.described,
            options=Options(math=math),
            orbit=orbit,
            progress=say,
            **exported.drawing.run_inputs,
        )
    click.echo(f"{web}: {len(written.plan.steps)} passes, {exported.drawing.size[0]}x{exported.drawing.size[1]}")
    if written.values:
        click.echo(f"- the page sets {', '.join(written.values)}")
    if written.poses is not None:
        click.echo(
            f"- the page turns the camera: {' x '.join(map(str, written.poses))} azimuths, elevations, distances"
        )
    if exported.described.signals:
        sound = exported.described.sound
        plays = "" if sound is None else f", and plays {sound}"
        click.echo(f"- the page has {' and '.join(exported.described.signals)} for the shader{plays}")
    if exported.described.fixed:
        click.echo(f"- constant in this export: {', '.join(exported.described.fixed)}")
    if written.constants:
        click.echo(f"- constant in this export, as of one frame: {', '.join(written.constants)}")
    if not written.resizable:
        click.echo("- sizes are fixed: other pictures are scaled to this size")
    click.echo(f"serve it: python -m http.server --bind 127.0.0.1 --directory {web}")


def _write_program(exported: Exported, folder: Path, math: Math) -> None:
    outputs, given = exported.drawing.outputs, exported.drawing.run_inputs
    open_inputs = [name for name, spec in inputs_behind(list(outputs.values())).items() if spec.default is None]
    constants = {name: value for name, value in given.items() if name not in open_inputs}
    export_program(outputs, folder, size=exported.drawing.size, options=Options(math=math), **constants)
    values = [c.name for c in exported.described.controls]
    shown = [*(f"{name}=picture" for name in open_inputs), *(f"{name}=..." for name in values)]
    click.echo(f"{folder}: with pg.load_program({str(folder)!r}) as program: program({', '.join(shown)})")
    if fixed := [*exported.described.fixed, *constants]:
        click.echo(f"- constant in this export: {', '.join(fixed)}")


@dataclass(frozen=True)
class Exported:
    """A graph with what its export is given, and what its page says."""

    drawing: Drawing
    described: Described


def _of_scene(
    effect: Effect, inputs: Sequence[Path], size: tuple[int, int], parameters: dict[str, Any]
) -> Exported:  # fmt: skip
    """Return an effect on a scene: its parameters, camera and lights are constants."""
    if len(inputs) > 1:
        raise InputError(f"effect {effect.name} takes one {effect.takes}; got {len(inputs)} inputs")
    if accepts(effect, "display"):
        parameters.setdefault("display", True)
    job = scene_job(effect, inputs[0] if inputs else None, size, parameters)
    fixed = {p.name: parameters.get(p.name, p.default) for p in effect.parameters}
    return Exported(Drawing(job.outputs, size, job.given), Described(effect.name, effect.summary, fixed=fixed))


class _OfPictures:
    """An effect on pictures, or one that makes its own, whose inputs stay open."""

    def __init__(
        self, effect: Effect, inputs: Sequence[Path], size: tuple[int, int] | None, linear: bool | None,
        for_python: bool,
    ) -> None:  # fmt: skip
        self.effect, self.is_linear = effect, effect.linear if linear is None else linear
        # A browser has pictures of 8 bits; Python has those of every format.
        self.formats = ("srgb", None) if for_python else ("rgba8_srgb", "rgba8")
        most = {"picture": 1, "picture+depth": 2}.get(effect.takes, 0)
        if len(inputs) > most:
            raise InputError(
                f"effect {effect.name} takes {most or 'no'} INPUT, got {len(inputs)}; leave out {inputs[-1]}"
            )
        self.pictures: dict[str, Any] = {}
        if inputs:
            self.pictures["frame"] = load_rgba8(inputs[0])
        if len(inputs) > 1:
            self.pictures["depth"] = load_depth(inputs[1])
        shapes = [picture.shape for picture in self.pictures.values()]
        self.size = size or ((shapes[0][1], shapes[0][0]) if shapes else RENDER_SIZE)
        if shapes and any((shape[1], shape[0]) != self.size for shape in shapes):
            raise InputError(f"--size {self.size[0]}x{self.size[1]}: INPUT has another size; leave out --size")
        makes_all = effect.takes == "nothing"
        self.converted = effect if makes_all else with_straight_alpha(effect, effect.alpha, self.is_linear)

    def exported(self, given: Mapping[str, Any]) -> Exported:
        controls = [control for control in map(Control.of, self.effect.parameters) if control is not None]
        begun = tuple(replace(c, default=given[c.name]) if c.name in given else c for c in controls)
        loaded = Loaded(begun, lambda values: self._draw({**self._plain(given), **values}))
        handles = self._handles(loaded)
        computed = _computed(loaded.draw(handles).outputs)
        handles = {name: handle for name, handle in handles.items() if name not in computed}
        fixed = {c.name: c.default for c in begun if c.name not in handles}
        choices = {name: one.choices for name, one in self._shader_parameters().items() if one.choices}
        described = Described(
            self.effect.name, self.effect.summary, tuple(c for c in begun if c.name in handles), fixed,
            self.effect.frame_time, choices,
        )  # fmt: skip
        return Exported(loaded.draw(handles), described)

    def _shader_parameters(self) -> dict[str, ShaderParameter]:
        """Return the parameters of a shader file, by the names of their options."""
        if not isinstance(self.effect, ShaderFileEffect):
            return {}
        declared = self.effect.shader.parameters
        return {option: declared[name] for option, name in self.effect.own_names.items() if name in declared}

    def _plain(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return the parameters that are given, with an input in the place of each picture."""
        pictures = [p.name for p in self.effect.parameters if p.type == "picture"]
        plain = {name: value for name, value in given.items() if name not in pictures}
        for name in pictures:
            if name in given:
                self.pictures[name] = load_rgba8(given[name])
                plain[name] = input_of(name, self.pictures[name])
        return plain

    def _handles(self, loaded: Loaded) -> dict[str, Value]:
        """Return a run value for each parameter that may change without another plan."""
        begun = {c.name: c.default for c in loaded.controls}
        if not isinstance(self.effect, (KernelEffect, ShaderFileEffect)):
            return run_values_of(loaded, begun)
        handles: dict[str, Value] = {}
        for control in loaded.controls:
            if (
                isinstance(self.effect, ShaderFileEffect)
                and self.effect.own_names[control.name] in self.effect.shader.constants
            ):
                continue
            marker, default = _MARKERS.get(control.kind), control.default
            if control.kind == "choice":
                choices = self._shader_parameters()[control.name].choices
                marker, default = int, choices.get(default, default)
            if control.kind in ("vector", "color") and default is not None:
                marker = getattr(symbols, f"vec{len(default)}")
            if marker is not None and default is not None:
                handles[control.name] = Value(control.name, marker, default=default)
        return handles

    def _draw(self, values: Mapping[str, Any]) -> Drawing:
        targets: list[Target] = []
        if self.effect.takes != "nothing":
            targets.append(Input("frame", self.formats[0] if self.is_linear else self.formats[1]))
        if self.effect.takes == "picture+depth":
            targets.append(Input("depth", "r32f"))
        outputs = named_outputs(effect_output(self.converted, targets, dict(values)))
        return Drawing(outputs, self.size, self.pictures)


def load_rgba8(path: Path) -> Any:
    """Load a picture as browsers have it: (h, w, 4) uint8."""
    import numpy as np

    picture = load_stored(path)
    return picture if picture.dtype == np.uint8 else numbers_of(scaled(picture), FORMATS["rgba8"])


def _computed(outputs: Mapping[str, Target]) -> set[str]:
    """Return the run values that Python functions of the graph read."""
    return {
        source.name
        for node in passes_behind(list(outputs.values()))
        for value in node.values.values()
        if isinstance(value, Derived)
        for source in value.sources
    }
