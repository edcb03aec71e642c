"""Output files: written under a temporary name, renamed when complete, removed if the work fails.

Every writer uses `NewFile`.  It covers what happens to the file, so a writer must only see to it that each failed write
raises OSError: Python's own streams do, some libraries do not (:mod:`.image_writing`).

Only regular files are replaced.  A device, FIFO or socket is never replaced, not even through a symbolic link.

A temporary name contains the machine and the process: `.passgraph-MACHINE-PID-RANDOM`.  A process that is killed leaves
its temporary files; the next process that writes to the same folder removes them (:func:`_sweep`).
"""

from __future__ import annotations

import os
import platform
import re
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

from passgraph.arguments import shown
from passgraph.errors import InputError, reason

_TEMPORARY = re.compile(r"\.passgraph-([0-9a-f]{8})-([0-9]{1,10})-[0-9a-z_]{8,12}(\.\w+)?")
#: Temporary files of this process.
_unfinished: set[Path] = set()
#: Folders that were already swept.
_swept: set[Path] = set()


class NewFile:
    """A file (or a folder, if ``is_folder``) that is written as ``temporary`` and renamed by `complete`.

    As a context manager it discards the file at the end unless it was completed, and names it in errors of the system.

    Raises
    ------
    InputError
        As :func:`place_of`; and in the context manager for an OSError.
    """

    def __init__(self, file: str | os.PathLike[str], *, is_folder: bool = False) -> None:
        self._file, self._is_folder = Path(file), is_folder
        self.target = place_of(self._file, is_folder=is_folder)
        _sweep(self.target.parent)
        name = f"{_prefix()}{secrets.token_hex(6)}{self.target.suffix}"
        self.temporary = self.target.with_name(name)
        self._shown: int | None = None  # inode of a file that has another name than a temporary one
        _unfinished.add(self.temporary)

    def __enter__(self) -> NewFile:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self.discard()
        if isinstance(error, OSError):
            raise unwritable(self._file, error) from error

    def complete(self) -> None:
        """Rename it to its final name; raises OSError, and InputError if something else has taken the name."""
        self.flush()
        self.rename()

    def flush(self) -> None:
        """Wait until the disk has the content of a file, since some file systems only then report that it is full.

        The files of a folder are left to their writer.
        """
        if not self._is_folder:
            with self.temporary.open("r+b") as stream:
                os.fsync(stream.fileno())

    def rename(self) -> None:
        """Do the second half of `complete`."""
        _check_kind(self._file, self.target, self._is_folder)
        if not self._is_own:
            raise InputError(f"{self._file}: another process writes {self.temporary} too; run them one after the other")
        if self._is_folder and self.target.is_dir():
            _replace_folder(self.temporary, self.target)
        else:
            os.replace(self.temporary, self.target)
        _unfinished.discard(self.temporary)

    def show_as(self, file: Path) -> None:
        """Rename the incomplete file to a name under which it stays if the process ends; raises OSError, InputError.

        A system that does not rename open files keeps the temporary name.
        """
        place = place_of(file)
        with suppress(PermissionError):
            os.replace(self.temporary, place)
            _unfinished.discard(self.temporary)
            self.temporary, self._shown = place, os.stat(place).st_ino

    @property
    def is_shown(self) -> bool:
        """True if the incomplete file has a name under which it stays."""
        return self._shown is not None

    @property
    def _is_own(self) -> bool:
        """False if another process has replaced the incomplete file."""
        with suppress(OSError):
            return self._shown is None or os.stat(self.temporary).st_ino == self._shown
        return True

    def discard(self) -> None:
        """Remove an incomplete file; idempotent."""
        if self._is_own:
            _remove(self.temporary)
        _unfinished.discard(self.temporary)


def unwritable(file: str | os.PathLike[str], error: Exception) -> InputError:
    """Return the error for a file that cannot be written."""
    return InputError(f"{file}: cannot be written ({reason(error)}); check the folder's permissions and free space")


def place_of(file: Path, *, is_folder: bool = False) -> Path:
    """Return the path to write to for a file name: symbolic links are followed, so that a link stays a link.

    Raises
    ------
    InputError
        The name is a directory (or, for a folder, a file), a device, a FIFO or a socket; its folder is missing; or a
        link on the way lies in a folder where every user may make one.
    """
    try:
        target = Path(os.path.realpath(file))
        _check_kind(file, target, is_folder)
        if (link := _open_link(Path(os.path.abspath(file)))) is not None:
            raise InputError(
                f"{file}: {link} is a symbolic link in a folder where every user may make one; expected a path without "
                f"such a link. Give the file that it leads to, if that is meant: {target}"
            )
    except ValueError as error:  # a null byte
        raise InputError(f"{shown(str(file))}: cannot be written ({error}); expected the name of a file") from error
    if not target.parent.is_dir():
        raise InputError(f"{file}: the folder {target.parent} does not exist; make it first")
    return target


def _check_kind(file: Path, target: Path, is_folder: bool) -> None:
    """Raise InputError if the name belongs to something other than a regular file (or a folder)."""
    try:
        mode = os.lstat(target).st_mode
    except OSError:  # it does not exist, or writing will report the reason
        return
    if stat.S_ISDIR(mode):
        if not is_folder:
            raise InputError(f"{file}: is a directory; expected the name of a file")
    elif not stat.S_ISREG(mode):
        raise InputError(f"{file}: is a device, a FIFO or a socket; expected the name of a file. Give another name")


def _open_link(path: Path) -> Path | None:
    """Return the first link in a world-writable sticky folder, such as /tmp, on the way to the file.

    Any user can create a link there that leads to another user's files.
    """
    links = 0
    pending, way = list(path.parts[:0:-1]), Path(path.anchor)
    while pending:
        step = way / pending.pop()
        if not step.is_symlink():
            way = step if step.name != ".." else way.parent
            continue
        mode = way.stat().st_mode
        end = Path(os.path.realpath(step))
        if mode & stat.S_ISVTX and mode & stat.S_IWOTH and not end.is_relative_to(os.path.realpath(way)):
            return step
        links += 1
        if links > _MOST_LINKS:  # a cycle of links: opening it fails
            return None
        inner = Path(os.readlink(step))
        pending += [part for part in inner.parts[::-1] if part != inner.anchor]
        way = Path(inner.anchor) if inner.is_absolute() else way
    return None


_MOST_LINKS = 40


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    with NewFile(path) as new_file:
        new_file.temporary.write_text(text, encoding="utf-8")
        new_file.complete()


def made_folder(folder: Path) -> Path:
    """Return the path of a folder to write files into, which is created if it is missing; raises InputError."""
    place = place_of(folder, is_folder=True)
    try:
        place.mkdir(exist_ok=True)
    except OSError as error:
        raise unwritable(folder, error) from error
    return place


def write_files(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write the files of a folder; the last one describes the others, and is never seen beside those of another call.

    All are on the disk before an old one is touched.  Then the old description is removed, and the new files are
    renamed, the description last.
    """
    with ExitStack() as unfinished:
        new_files = [unfinished.enter_context(NewFile(folder / name)) for name in contents]
        for new_file, content in zip(new_files, contents.values(), strict=True):
            try:
                new_file.temporary.write_bytes(content)
                new_file.flush()
            except OSError as error:
                raise unwritable(new_file.target, error) from error
        new_files[-1].target.unlink(missing_ok=True)
        for new_file in new_files:
            new_file.rename()


def discard_unfinished() -> None:
    """Remove this process's temporary files; call this when it exits."""
    for path in list(_unfinished):
        if f"-{os.getpid()}-" in path.name:  # a forked child inherits its parent's list
            _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
        return
    with suppress(OSError):
        path.unlink()


def _replace_folder(new_folder: Path, path: Path) -> None:
    """Replace a folder by another one.

    The old one is renamed first, to a name that is never swept: it is the only copy until the new one is in place.
    Then it gets the name of the new one, so that it is swept later if it cannot be removed now.
    """
    old = path.with_name(f".passgraph-old-{secrets.token_hex(6)}{path.suffix}")
    os.rename(path, old)
    try:
        os.rename(new_folder, path)
    except BaseException:
        os.rename(old, path)
        raise
    os.rename(old, new_folder)
    _remove(new_folder)


def temporary_folder() -> tempfile.TemporaryDirectory[str]:
    """Create a folder for temporary files; if this process is killed, a later one that calls this removes it."""
    _sweep(Path(tempfile.gettempdir()))
    return tempfile.TemporaryDirectory(prefix=_prefix())


def is_temporary(name: str) -> bool:
    """Return True for the name of a temporary file of any process."""
    return _TEMPORARY.fullmatch(name) is not None


def _prefix() -> str:
    return f".passgraph-{_machine()}-{os.getpid()}-"


@cache
def _machine() -> str:
    """Return a short hash of the process ID namespace: the host and, in a container, the container."""
    try:
        counted = os.stat("/proc/self/ns/pid").st_ino
    except OSError:
        counted = 0
    return sha256(f"{platform.node()} {counted}".encode()).hexdigest()[:8]


def _sweep(folder: Path) -> None:
    """Remove temporary files of this user's dead processes on this machine, once per process and folder."""
    if folder in _swept or sys.platform == "win32":  # there, os.kill would end the process
        return
    _swept.add(folder)
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            found = _TEMPORARY.fullmatch(entry.name)
            if found is None or found[1] != _machine() or not _is_dead(int(found[2])):
                continue
            if not entry.is_symlink() and entry.stat(follow_symlinks=False).st_uid == os.getuid():
                _remove(Path(entry.path))


def _is_dead(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):  # the process belongs to another user
        return False
    return False
