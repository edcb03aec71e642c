"""Frames through a program: picture files, numbered sequences, video and pipes.

``pg.frames(program, source, sink)`` is `passgraph.frames.run.frames`; sources and sinks stand here by name.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from passgraph.frames.animation import Animation
    from passgraph.frames.animation_sink import ToAnimation
    from passgraph.frames.frame import Frame, Outcome, Sink, Source, Summary
    from passgraph.frames.names import Pattern
    from passgraph.frames.pictures import Arrays, Numbers, Pictures, Still, ToArrays, ToPictures
    from passgraph.frames.pipe import Pipe, Raw, ToPipe
    from passgraph.frames.run import frames
    from passgraph.frames.video import Video
    from passgraph.frames.video_sink import ToVideo

#: Module → what this package has of it, loaded when first used: one picture needs none of it.
_MODULES = {
    "animation": "Animation", "animation_sink": "ToAnimation",
    "frame": "Frame Outcome Sink Source Summary", "names": "Pattern",
    "pictures": "Arrays Numbers Pictures Still ToArrays ToPictures", "pipe": "Pipe Raw ToPipe", "run": "frames",
    "video": "Video", "video_sink": "ToVideo",
}  # fmt: skip
_HOME = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"passgraph.frames.{_HOME[name]}"), name)
    raise AttributeError(f"module 'passgraph.frames' has no attribute {name!r}")


class _Callable(ModuleType):
    """Python binds ``passgraph.frames`` to this module, which is the function of that name too."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        return self.frames(*given, **named)


sys.modules[__name__].__class__ = _Callable

__all__ = [
    "Animation", "Arrays", "Frame", "Numbers", "Outcome", "Pattern", "Pictures", "Pipe", "Raw", "Sink", "Source",
    "Still", "Summary", "ToAnimation", "ToArrays", "ToPictures", "ToPipe", "ToVideo", "Video", "frames",
]  # fmt: skip
