"""Every way in which passgraph writes a file, each as a function from a path and a picture; and faults while it writes.

As a program, ``python -m tests.writers FAULT FOLDER NAME ...`` runs writers under a fault and prints a line of JSON for
each: what went wrong, or nothing. The test is `tests/test_faults.py`; a process of its own, since a library may end it.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import disk_cache, writing
from passgraph.bench.bench_report import Point, pareto_plot
from passgraph.files.animation_sink import ToAnimation
from passgraph.files.made import NAME as RECORD
from passgraph.files.program_folder import export_program
from passgraph.files.run import frames
from passgraph.files.sequences import Arrays, ToPictures
from passgraph.files.video_sink import ToVideo
from passgraph.image_formats import WRITABLE
from passgraph.web import export_web
from passgraph.writing import write_text

Picture = NDArray[np.float32]


def shown() -> pg.Program:
    one = pg.kernel(source="def one(c: Image) -> vec4: return c[0, 0]")
    return pg.compile(one(pg.Input("c")), "reference")


def graph(picture: Picture) -> pg.Target:
    """A graph that contains a picture."""
    one = pg.kernel(source="def one(c: Image, by: float) -> vec4: return c[0, 0] * by")
    return one(pg.Input("c", default=picture), pg.Value("by", default=0.5))


def tiled(path: Path, picture: Picture) -> None:
    one = pg.kernel(source="def one(c: Image) -> vec4: return c[0, 0]")
    pg.tiled(one(pg.Input("c")), {"c": picture}, path)


def sequence(path: Path, picture: Picture) -> None:
    summary = frames(shown(), Arrays([picture]), ToPictures({1: path}), jobs=1)
    if summary.stopped or summary.failed:
        raise pg.InputError(summary.stopped or summary.failed[0].reason)


def video(path: Path, picture: Picture) -> None:
    film(ToVideo(path), picture)


def animation(path: Path, picture: Picture) -> None:
    film(ToAnimation(path), picture)


def film(sink: Any, picture: Picture) -> None:
    summary = frames(shown(), Arrays([picture, picture[::-1]]), sink, jobs=1)
    if summary.stopped:
        raise pg.InputError(summary.stopped)


def chart(path: Path, picture: Picture) -> None:
    pareto_plot([Point("a", "a", 1.0, 1.0), Point("b", "b", 2.0, float(picture[0, 0, 0]))], "t", path, "error")


def opaque(path: Path, picture: Picture) -> None:
    """Without alpha, which some formats do not hold."""
    pg.save(path, picture[..., :3])


def layer(path: Path, picture: Picture) -> None:
    """A layer of a file, beside one that stays."""
    if not path.is_file():
        pg.save(path, np.zeros_like(picture))
    pg.save(f"{path}:comp", picture, layers_of=path)


def cache(path: Path, picture: Picture) -> None:
    """The disk cache, which warns once and goes on where it cannot write."""
    os.environ["PASSGRAPH_CACHE"] = os.fspath(path)
    disk_cache._said.clear()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        disk_cache.remember("programs", "one", picture.tobytes())
    if told:
        raise pg.BackendError(str(told[0].message))
    assert disk_cache.recall("programs", "one") == picture.tobytes()


Writer = Callable[[Path, Picture], object]
#: By the name of the file or folder that it writes.
WRITERS: dict[str, Writer] = {
    **dict.fromkeys([f"picture{suffix}" for suffix in WRITABLE if suffix != ".pgm"], opaque),
    "picture.pgm": lambda path, picture: pg.save(path, picture[..., 0]),
    "layers.exr": layer,
    "frames.png": sequence,
    **dict.fromkeys(["film.mp4", "film.mkv", "film.mov", "film.avi", "film.webm"], video),
    **dict.fromkeys(["film.gif", "film.apng"], animation),
    **dict.fromkeys(["tiles.tif", "tiles.exr", "tiles.zarr"], tiled),
    "report.json": lambda path, picture: write_text(path, str(picture.tolist())),
    "chart.png": chart,
    "program": lambda path, picture: export_program(graph(picture), path, size=(64, 48)),
    "page": lambda path, picture: export_web(graph(picture), path, size=(64, 48)),
}  # fmt: skip


#: With the cache, which has a folder and rules of its own (`tests/test_disk_cache.py`).
ALL: dict[str, Writer] = {**WRITERS, "cache": cache}


def picture_of(seed: int) -> Picture:
    return np.random.default_rng(seed).random((48, 64, 4), np.float32)


def content(path: Path) -> dict[str, bytes]:
    """The files of a writer, without temporary ones."""
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    return {
        os.fspath(file.relative_to(path)): file.read_bytes() for file in files if not writing.is_temporary(file.name)
    }


def temporary(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob("*") if path.name.startswith(".") and path.name != RECORD]


# Faults


@contextmanager
def limited(what: int, to: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(what)
    resource.setrlimit(what, (to, hard))
    try:
        yield
    finally:
        resource.setrlimit(what, (soft, hard))


def full(path: Path, size: int) -> Iterator[Any]:
    """No more than some bytes in a file: as a full disk, and what needs no rights."""
    for bytes_ in sorted({0, 1, size // 3, size * 2 // 3, *(max(0, size - less) for less in (5000, 4000, 100, 1))}):
        yield bytes_, limited(resource.RLIMIT_FSIZE, bytes_)


def full_tmpfs(path: Path, size: int) -> Iterator[Any]:
    """A tmpfs with few free pages."""

    @contextmanager
    def free(pages: int) -> Iterator[None]:
        ballast = path.parent / "ballast"
        status = os.statvfs(path.parent)
        with ballast.open("xb") as file:
            os.posix_fallocate(file.fileno(), 0, (status.f_bavail - pages) * status.f_frsize)
        try:
            yield
        finally:
            ballast.unlink()

    pages = -(-size // 4096)
    for count in sorted({0, 1, pages // 2, max(0, pages - 1)}):
        yield count, free(count)


def few_files(path: Path, size: int) -> Iterator[Any]:
    """No more than some files that are opened."""
    unused = [number for number in range(1000) if not os.path.exists(f"/proc/self/fd/{number}")]
    for count in range(5):
        yield count, limited(resource.RLIMIT_NOFILE, unused[count])


FAULTS = {"full": full, "full_tmpfs": full_tmpfs, "few_files": few_files}


def problem_of(name: str, folder: Path, fault: str) -> str:
    """Run a writer under each degree of a fault; return what is wrong afterwards, or nothing."""
    write, path = ALL[name], folder / name
    write(path, picture_of(2))
    new = {file: len(data) for file, data in content(path).items()}
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    write(path, picture_of(1))
    old, failed = content(path), 0
    for degree, now in FAULTS[fault](path, max(new.values())):
        error: BaseException | None = None
        with now:
            try:
                write(path, picture_of(2))
            except BaseException as raised:
                error = raised
        left, found = temporary(folder), content(path)
        if left and not (fault == "few_files" and path.is_dir() and all(map(writing.is_temporary, left))):
            return f"{degree}: left {left}"  # a folder is opened to remove it; the temporary name is swept later
        if error is None:
            if {file: len(data) for file, data in found.items()} != new:
                return f"{degree}: no error, and a file of {[len(data) for data in found.values()]} of {new} bytes"
            write(path, picture_of(1))
            continue
        failed += 1
        before_writing = fault == "few_files" and isinstance(error, OSError)
        if not before_writing and not (isinstance(error, pg.PassgraphError) and name in str(error)):
            return f"{degree}: {type(error).__name__}: {error}"
        if found != old:
            return f"{degree}: an error, and the old file is lost"
    return "" if failed else "never failed"


#: Where a signal comes: when a file has its temporary name, is written, or gets its own name.
MOMENTS = ("__init__", "flush", "rename")


def killed(name: str, folder: Path, number: int) -> str:
    """Send a signal to forked children at each moment of a writer; return what is wrong afterwards, or nothing."""
    write, path = WRITERS[name], folder / name
    write(path, picture_of(1))
    old = content(path)
    for moment in MOMENTS:
        for count in range(len(old) if "effect.json" in old else 1):
            child = os.fork()
            if child == 0:
                try:
                    _signal_at(moment, count, number)
                    write(path, picture_of(2))
                finally:
                    os._exit(0)
            status = os.waitpid(child, 0)[1]
            found = content(path)
            if number != signal.SIGINT and not os.WIFSIGNALED(status):
                return f"{moment} {count}: was not reached"
            if found != old and not ("effect.json" in old and "effect.json" not in found):
                return f"{moment} {count}: the old file is lost, or a page is of two exports"
            writing._swept.clear()  # as in another process
            write(path, picture_of(1))
            if temporary(folder) or content(path).keys() != old.keys():
                return f"{moment} {count}: left {temporary(folder)}, or not written again"
            old = content(path)
    return ""


def _signal_at(moment: str, count: int, number: int) -> None:
    """Send a signal to this process when a method of `NewFile` is called for the (count + 1)th time."""
    method, calls = getattr(writing.NewFile, moment), iter(range(1000))

    def signaled(self: writing.NewFile, *given: Any, **named: Any) -> None:
        if moment == "__init__":
            method(self, *given, **named)
        if next(calls) == count:
            os.kill(os.getpid(), number)
        if moment != "__init__":
            method(self, *given, **named)

    setattr(writing.NewFile, moment, signaled)


def main(fault: str, folder: str) -> None:
    number = getattr(signal, fault, None)
    for name in ALL if number is None else WRITERS:
        place = Path(folder) / name.replace(".", "_")
        place.mkdir()
        problem = problem_of(name, place, fault) if number is None else killed(name, place, number)
        print(json.dumps([name, problem]), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
