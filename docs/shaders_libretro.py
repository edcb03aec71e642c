"""How many presets of libretro are read, and why the others are not: the figures of docs/shaders.md.

    git clone https://github.com/libretro/glsl-shaders
    python docs/shaders_libretro.py glsl-shaders [PART]

reads every preset below the folder (those with PART in their paths) and plans it for a frame of 32×24, without a
device: each pass is lowered, and held against what a kernel may be.  It says what each took, in seconds of processor
time, and at the end how many were refused for what.  Most take less than a second, a few some twenty.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import passgraph as pg

#: What errors say, and what that is called.
REASONS = {
    r"instructions, loops unrolled|grows past \d+ expressions": "passes that outgrow what a kernel may be",
    r"the end of this loop is not known here": "a loop that too few trips are left for",
    r"must be vec3, got vec4": "a vec3 that is set to a vec4",
    r"there is no type": "types that only the vertex half defines",
    r"no such file|wrap_mode\d+ is one of": "a file or a wrap mode that there is not",
}
OTHER = "something else"


def refusal(preset: Path) -> str:
    """What is said of a preset that is not read; empty where it is."""
    frame = pg.Input("frame", "rgba8", (32, 24))
    try:
        shown = pg.load_shader(preset)(frame, into=pg.target("shown", "rgba8"))
        with pg.compile(shown, "null", (32, 24)) as program:
            assert program.plan is not None
    except pg.PassgraphError as error:
        return str(error)
    return ""


def reason(text: str) -> str:
    """What an error is called."""
    return next((said for pattern, said in REASONS.items() if re.search(pattern, text)), OTHER)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the presets lie, at any depth")
    parser.add_argument("part", nargs="?", default="", help="what their paths have in them")
    options = parser.parse_args()
    presets = [path for path in sorted(options.folder.rglob("*.glslp")) if options.part in path.as_posix()]
    refused = defaultdict[str, list[str]](list)
    for preset in presets:
        begin, text = time.process_time(), refusal(preset)
        print(f"{time.process_time() - begin:6.1f} {preset.name} {text.partition(chr(10))[0]}", flush=True)
        if text:
            refused[reason(text)].append(preset.stem)
    print(f"{len(presets)} presets, {len(presets) - sum(map(len, refused.values()))} are read")
    for said, names in sorted(refused.items(), key=lambda item: -len(item[1])):
        print(f"{len(names):4} {said}: {', '.join(names)}")


if __name__ == "__main__":
    main()
