"""Frames of another library, run in a process of its own so that both may have their GL context and library versions.

The peer answers each line on its input with the seconds that one frame took, so that frames alternate with ours and the
machine's drift meets both alike.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable

from harness import Ratio, ratio_of, seconds


def serve(frame: Callable[[], None], described: str) -> None:
    """The peer's side: a description, then one number a line."""
    frame()
    print(f"ready {described}", flush=True)
    for _ in sys.stdin:
        begin = time.perf_counter()
        frame()
        print(f"seconds {time.perf_counter() - begin!r}", flush=True)


class Peer:
    """Our side of a peer: ``python script --peer name``."""

    def __init__(self, python: str, script: str, name: str, environment: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [python, script, "--peer", name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            stderr=subprocess.DEVNULL, env=environment,
        )  # fmt: skip
        self.described = self._answer("ready")

    def _answer(self, kind: str) -> str:
        """The next line of this kind; libraries print greetings too."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith(kind):
                return line.removeprefix(kind).strip()
        raise SystemExit(f"the peer has ended with status {self.process.wait()}: is it installed in its Python?")

    def frame(self) -> float:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return float(self._answer("seconds"))

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def compare(name: str, ours: Callable[[], None], peer: Peer, frames: int, wanted: float | None = None) -> Ratio:
    """Medians of alternating frames; how many times the peer's time ours fits into."""
    ours()
    times = [(1e3 * seconds(ours), 1e3 * peer.frame()) for _ in range(frames)]
    mine, theirs = ([pair[k] for pair in times] for k in range(2))
    ratio = ratio_of(f"{name}: {peer.described.split(' on ')[0]} / ours", mine, theirs, wanted, faster=True)
    print(f"{name:34} ours {ratio.ms:8.1f} ms   peer {ratio.other_ms:8.1f} ms   {ratio.got:6.2f} times faster   "
          f"({peer.described})")  # fmt: skip
    return ratio
