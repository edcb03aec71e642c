"""How an error reads in a terminal."""

from __future__ import annotations


def told(text: str) -> str:
    """The text of an error on one line; where a caret points into the line above it, lines stay as they are.

    >>> told("in.png: is no picture\\n  (cut short)")
    'in.png: is no picture (cut short)'
    >>> told("mine.py:3: name 'x' is not defined\\n    return x\\n           ^").count("\\n")
    2
    """
    has_caret = any(line.strip() and not line.strip(" \t^") for line in text.split("\n"))
    return text.rstrip() if has_caret else " ".join(text.split())
