"""Files that OpenColorIO caches: see edits of LUTs, and explain a file that it does not read."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from passgraph.errors import reason

if TYPE_CHECKING:
    import PyOpenColorIO as ocio

#: Lines of a .cube file before its numbers: more than every keyword of the format.
_HEADER_LINES = 64


class LutFiles:
    """The LUT files that this process has read through OpenColorIO, with their content's hash.

    OpenColorIO 2.6 keeps parsed LUT files by path for the life of the process, and never looks at them again; its only
    way to forget one is ``ClearAllCaches``. That frees parsed files alone: processors and configs that exist are not
    changed. It is called only if the content of a known file has changed, so that other users of the library lose no
    time otherwise. The content is compared, since two edits within a tick of the file system's clock have equal times.

    Reading a file through a copy named by its hash would leave the cache alone, but not see the files that a config
    names, and would keep each version in memory.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._hashes: dict[str, bytes] = {}

    def processor(
        self, config: ocio.Config, transform: ocio.Transform, direction: ocio.TransformDirection
    ) -> ocio.Processor:
        """Return a processor made of the files as they are now."""
        import PyOpenColorIO as ocio

        with self._lock:
            changed = [path for path, known in self._hashes.items() if _hash(path) != known]
            if changed:
                ocio.ClearAllCaches()
                self._hashes.clear()
            processor = config.getProcessor(transform, direction)
            self._remember(processor.getProcessorMetadata().getFiles())
            return processor

    def _remember(self, paths: Iterable[str]) -> None:
        self._hashes.update({path: _hash(path) for path in paths})


def _hash(path: str) -> bytes:
    """Return the hash of a file's content; empty for a file that is gone."""
    try:
        with open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").digest()
    except OSError:
        return b""


def advice_on(path: str) -> str:
    """Return what to do about a file that OpenColorIO does not read, beginning with "; "; empty if nothing is known."""
    try:
        with Path(path).open(encoding="utf-8", errors="replace") as stream:
            words = {line.split(maxsplit=1)[0] for line in stream.readlines(1 << 12)[:_HEADER_LINES] if line.strip()}
    except OSError as error:
        return f"; {path}: {reason(error)}"
    # Its reader of .cube files with both tables knows no TITLE, and its reader with TITLE knows only one table.
    if words >= {"TITLE", "LUT_1D_SIZE", "LUT_3D_SIZE"}:
        return f"; OpenColorIO reads a .cube with a shaper and a 3-D table only without a title: delete TITLE in {path}"
    return ""
