"""The disk cache: whole files in a folder that only this user can write to.

Some of it is machine code that is run.  So every folder on the way is opened from the one before it, never by its path
again, and what is asked about ownership is asked of what was opened: exchanging folders or links meanwhile changes
nothing.  A file begins with a checksum of its content, its name and its kind, so that none stands in for another.
"""

from __future__ import annotations

import hashlib
import os
import stat
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from passgraph.errors import BackendError

#: Environment variable with another folder for all that is kept.
CACHE_VARIABLE = "PASSGRAPH_CACHE"
#: A folder holds at most this much, looked at when a process first writes there; then the oldest files go.
FOLDER_BYTES = 256 * 1024**2
#: As many links as Linux follows in one path.
MAX_LINKS = 40
_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_POSIX = os.name == "posix"
_FOLDER_FLAGS = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)
#: A pipe must not hold us up: what is no plain file is found out after opening.
_FILE_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
#: Whether this process has said that it keeps nothing, and folders that it has looked through.
_said: set[str] = set()
_pruned: set[Path] = set()


def cache_path(part: str) -> Path:
    """Return the folder of one kind of file."""
    given = os.environ.get(CACHE_VARIABLE)
    try:
        base = Path(given) if given else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "passgraph"
    except RuntimeError as error:  # no HOME, and no such user
        raise BackendError(
            f"there is no home folder for what is kept ({error}); name one in {CACHE_VARIABLE}"
        ) from None
    return Path(os.path.abspath(base)) / part


@contextmanager
def cache_folder(part: str, make: bool = True) -> Iterator[int | None]:
    """The user's own folder for one kind of file, opened; None where paths must do.  ``make``: where it is missing.

    Raises
    ------
    BackendError
        When it, or a folder on the way, belongs to someone else or others may write to it: code from there is executed.
    FileNotFoundError
        Where it is missing and not to be made.
    """
    path = cache_path(part)
    try:
        if not _POSIX:
            if make:
                path.mkdir(parents=True, exist_ok=True)
            folder = None
        else:
            folder = _opened(path, make)
    except OSError as error:
        if not make and isinstance(error, FileNotFoundError):
            raise
        raise BackendError(
            f"the cache folder {path} cannot be made or opened ({error}); name another one in {CACHE_VARIABLE}"
        ) from error
    try:
        yield folder
    finally:
        if folder is not None:
            os.close(folder)


def _opened(path: Path, make: bool) -> int:
    """A folder by way of every folder before it, each opened from the last one and looked at once it is open."""
    pending = list(path.parts[:0:-1])
    folder, links, way = os.open(path.anchor, _FOLDER_FLAGS), 0, path.anchor
    try:
        _check_ancestor(os.fstat(folder), way)
        while pending:
            name = pending.pop()
            target = _link(name, folder)
            if target is not None:
                links += 1
                if links > MAX_LINKS:
                    raise OSError(f"more than {MAX_LINKS} links")
                pending += list(Path(target).parts[::-1])
                continue
            inner_path = os.path.join(way, name)
            inner = _stepped(name, folder, make)
            os.close(folder)
            folder, way = inner, "/" if os.path.isabs(name) else inner_path
            if pending:
                _check_ancestor(os.fstat(folder), way)
        _check_own(os.fstat(folder), way)
    except BaseException:
        os.close(folder)
        raise
    return folder


def _link(name: str, folder: int) -> str | None:
    """Return the target of a link made by root or this user; None if it is no link."""
    try:
        status = os.stat(name, dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError:
        return None
    if not stat.S_ISLNK(status.st_mode):
        return None
    if status.st_uid not in (0, os.getuid()):
        raise BackendError(f"the link {name!r} on the way to the cache folder belongs to another user: {_mend()}")
    return os.readlink(name, dir_fd=folder)


def _stepped(name: str, folder: int, make: bool) -> int:
    try:
        return os.open(name, _FOLDER_FLAGS, dir_fd=folder)
    except FileNotFoundError:
        if not make:
            raise
        with suppress(FileExistsError):
            os.mkdir(name, 0o700, dir_fd=folder)
        return os.open(name, _FOLDER_FLAGS, dir_fd=folder)


def _check_ancestor(status: os.stat_result, way: str) -> None:
    """Whoever owns a folder, or may write to one without the sticky bit, may exchange what is in it."""
    mode = status.st_mode
    open_to_others = mode & stat.S_IWOTH or (mode & stat.S_IWGRP and not _private_group(status.st_gid))
    if status.st_uid not in (0, os.getuid()) or (open_to_others and not mode & stat.S_ISVTX):
        raise BackendError(
            f"the folder {way} on the way to the cache folder belongs to another user or others may write to it: "
            f"{_mend()}"
        )


def _check_own(status: os.stat_result, way: str) -> None:
    if status.st_uid != os.getuid() or status.st_mode & _OTHERS:
        raise BackendError(
            f"the cache folder {way} belongs to another user or others may write to it; "
            f"it holds code that is run: mend it (chmod 700) or name another one in {CACHE_VARIABLE}"
        )


def _mend() -> str:
    return f"code from there is run; name another folder in {CACHE_VARIABLE}"


@cache
def _private_group(group: int) -> bool:
    """Whether a group is this user's alone: many systems give each user one of the same name."""
    import grp
    import pwd

    try:
        user, found = pwd.getpwuid(os.getuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return found.gr_name == user and set(found.gr_mem) <= {user}


@cache
def text_digest(place: Path, endings: tuple[str, ...] = (".py",)) -> str:
    """Stands for the text of a package, or of one file: part of every name of what all of it decides."""
    files = [place] if place.is_file() else sorted(path for path in place.rglob("*") if path.suffix in endings)
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def recall(part: str, name: str) -> bytes | None:
    """Return what :func:`remember` wrote; None if it is missing, damaged or someone else's, or if the cache is off."""
    try:
        with cache_folder(part, make=False) as folder:
            data = _read(_at(part, name, folder), folder)
    except FileNotFoundError:
        return None
    except (BackendError, OSError) as error:
        _say(error)
        return None
    return data[32:] if data[:32] == _seal(part, name, data[32:]) else None


def remember(part: str, name: str, data: bytes) -> None:
    """Keep a file; where that cannot be, a warning says so once and the program goes on without."""
    try:
        with cache_folder(part) as folder:
            if cache_path(part) not in _pruned:
                _pruned.add(cache_path(part))
                prune(cache_path(part), folder)
            _write(part, name, _seal(part, name, data) + data, folder)
    except (BackendError, OSError) as error:
        _say(error)


def _seal(part: str, name: str, data: bytes) -> bytes:
    return hashlib.sha256(b"\0".join((part.encode(), name.encode(), data))).digest()


def _at(part: str, name: str, folder: int | None) -> str:
    """A file's name in its opened folder, or its path where folders cannot be opened."""
    return name if folder is not None else str(cache_path(part) / name)


def _read(name: str, folder: int | None) -> bytes:
    with os.fdopen(os.open(name, os.O_RDONLY | _FILE_FLAGS, dir_fd=folder), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_size > FOLDER_BYTES:
            return b""
        if _POSIX and (status.st_uid != os.getuid() or status.st_mode & _OTHERS):
            return b""
        return file.read()


def _write(part: str, name: str, data: bytes, folder: int | None) -> None:
    """Another process may write the same file: both replace it whole, with what serves both."""
    temporary = _at(part, f".pg_{os.urandom(8).hex()}.tmp", folder)
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _FILE_FLAGS
        with os.fdopen(os.open(temporary, flags, 0o600, dir_fd=folder), "wb") as file:
            file.write(data)
        os.replace(temporary, _at(part, name, folder), src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        with suppress(OSError):
            os.unlink(temporary, dir_fd=folder)
        raise


def _say(error: Exception) -> None:
    """Once in a process: what is kept only saves time."""
    if not _said:
        _said.add(str(error))
        warnings.warn(f"passgraph keeps nothing on disk, each process compiles anew: {error}", stacklevel=3)


def prune(path: Path, folder: int | None = None, most: int = FOLDER_BYTES) -> None:
    """Remove the files that were written first, down to half of ``most``, where a folder holds more.

    Another process may read or remove the same files: what is gone is made anew.
    """
    found = []
    for name in os.listdir(path if folder is None else folder):
        place = name if folder is not None else str(path / name)
        with suppress(OSError):
            status = os.stat(place, dir_fd=folder, follow_symlinks=False)
            found.append((status.st_mtime, status.st_size, place))
    total = sum(size for _, size, _ in found)
    if total <= most:
        return
    for _, size, place in sorted(found):
        if total <= most // 2:
            return
        with suppress(OSError):
            os.unlink(place, dir_fd=folder)
            total -= size
