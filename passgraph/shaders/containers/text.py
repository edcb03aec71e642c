"""Texts of shader files."""

from __future__ import annotations

from pathlib import Path

from passgraph.reading import read_bytes

#: Of one file; textures of mpv lie within.
MAX_BYTES = 4 << 20


def shader_text(path: Path, what: str) -> str:
    """A file's text; comments of people's are in many encodings, so what is no UTF-8 becomes a sign for it.

    Raises
    ------
    InputError
        For a file that cannot be read or is too large, naming ``what`` it is.
    """
    return read_bytes(path, what, MAX_BYTES).decode("utf-8", errors="replace")
