"""Sources and sinks of frames: image files, numbered sequences, videos, animations and pipes.

`passgraph.frames` (in :mod:`.run`) sends each frame of a source through a program and into a sink.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from passgraph.files.animation import Animation
    from passgraph.files.animation_sink import ToAnimation
    from passgraph.files.audio import Audio
    from passgraph.files.frame import Frame, Outcome, Sink, Source, Summary
    from passgraph.files.names import Pattern
    from passgraph.files.pipe import Pipe, Raw, ToPipe
    from passgraph.files.sequences import Arrays, Numbers, Pictures, Still, ToArrays, ToPictures
    from passgraph.files.video import Video
    from passgraph.files.video_sink import ToVideo

#: Module → its public names, imported lazily.
_MODULES = {
    "animation": "Animation",
    "animation_sink": "ToAnimation",
    "audio": "Audio",
    "frame": "Frame Outcome Sink Source Summary",
    "names": "Pattern",
    "pipe": "Pipe Raw ToPipe",
    "sequences": "Arrays Numbers Pictures Still ToArrays ToPictures",
    "video": "Video",
    "video_sink": "ToVideo",
}
_HOME = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        from importlib import import_module

        return getattr(import_module(f"passgraph.files.{_HOME[name]}"), name)
    raise AttributeError(f"module 'passgraph.files' has no attribute {name!r}")


__all__ = [
    "Animation", "Arrays", "Audio", "Frame", "Numbers", "Outcome", "Pattern", "Pictures", "Pipe", "Raw", "Sink",
    "Source", "Still", "Summary", "ToAnimation", "ToArrays", "ToPictures", "ToPipe", "ToVideo", "Video",
]  # fmt: skip
