"""Output files: refused before the long work, written whole or not at all."""

from __future__ import annotations

import os
import secrets
from importlib.util import find_spec
from pathlib import Path

from passgraph.errors import InputError
from passgraph.pictures import type_of_suffix

#: Suffixes of float formats: they hold light as it is, beyond 1 too.
FLOAT_SUFFIXES = (".exr", ".npy")


def check_picture_path(path: Path) -> None:
    """Raise InputError where a picture cannot be written there."""
    if path.suffix.lower() not in type_of_suffix:
        raise InputError(f"{path}: unknown suffix {path.suffix!r}; expected one of {' '.join(type_of_suffix)}")
    if path.suffix.lower() == ".exr" and find_spec("OpenEXR") is None:
        raise InputError(f"{path}: OpenEXR is not installed; run: pip install 'passgraph[exr]'")
    check_path(path)


def check_path(path: Path) -> None:
    """Raise InputError where no file of this name can be made; a file is made and removed to find out."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise InputError(f"{path}: is a directory; expected the name of a file")
    if not target.parent.is_dir():
        raise InputError(f"{path}: the folder {target.parent} does not exist; make it first")
    probe = target.with_name(f".passgraph-{secrets.token_hex(6)}")
    try:
        probe.touch(exist_ok=False)
        probe.unlink()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{path}: cannot be written ({reason}); check the folder's permissions") from error


def check_folder(path: Path) -> None:
    """Make a folder for files, or raise InputError."""
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made a folder ({error.strerror}); make its parent first") from error
    check_path(path / "probe")


def write_text(path: Path, text: str) -> None:
    """A text file, whole or not at all."""
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".passgraph-{secrets.token_hex(6)}")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
