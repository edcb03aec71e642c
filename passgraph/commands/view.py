"""``passgraph view``: show an effect live in the browser, and follow changes of its file and parameters."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.commands.color_spaces import with_straight_alpha
from passgraph.commands.command_graph import (
    RENDER_SIZE,
    accepts,
    as_frame,
    generator_job,
    job_of_pictures,
    load_depth,
    load_scene,
    scene_job,
)
from passgraph.commands.effect_chain import SEPARATOR, EffectChain
from passgraph.commands.input_values import written_value
from passgraph.commands.named import file_and_name, is_named, named_effect
from passgraph.commands.options import (
    EffectCommand,
    backend_option,
    complete_effect,
    flag_of,
    given_parameters,
    size_option,
)
from passgraph.commands.sound import audio_picture, open_audio, split_sound
from passgraph.effects.checked import POSITIONAL
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.files.names import is_picture, is_video
from passgraph.files.open import open_source
from passgraph.viewer.subject import Control, Drawing, Loaded

if TYPE_CHECKING:
    from passgraph.files.frame import Frame, Source
    from passgraph.scene import Scene


class EffectSubject:
    """An effect by its name or file, on the inputs of the command line."""

    def __init__(
        self,
        text: str,
        inputs: Sequence[str],
        size: tuple[int, int],
        linear: bool | None,
        audio: Path | None = None,
        given: Mapping[str, Any] | None = None,
    ) -> None:
        self.effect = named_effect(text)
        #: Parameters from the command line, which controls begin with.
        self.given = dict(given or {})
        pictures, audio = split_sound(self.effect, tuple(inputs), audio)
        self.text, self.inputs, self.size, self.linear = text, list(pictures), size, linear
        self.name = self.effect.name
        path, _ = file_and_name(text)
        self.files = [] if path is None else [path]
        self._name_further_pictures()
        self._frames = Frames(self.inputs[0]) if self.inputs and self.effect.takes.startswith("picture") else None
        self._depth: NDArray[np.float32] | None = None
        self._scene: Scene | None = None
        self._check_inputs()
        self._audio = open_audio(self.effect, audio)

    def _name_further_pictures(self) -> None:
        """Take pictures after the effect's inputs as its picture parameters, in order."""
        if not self.effect.takes.startswith("picture"):
            return
        count = POSITIONAL[self.effect.takes]
        names = [p.name for p in self.effect.parameters if p.type == "picture" and p.name not in self.given]
        if len(self.inputs) > count + len(names):
            raise InputError(f"{self.inputs[count + len(names)]}: effect {self.name} reads no further picture")
        self.given |= dict(zip(names, map(Path, self.inputs[count:]), strict=False))
        del self.inputs[count:]

    def _check_inputs(self) -> None:
        takes = self.effect.takes
        if takes == "picture+depth":
            if len(self.inputs) < 2:
                raise InputError(f"effect {self.name} takes a picture and its depth; got {len(self.inputs)} inputs")
        elif takes == "picture" and not self.inputs:
            raise InputError(f"effect {self.name} takes a picture; give one: passgraph view {self.text} photo.jpg")
        elif takes == "nothing" and self.inputs:
            raise InputError(f"effect {self.name} reads no picture; leave out {self.inputs[0]}")
        # Errors in the effect's file are shown on the page; errors of inputs are raised before.
        if takes == "picture+depth":
            self._depth = load_depth(Path(self.inputs[1]))
        self.frame(0)
        if takes == "scene":
            self._scene = load_scene(Path(self.inputs[0]) if self.inputs else None)

    def load(self) -> Loaded:
        self.effect = named_effect(self.text)
        effect = self._on_pictures(self.effect)
        found = filter(None, map(Control.of, effect.parameters))
        controls = [replace(one, default=_shown(self.given.get(one.name, one.default))) for one in found]
        if isinstance(effect, EffectChain):
            names = tuple(effect.parts)
            controls.insert(0, Control(STACK, "stack", ", ".join(names), choices=names))
        is_light = self._frames is not None and self._is_linear and not self.effect.encodes
        return Loaded(tuple(controls), lambda values: self._draw(effect, values), is_light)

    def _on_pictures(self, effect: Effect) -> Effect:
        """Return the effect as `apply` runs it: with premultiplied alpha if it mixes pixels that may be transparent."""
        return effect if self._frames is None else with_straight_alpha(effect, effect.alpha, encoded=False)

    def _draw(self, effect: Effect, values: Mapping[str, Any]) -> Drawing:
        parameters = {**self.given, **values}
        effect = _arranged(effect, parameters)
        if effect.takes in ("scene", "world2d"):
            path = Path(self.inputs[0]) if self.inputs else None
            if effect.takes == "scene":
                self._scene = self._scene or load_scene(path)
            if accepts(effect, "display"):
                parameters.setdefault("display", True)
            job = scene_job(effect, path, self.size, parameters, self._scene)
            return Drawing(job.outputs, job.size, job.given)
        if self._frames is None:
            job = generator_job(effect, None, self.size, parameters)
        else:
            job = job_of_pictures(effect, self.frame(0), self._is_linear, parameters)
        return Drawing(job.outputs, job.size, job.given)

    @property
    def _is_linear(self) -> bool:
        return self.effect.linear if self.linear is None else self.linear

    def replace_input(self, path: Path) -> None:
        if "audio" in self.effect.signals and (self._frames is None or not (is_picture(path) or is_video(path))):
            self._audio = open_audio(self.effect, path)
            return
        if self._frames is None:
            raise InputError(f"effect {self.name} reads no picture")
        frames = Frames(str(path))
        frames.read(0)
        self._frames, self.inputs[0] = frames, str(path)

    def frame_count(self) -> int | None:
        return None if self._frames is None or self._frames.count < 2 else self._frames.count

    def frame(self, number: int) -> dict[str, Any]:
        if self._frames is None:
            return {}
        pictures = {"frame": as_frame(self._frames.read(number, linear=self._is_linear), self._is_linear)}
        return pictures if self._depth is None else {**pictures, "depth": self._depth}

    def audio(self, number: int, values: Mapping[str, Any]) -> NDArray[np.uint8] | None:
        return None if self._audio is None else audio_picture(self._audio, self.effect, values, number)

    def command(self, values: Mapping[str, Any]) -> str:
        text, values = self.text, {**self.given, **values}
        effect = _arranged(self.effect, values)
        if isinstance(effect, EffectChain):
            text, values = effect.alone(values)
            if not text:
                return ""
            effect = named_effect(text)
        words = ["passgraph", "render", "--effect"] if effect.takes in ("scene", "world2d") else ["passgraph", "apply"]
        words += [text, *self._words_of_inputs(), "-o", "out.png"]
        for parameter in effect.parameters:
            value = values.get(parameter.name)
            if value is None or value == parameter.default:
                continue
            flag = flag_of(parameter)
            if parameter.type == "bool":
                words.append(flag if value else flag.replace("--", "--no-", 1))
            else:
                words += [flag, str(value) if isinstance(value, Path) else written_value(value)]
        return shlex.join(words)

    def _words_of_inputs(self) -> list[str]:
        picture, depth = self.inputs, list[str]()
        if self.effect.takes == "picture+depth":
            picture, depth = self.inputs[:1], ["--depth", self.inputs[1]]
        return [*picture, *depth, *([] if self._audio is None else ["--audio", str(self._audio.path)])]


#: The control of the order of a chain's effects.
STACK = "order"


def _arranged(effect: Effect, values: dict[str, Any]) -> Effect:
    """Return the effect with a chain's parts as their control has them, which is taken from the values."""
    order = values.pop(STACK, None) if isinstance(effect, EffectChain) else None
    if not isinstance(effect, EffectChain) or not isinstance(order, str):
        return effect
    names = [name.strip() for name in order.split(SEPARATOR)]
    return effect.arranged(name for name in names if name and not name.startswith("-"))


def _shown(value: Any) -> Any:
    """Return a value as controls have it: a list for several numbers."""
    return list(value) if isinstance(value, tuple) else value


class Frames:
    """Frames of a source by number, counted from 0; the first and the next frame are read fastest."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.source: Source = open_source(path)
        self.count = self.source.count or 1
        self._next: Iterator[Frame] = iter(self.source)
        self._at = 0
        #: The first frame and the latest one read, by number.
        self._kept: dict[int, NDArray[Any]] = {}
        self._are_linear = False

    def read(self, number: int, *, linear: bool = False) -> NDArray[Any]:
        """Return the pixels in the file's dtype; for ``linear`` see `Frame.pixels`."""
        if linear != self._are_linear:
            self._kept, self._are_linear = {}, linear
        if number in self._kept:
            return self._kept[number]
        if number < self._at:
            self._next, self._at = iter(self.source), 0
        for frame in self._next:
            self._at += 1
            if self._at > number:
                first = {0: self._kept[0]} if 0 in self._kept else {}
                self._kept = {**first, number: frame.pixels(linear=linear)}
                return self._kept[number]
        raise InputError(f"{self.path}: has no frame {number + 1}")


class _ViewCommand(EffectCommand):
    """A command with the options of the effect that its first argument names."""

    naming = "NAME"

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = next((argument for argument in args if is_named(argument)), None)
        self.choose(ctx, named)
        return click.Command.parse_args(self, ctx, args)


@click.command(cls=_ViewCommand)
@click.argument("effect", metavar="EFFECT|FILE[:NAME]", shell_complete=complete_effect)
@click.argument("inputs", metavar="[INPUT...]", nargs=-1, type=click.Path())
@backend_option
@size_option(RENDER_SIZE)
@click.option(
    "--linear/--as-stored", default=None, help="Decode 8- and 16-bit pictures from sRGB to linear light first."
)
@click.option(
    "--audio",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Audio file, or video with sound, that a Shadertoy shader reads.",
)
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port of the page; 0 takes a free one.")
@click.option("--open/--no-open", "opens", default=True, help="Open the page in the browser.  [default: open]")
@click.pass_context
def view(
    ctx: click.Context, /, effect: str, inputs: tuple[str, ...], backend: str | None, size: tuple[int, int],
    linear: bool | None, audio: Path | None, port: int, opens: bool, **_: Any,
) -> int:  # fmt: skip
    """Show EFFECT live in the browser: its parameters, targets, passes and pixels.

    EFFECT is an effect, a FILE.py of yours (it is run), or a shader file. INPUT is what `apply` takes: a picture, a
    folder, a numbered sequence, a video; a scene for effects that render one. When the file is saved, the new picture
    is shown; an error is shown over the last good picture.

    Parameters begin with the values of options, as in `apply`: --threshold 0.3, --to after.png. Of several effects,
    "bloom, tone-map, vignette", the page changes the order, and switches each on and off.

    The page is served on this machine only. Its address has a token; on another machine, forward the port:
    ssh -L PORT:127.0.0.1:PORT host.
    """
    subject = EffectSubject(effect, inputs, size, linear, audio, given_parameters(ctx))
    try:
        from passgraph.viewer.server import View
    except ImportError as error:
        raise InputError(f"passgraph view needs {error.name}: pip install 'passgraph[view]'") from None
    page = View(subject, backend or "", port)
    click.echo(f"{subject.name}: {page.url}  (Ctrl-C ends)")
    if opens:
        import webbrowser

        webbrowser.open(page.url)
    page.serve()
    return 0
