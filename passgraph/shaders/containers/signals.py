"""The keyboard and the sound as pictures of one channel, in the layout that Shadertoy gives them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from passgraph.errors import InputError
from passgraph.graph.targets import Input, Target

#: Size of a signal's picture, by the signal's name. Without input a picture is black.
SIGNALS: Mapping[str, tuple[int, int]] = {"keyboard": (256, 3), "audio": (512, 2)}
#: Kinds of inputs in Shadertoy's exports that are a signal.
KINDS = {"keyboard": "keyboard", "music": "audio", "musicstream": "audio", "mic": "audio"}
_LINE = re.compile(r"^[ \t]*#[ \t]*(iChannel[0-3])\b([^\n]*)$", re.MULTILINE)


@cache
def signal(name: str) -> Target:
    """Return the graph input of a signal."""
    width, height = size = SIGNALS[name]
    return Input(name, "r8", size, default=np.zeros((height, width, 1), np.float32))


def declared_signals(text: str, code: str, path: Path) -> tuple[dict[str, str], str]:
    r"""Return the channels that lines such as ``#iChannel0 "keyboard"`` declare, and the text with these lines blank.

    ``code`` is the text with blanks in place of its comments.

    Raises
    ------
    InputError
        For another word, with the line.

    >>> declared_signals('#iChannel1 "audio"\n//', '#iChannel1 "audio"\n  ', Path("a.glsl"))
    ({'iChannel1': 'audio'}, '                  \n//')
    """
    declared = dict[str, str]()
    for line in _LINE.finditer(code):
        word = line[2].strip()
        if word not in (f'"{name}"' for name in SIGNALS):
            known = " or ".join(f'"{name}"' for name in SIGNALS)
            number = code.count("\n", 0, line.start()) + 1
            raise InputError(
                f"{path}:{number}: #{line[1]} declares {word or 'nothing'}, expected {known}; pictures are given on "
                f"the command line\n    {line[0]}"
            )
        declared[line[1]] = word[1:-1]
        text = text[: line.start()] + " " * len(line[0]) + text[line.end() :]
    return declared, text
