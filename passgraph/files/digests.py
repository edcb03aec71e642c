"""Digests of run values, pictures and files: what tells one from another without keeping it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.pictures import split_layer


def digest(value: object) -> str:
    """Return the digest of plain data and arrays; of other objects one that is never the same.

    >>> digest({"a": 1, "b": [2.0]}) == digest({"b": [2.0], "a": 1})
    True
    """
    hashed = hashlib.blake2b(digest_size=16)
    _feed(hashed, value)
    return hashed.hexdigest()


def _feed(hashed: Any, value: object) -> None:
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        hashed.update(f"array {value.dtype.str} {value.shape} ".encode())
        hashed.update(np.ascontiguousarray(value).reshape(-1).view(np.uint8).data)
    elif isinstance(value, Mapping):
        hashed.update(f"mapping {len(value)} ".encode())
        for name, item in sorted(value.items(), key=lambda pair: str(pair[0])):
            _feed(hashed, str(name))
            _feed(hashed, item)
    elif isinstance(value, (list, tuple)):
        hashed.update(f"sequence {len(value)} ".encode())
        for item in value:
            _feed(hashed, item)
    elif value is None or isinstance(value, (bool, int, float, str, bytes, np.generic)):
        plain = value.item() if isinstance(value, np.generic) else value
        hashed.update(f"{type(plain).__name__} {plain!r} ".encode(errors="surrogatepass"))
    else:
        hashed.update(os.urandom(16))


def file_state(path: str | os.PathLike[str]) -> tuple[str, int, int] | None:
    """Return the name, size in bytes and modification time of a file; None if it does not exist.

    A layer stays in the name. A folder of a Zarr array is described by its metadata file.
    """
    file, _ = split_layer(Path(path))
    for description in (file / "zarr.json", file / ".zarray") if file.is_dir() else (file,):
        with suppress(OSError, ValueError):  # a null byte in the name
            status = os.stat(description)
            return os.path.basename(path), status.st_size, status.st_mtime_ns
    return None
