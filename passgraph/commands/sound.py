"""``--audio FILE``: the sound that a shader reads, as a picture for each frame."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.files.names import is_video
from passgraph.shaders import STEP_S

if TYPE_CHECKING:
    from passgraph.files.audio import Audio


def audio_options(*, with_sound: bool) -> list[click.Parameter]:
    """Return the options of a command whose effect reads sound; ``with_sound`` adds --no-sound."""
    sound = click.Option(["--sound/--no-sound"], default=True, show_default=True, help="Copy the sound into a video.")
    audio = click.Option(
        ["--audio"],
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Audio file, or video with sound, that EFFECT reads; left out, the sound of INPUT, or silence. It sets "
        "the number of frames of a video made without --frames.",
    )
    return [audio, sound] if with_sound else [audio]


def split_sound(effect: Effect, inputs: tuple[str, ...], audio: Path | None) -> tuple[tuple[str, ...], Path | None]:
    """Return the inputs that are pictures, and the file of the sound if ``--audio`` names none.

    The only input of an effect that reads sound and no picture is sound. Of a video input the sound is read too.
    """
    if audio is not None or "audio" not in effect.signals or len(inputs) != 1:
        return inputs, audio
    path = Path(inputs[0])
    if effect.takes == "nothing":
        return (), path
    from passgraph.files.audio import has_sound

    return inputs, path if is_video(path) and has_sound(path) else None


def open_audio(effect: Effect, path: Path | None) -> Audio | None:
    """Decode the file of the sound.

    Raises
    ------
    InputError
        For a file without sound, and for an effect that reads none.
    """
    if path is None:
        return None
    if "audio" not in effect.signals:
        raise InputError(f"--audio {path}: effect {effect.name} reads no sound; leave it out")
    from passgraph.files.audio import Audio

    return Audio(path)


def audio_picture(
    audio: Audio, effect: Effect, values: Mapping[str, Any], frame: int, rate: Fraction | None = None
) -> NDArray[np.uint8]:
    """Return the picture of a frame, counted from 0, at the time that the effect's clock has there.

    ``rate`` is the frames a second for effects that do not read the duration of a frame.
    """
    step = STEP_S if rate is None else float(1 / rate)
    return audio.picture(frame, values.get(effect.frame_time or "", step), values.get("time", 0.0))


def keeps_time(effect: Effect, values: Mapping[str, Any]) -> bool:
    """Return True if frame 0 has the beginning of the sound, and frames follow at the rate of the video."""
    return not values.get("time") and effect.frame_time not in values
