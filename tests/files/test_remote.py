"""Frames on a cluster of processes: the same bits as here, each once, whatever becomes of workers and scheduler."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.files import Arrays, Pictures, ToArrays, ToPictures
from passgraph.files.remote import RemoteRun
from passgraph.files.worker import MOST_PROGRAMS, PLUGIN, Named, Programs, compiled, compute
from tests.picture_files import names_in

distributed = pytest.importorskip("distributed")

SHADE = pg.kernel(source="def shade(color: Image, k: float) -> vec4: return vec4(k - color[0, 0].rgb, 1.0)")
RANDOM = np.random.default_rng(11)
FRAMES = [RANDOM.integers(0, 256, (9, 13, 4)).astype(np.uint8) for _ in range(24)]


@pytest.fixture
def program() -> Iterator[pg.Program]:
    with pg.compile(SHADE(pg.Input("frame"), pg.Value("k", float)), "reference") as made:
        yield made


@pytest.fixture
def files(tmp_path: Path) -> dict[int, Path]:
    (tmp_path / "in").mkdir()
    for number, frame in enumerate(FRAMES, 1):
        pg.save(tmp_path / "in" / f"{number}.png", frame)
    return {number: tmp_path / "in" / f"{number}.png" for number in range(1, len(FRAMES) + 1)}


def outputs(folder: Path) -> dict[int, Path]:
    folder.mkdir(exist_ok=True)
    return {number: folder / f"{number}.png" for number in range(1, len(FRAMES) + 1)}


def values(number: int) -> dict[str, float]:
    return {"k": number / 16}


def here(program: pg.Program, frames: list[Any] = FRAMES) -> list[bytes]:
    sink = ToArrays()
    assert pg.frames(program, Arrays(frames), sink, values=values, jobs=1).whole
    return [picture.tobytes() for picture in sink.pictures]


def test_frames_of_a_cluster_are_those_computed_here(program: pg.Program, client: Any) -> None:
    sink, seen = ToArrays(), list[int]()
    summary = pg.frames(
        program, Arrays(FRAMES), sink, values=values, client=client, watch=lambda outcome: seen.append(outcome.number)
    )
    assert summary.whole and summary.written == len(FRAMES)
    assert seen == list(range(1, len(FRAMES) + 1)), "each once, in order"
    assert [picture.tobytes() for picture in sink.pictures] == here(program)


def test_files_are_named_and_workers_read_and_write_them(
    program: pg.Program, client: Any, files: dict[int, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = outputs(tmp_path / "far")
    with monkeypatch.context() as patch:
        patch.setattr("passgraph.files.sequences.load_stored", lambda path: pytest.fail(f"{path} was read here"))
        patch.setattr("passgraph.files.sequences.save", lambda path, _: pytest.fail(f"{path} was written here"))
        assert pg.frames(program, Pictures(files), ToPictures(made), values={"k": 1.0}, client=client).whole
    near = outputs(tmp_path / "near")
    assert pg.frames(program, Pictures(files), ToPictures(near), values={"k": 1.0}).whole
    assert [path.read_bytes() for path in made.values()] == [path.read_bytes() for path in near.values()]


def test_files_that_a_worker_sees_differently_are_sent(
    program: pg.Program, client: Any, files: dict[int, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RemoteRun, "_file_or_pixels", lambda run, name, frame: Named("/elsewhere/1.png", 1, 1))
    sink = ToArrays()
    assert pg.frames(program, Pictures(files), sink, values=values, client=client).whole
    assert [picture.tobytes() for picture in sink.pictures] == here(program)


def test_results_that_a_worker_has_no_folder_for_are_written_here(
    program: pg.Program, client: Any, files: dict[int, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output_file = RemoteRun._output_file
    monkeypatch.setattr(RemoteRun, "_output_file", lambda run, frame: replace(output_file(run, frame), folder=1))
    far, near = outputs(tmp_path / "far"), outputs(tmp_path / "near")
    assert pg.frames(program, Pictures(files), ToPictures(far), values={"k": 1.0}, client=client).whole
    assert pg.frames(program, Pictures(files), ToPictures(near), values={"k": 1.0}).whole
    assert [path.read_bytes() for path in far.values()] == [path.read_bytes() for path in near.values()]


def test_a_worker_does_not_take_another_file_for_the_one_meant(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    pg.save(path, FRAMES[0])
    status = path.stat()
    for size, modified in ((status.st_size + 1, status.st_mtime_ns), (status.st_size, status.st_mtime_ns + 1)):
        assert compute(("", ""), {"frame": Named(str(path), size, modified)}, {}, False, None, None) is None


def test_a_worker_compiles_a_graph_once(program: pg.Program, client: Any) -> None:
    for _ in range(2):
        pg.frames(program, Arrays(FRAMES), ToArrays(), values=values, client=client)
    made = client.run(lambda dask_worker: dask_worker.plugins["passgraph-programs"].compiled)
    assert PLUGIN == "passgraph-programs"
    assert all(count <= 2 for count in made.values()), "here() and others compile the same graph"
    kept = client.run(lambda dask_worker: len(dask_worker.plugins["passgraph-programs"].kept))
    assert all(count == 1 for count in kept.values())


def test_programs_of_a_worker_are_bounded_and_closed() -> None:
    import json

    programs, seen = Programs(), list[pg.Program]()
    for number in range(MOST_PROGRAMS + 1):
        made = SHADE(pg.Input("frame"), number)
        with pg.compile(made, "reference") as one:
            text = json.dumps({"graph": one.to_data(), "compile": one.settings()})
        for _ in range(2):
            with programs.using(str(number), lambda text=text: compiled(text)) as kept:  # type: ignore[misc]
                seen.append(kept)
    assert programs.compiled == MOST_PROGRAMS + 1
    assert [one._closed for one in seen[::2]] == [True] + [False] * MOST_PROGRAMS
    programs.teardown(None)
    assert all(one._closed for one in seen) and not programs.kept


def test_frames_that_cannot_be_read_fail_alone(
    program: pg.Program, client: Any, files: dict[int, Path], tmp_path: Path
) -> None:
    files[3].write_bytes(b"no picture")
    files[5].unlink()
    summary = pg.frames(program, Pictures(files), ToPictures(outputs(tmp_path / "out")), values=values, client=client)
    assert [outcome.number for outcome in summary.failed] == [3, 5]
    assert str(files[3]) in summary.failed[0].reason
    assert summary.written == len(FRAMES) - 2


def test_a_worker_killed_in_the_middle_costs_no_frame(program: pg.Program, client: Any) -> None:
    many = FRAMES * 4
    sink, numbers = ToArrays(), list[int]()
    pids = list(client.run(os.getpid).values())

    def watch(outcome: Any) -> None:
        numbers.append(outcome.number)
        if outcome.number == 5:
            os.kill(pids[0], signal.SIGKILL)

    summary = pg.frames(program, Arrays(many), sink, values=values, client=client, watch=watch)
    assert summary.whole
    assert numbers == list(range(1, len(many) + 1))
    assert [picture.tobytes() for picture in sink.pictures] == here(program, many)
    client.wait_for_workers(2)


@pytest.mark.slow
def test_a_worker_that_joins_later_takes_part(program: pg.Program, cluster: Any, client: Any) -> None:
    many = FRAMES * 4
    sink = ToArrays()

    def watch(outcome: Any) -> None:
        if outcome.number == 3:
            cluster.scale(3)
            client.wait_for_workers(3)

    before = set(client.scheduler_info(n_workers=-1)["workers"])
    summary = pg.frames(program, Arrays(many), sink, values=values, client=client, watch=watch)
    assert summary.whole
    assert [picture.tobytes() for picture in sink.pictures] == here(program, many)
    made = client.run(lambda dask_worker: PLUGIN in dask_worker.plugins)
    assert [made[address] for address in set(made) - before] == [True]


HOST = """
import sys
from distributed import LocalCluster
with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster:
    print(cluster.scheduler_address, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def host() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process with a scheduler and a worker, and the scheduler's address."""
    root = Path(__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-c", HOST.replace("processes=False", "processes=False, protocol='tcp'")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as made:
        assert made.stdout is not None
        try:
            yield made, made.stdout.readline().strip()
        finally:
            made.kill()


@pytest.mark.slow
def test_a_scheduler_that_goes_away_ends_the_run_and_resume_completes_it(
    program: pg.Program, host: tuple[Any, str], files: dict[int, Path], tmp_path: Path
) -> None:
    import dask

    process, address = host
    made, many = outputs(tmp_path / "out"), Pictures(files)

    def watch(outcome: Any) -> None:
        if outcome.number == 4:
            process.kill()

    with dask.config.set({"distributed.comm.timeouts.connect": "1s", "distributed.comm.retry.count": 0}):
        client = distributed.Client(address, set_as_default=False)
        try:
            with pytest.raises(pg.InputError, match=r"the scheduler at tcp://.* went away .*resume"):
                pg.frames(program, many, ToPictures(made), values=values, client=client, watch=watch, jobs=2)
        finally:
            client.close(timeout=1)
    there = [number for number, path in made.items() if path.exists()]
    assert 4 <= len(there) < len(FRAMES)
    # What was killed in the middle of a file leaves it under another name.
    others = [path.name for path in (tmp_path / "out").iterdir() if path not in made.values()]
    assert all(name.startswith(".passgraph-") for name in others)
    summary = pg.frames(program, many, ToPictures(made), values=values, resume=True)
    # A worker's last file may not be recorded yet.
    assert summary.kept + summary.remade == len(there) and summary.kept + summary.written == len(FRAMES)
    near = outputs(tmp_path / "near")
    pg.frames(program, many, ToPictures(near), values=values)
    assert [path.read_bytes() for path in made.values()] == [path.read_bytes() for path in near.values()]


def test_the_command_runs_on_a_scheduler(
    client: Any, files: dict[int, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, address = tmp_path / "out", client.scheduler.address
    told = ["apply", "black-and-white", str(files[1].parent), "-o", str(out), "-b", "reference", "--scheduler", address]
    assert run(told) == 0, capsys.readouterr().err
    assert len(names_in(out)) == len(FRAMES)
    capsys.readouterr()
    one = ["apply", "black-and-white", str(files[1]), "-o", str(tmp_path / "one.png"), "--scheduler", address]
    assert run(one) == 2
    assert "--scheduler is for many frames" in capsys.readouterr().err


# What is refused


def test_history_keeps_its_order_and_is_refused(client: Any) -> None:
    into = pg.target("trail", "rgba32f")
    trail = pg.kernel(source="def trail(a: Image, b: Image) -> vec4: return mix(a[0, 0], b[0, 0], 0.5)")
    made = trail(pg.Input("frame"), pg.previous(into), into=into)
    with pg.compile(made, "reference") as program, pytest.raises(pg.InputError, match="need each other in order"):
        pg.frames(program, Arrays(FRAMES), ToArrays(), client=client)


def test_what_is_no_client_is_refused(program: pg.Program) -> None:
    with pytest.raises(pg.InputError, match=r"client must be a distributed.Client .*, got str"):
        pg.frames(program, Arrays(FRAMES), ToArrays(), values=values, client="tcp://host:8786")  # type: ignore[arg-type]


def test_what_cannot_travel_is_refused_before_the_first_frame(client: Any) -> None:
    made = SHADE(pg.Input("frame"), pg.Value("k", float).map(abs))
    with pg.compile(made, "reference") as program, pytest.raises(pg.GraphError, match="pass 'shade', parameter 'k'"):
        pg.frames(program, Arrays(FRAMES), ToArrays(), values=values, client=client)


def test_code_among_the_values_does_not_travel(program: pg.Program, client: Any) -> None:
    with pytest.raises(pg.InputError, match="value 'k' must be numbers, to go to another machine"):
        pg.frames(program, Arrays(FRAMES), ToArrays(), values={"k": lambda: 1.0}, client=client)


def test_numbers_that_were_set_on_the_program_are_refused(client: Any) -> None:
    with pg.compile(SHADE(pg.Input("frame", "rgba32f", (4, 4)), 1.0), "reference") as program:
        program.set("shade", "k", 0.5)
        with pytest.raises(pg.InputError, match=r"program.set changed cannot be serialized"):
            pg.frames(program, Arrays(FRAMES), ToArrays(), client=client)


def test_a_scheduler_that_does_not_answer_is_told() -> None:
    import dask

    from passgraph.files.remote import connected

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "0.5s"}),
        pytest.raises(pg.InputError, match=r"no scheduler answers at 'tcp://127.0.0.1:1'"),
    ):
        connected("tcp://127.0.0.1:1")


def test_files_of_a_cluster_are_those_written_here(program: pg.Program, client: Any, tmp_path: Path) -> None:
    """Profile, resolution, EXIF, channels and bits: to the byte."""
    from PIL import Image, ImageCms

    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    exif = Image.Exif()
    exif[0x010E] = "a description"
    Image.new("RGB", (8, 6), (10, 20, 30)).save(tmp_path / "1.png", icc_profile=profile, dpi=(300, 300), exif=exif)
    pg.save(tmp_path / "2.png", np.full((6, 8, 3), 1000, np.uint16))
    source = Pictures({n: tmp_path / f"{n}.png" for n in (1, 2)})
    made = {}
    for folder, one in (("here", None), ("there", client)):
        (tmp_path / folder).mkdir()
        sink = ToPictures({n: tmp_path / folder / f"{n}.png" for n in (1, 2)})
        assert pg.frames(program, source, sink, values={"k": 1.0}, client=one).whole
        made[folder] = [(tmp_path / folder / f"{n}.png").read_bytes() for n in (1, 2)]
    assert made["here"] == made["there"]
    with Image.open(tmp_path / "there" / "1.png") as picture:
        assert (picture.mode, picture.info["icc_profile"]) == ("RGB", profile)
