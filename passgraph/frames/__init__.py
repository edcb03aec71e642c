"""Frames through a program: picture files, numbered sequences, video and pipes.

``pg.frames(program, source, sink)`` is `passgraph.frames.run.frames`; sources and sinks stand here by name.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from passgraph.frames.frame import Frame, Outcome, Sink, Source, Summary
from passgraph.frames.names import Pattern
from passgraph.frames.pictures import Arrays, Numbers, Pictures, Still, ToArrays, ToPictures
from passgraph.frames.run import frames

_LATER = {"Pipe": "pipe", "Raw": "pipe", "ToPipe": "pipe", "ToVideo": "video_sink", "Video": "video"}


def __getattr__(name: str) -> Any:
    if name in _LATER:
        return getattr(import_module(f"passgraph.frames.{_LATER[name]}"), name)
    raise AttributeError(f"module 'passgraph.frames' has no attribute {name!r}")


class _Callable(ModuleType):
    """Python binds ``passgraph.frames`` to this module, which is the function of that name too."""

    __call__ = staticmethod(frames)


sys.modules[__name__].__class__ = _Callable

__all__ = [
    "Arrays", "Frame", "Numbers", "Outcome", "Pattern", "Pictures", "Pipe", "Raw", "Sink", "Source", "Still", "Summary",
    "ToArrays", "ToPictures", "ToPipe", "ToVideo", "Video", "frames",
]  # fmt: skip
