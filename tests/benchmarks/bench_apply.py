"""`passgraph apply gaussian-blur` on one picture, the whole process, beside scripts with OpenCV and with Pillow.

    python tests/benchmarks/bench_apply.py [ROUNDS]

Each side runs as a user's second run does: with what Python and passgraph keep for it.  Times are of processors, over
all threads, so that other work on the machine counts little; memory is the most that was resident.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from statistics import median

from harness import Ratio

root = Path(__file__).resolve().parents[2]
SIGMA_PX = 3.0
#: Gradients with a little noise, as photographs have.
PICTURE = """
import numpy as np
from PIL import Image
width, height = {size}
y, x = np.mgrid[:height, :width].astype(np.float32)
picture = np.dstack([x / width * 200, y / height * 200, (np.sin(x / 50) * np.cos(y / 40) + 1) * 100])
noise = np.random.default_rng(0).integers(0, 12, picture.shape, np.uint8)
Image.fromarray(picture.astype(np.uint8) + noise).save("in.{kind}", quality=92)
"""
APPLY = "from passgraph.commands import main; main(['apply', 'gaussian-blur', 'in.{kind}', '-o', 'ours.{kind}'])"
OPENCV = f"import cv2; cv2.imwrite('theirs.jpg', cv2.GaussianBlur(cv2.imread('in.jpg'), (0, 0), {SIGMA_PX}))"
PILLOW = f"""
import numpy as np
from PIL import Image, ImageFilter
soft = np.asarray(Image.open("in.png").filter(ImageFilter.GaussianBlur({SIGMA_PX})))
Image.fromarray(soft).save("theirs.png")
"""
#: What: the kind of file, its size, the other's script, the most time and memory of it that ours may take.
WORK = (
    ("4K JPEG, OpenCV", "jpg", (3840, 2160), OPENCV, 1.2, 1.5),
    ("512² PNG, Pillow", "png", (512, 512), PILLOW, 1.5, None),
)
#: Linux counts resident memory in KiB, others in bytes.
_MAXRSS_BYTES = 1024 if sys.platform == "linux" else 1


def ran(code: str, folder: Path) -> tuple[float, float]:
    """Milliseconds of processors and MiB that a Python process with this code takes.

    At least the MiB of this process, which Linux counts for those that it starts: it stays small.
    """
    environment = {
        **os.environ, "PYTHONPATH": str(root), "PASSGRAPH_CACHE": str(folder / "kept"), "PYTHONDONTWRITEBYTECODE": "",
        "PYTHONPYCACHEPREFIX": str(folder / "bytecode"),
    }  # fmt: skip
    quiet = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
    here = Path.cwd()
    os.chdir(folder)
    try:
        process = os.posix_spawn(sys.executable, [sys.executable, "-c", code], environment, file_actions=quiet)
    finally:
        os.chdir(here)
    _, status, used = os.wait4(process, 0)
    if status:
        raise RuntimeError(f"ended with {os.waitstatus_to_exitcode(status)}: {code}")
    return 1000.0 * (used.ru_utime + used.ru_stime), used.ru_maxrss * _MAXRSS_BYTES / 2**20


def ratios(rounds: int = 9) -> list[Ratio]:
    found = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for what, kind, size, script, time_wanted, memory_wanted in WORK:
            ran(PICTURE.format(size=size, kind=kind), folder)
            codes = (APPLY.format(kind=kind), script)
            for code in codes:
                ran(code, folder)  # the first run, which keeps things for the others
            turns = [[ran(code, folder) for code in codes] for _ in range(rounds)]
            time, memory = (median(ours[n] / theirs[n] for ours, theirs in turns) for n in (0, 1))
            ours_ms, theirs_ms = (median(turn[side][0] for turn in turns) for side in (0, 1))
            found.append(Ratio(f"apply, {what}", time, time_wanted, ours_ms, theirs_ms))
            found.append(Ratio(f"apply, {what}, memory", memory, memory_wanted))
    return found


if __name__ == "__main__":
    for ratio in ratios(int(sys.argv[1]) if len(sys.argv) > 1 else 9):
        wanted = "" if ratio.wanted is None else f", wanted {ratio.wanted}"
        times = "" if ratio.ms is None else f" ({ratio.ms:.0f} ms against {ratio.other_ms:.0f})"
        print(f"{ratio.what}: {ratio.got:.2f}{wanted}{times}")
