"""Read whole files from untrusted sources: regular files of a bounded size only, checked before they are opened.

Opening a pipe or a device may hang or have side effects, so anything but a regular file is an error.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from passgraph.errors import InputError, reason


def check_regular(path: str | os.PathLike[str], what: str) -> int:
    """Return the size in bytes of a regular file.

    Parameters
    ----------
    path : a file, or a link to one
    what : the expected kind of file, for messages: "a picture file"

    Raises
    ------
    InputError : the path does not exist, or is a directory, a pipe, a device or a socket.

    Examples
    --------
    >>> check_regular("/dev/zero", "a picture file")
    Traceback (most recent call last):
    passgraph.errors.InputError: /dev/zero: is a device, a pipe or a socket; expected a picture file
    """
    try:
        return _size(path, os.stat(path), what)
    except FileNotFoundError as error:
        raise _missing(path) from error
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        raise _unreadable(path, error) from error


def read_bytes(path: str | os.PathLike[str], what: str, most: int, mend: str = "make it smaller") -> bytes:
    """Return all bytes of a regular file.

    Parameters
    ----------
    path, what : as `check_regular` takes them
    most : largest size in bytes, checked before reading
    mend : the advice in the message for a larger file

    Raises
    ------
    InputError : as `check_regular`, or the file is too large or cannot be read.

    Examples
    --------
    >>> read_bytes(__file__, "a picture file", 10)
    Traceback (most recent call last):
    passgraph.errors.InputError: ...reading.py: has ... bytes; expected at most 10; make it smaller
    """
    check_regular(path, what)
    try:
        # The path may have been replaced meanwhile; opened without blocking, a pipe does not wait for a writer.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(handle, "rb") as stream:
            size = _size(path, os.fstat(handle), what)
            data = _at_most(stream, size, most) if size <= most else b""
    except FileNotFoundError as error:
        raise _missing(path) from error
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error
    if size > most or len(data) > most:
        raise InputError(f"{path}: has {max(size, len(data))} bytes; expected at most {most}; {mend}")
    return data


def read_text(path: str | os.PathLike[str], what: str, most: int) -> str:
    """Return all text of a regular UTF-8 file; raises `InputError` as `read_bytes` does, and if it is not UTF-8."""
    try:
        return read_bytes(path, what, most).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: is not text in UTF-8 ({error.reason} at byte {error.start}); save it as UTF-8"
        ) from None


def parsed_json(text: str | bytes, constant: Callable[[str], Any] | None = None) -> Any:
    """Return the value of JSON text; ``constant`` is called for NaN and infinities.

    Raises
    ------
    ValueError : the text is no JSON, nested too deeply, or has a number of more digits than Python converts.

    Examples
    --------
    >>> parsed_json("[" * 5_000_000)
    Traceback (most recent call last):
    ValueError: nested too deeply
    """
    try:
        return json.loads(text, parse_constant=constant)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _at_most(stream: BinaryIO, size: int, most: int) -> bytes:
    """Return a file's content, at most a little more than ``most`` bytes: it may grow, and files in /proc report size
    0."""
    parts = [stream.read(size)]
    while sum(map(len, parts)) <= most and (more := stream.read(1 << 16)):
        parts.append(more)
    return parts[0] if len(parts) == 1 else b"".join(parts)


def _size(path: str | os.PathLike[str], status: os.stat_result, what: str) -> int:
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a directory; expected {what}")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is a device, a pipe or a socket; expected {what}")
    return status.st_size


def _missing(path: str | os.PathLike[str]) -> InputError:
    if os.path.islink(path):
        return InputError(f"{path}: is a link to {os.readlink(path)}, which is not there; mend the link")
    return InputError(f"{path}: no such file; check the path (the folder here is {Path.cwd()})")


def _unreadable(path: str | os.PathLike[str], error: OSError | ValueError) -> InputError:
    return InputError(f"{path}: cannot be read ({reason(error)}); check its permissions")
