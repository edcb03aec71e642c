"""How many presets of libretro are read, and why the others are not: a section of docs/shaders.md.

    git clone https://github.com/libretro/glsl-shaders
    python docs/shaders_libretro.py glsl-shaders

reads every preset below the folder and plans it for a frame of 32×24, without a device: each pass is lowered, and held
against what a kernel may be.  A preset takes from a tenth of a second to a minute.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

import passgraph as pg

PAGE = DOCS / "shaders.md"
BEGIN, END = "<!-- libretro: written by docs/shaders_libretro.py -->", "<!-- end of libretro -->"
#: What errors say, and what the page says of them.
REASONS = {
    r"instructions, loops unrolled|grows past \d+ expressions": "passes that outgrow what a kernel may be "
    "([limits](kernels.md#limits))",
    r"the end of this loop is not known here": "a loop without a known end, in others, that too few trips are left for",
    r"must be vec3, got vec4": "a `vec3` that is set to a `vec4`, which is no GLSL",
    r"no such file|wrap_mode\d+ is one of": "a file and a wrap mode that there are not",
}
OTHER = "something else"


def refusal(preset: Path) -> str:
    """What is said of a preset that is not read; empty where it is."""
    try:
        frame = pg.Input("frame", "rgba8", (32, 24))
        shown = pg.load_shader(preset)(frame, into=pg.target("shown", "rgba8"))
        with pg.compile(shown, "null", (32, 24)) as program:
            assert program.plan is not None
    except pg.PassgraphError as error:
        return str(error)
    return ""


def reason(text: str) -> str:
    """The row of the page that an error belongs to."""
    return next((said for pattern, said in REASONS.items() if re.search(pattern, text)), OTHER)


def section(found: Mapping[str, str]) -> str:
    """The page's text, of what was said of each preset."""
    refused = {name: text for name, text in found.items() if text}
    rows = Counter(map(reason, refused.values()))
    examples = {said: sorted({Path(n).stem for n, text in refused.items() if reason(text) == said}) for said in rows}
    read = len(found) - len(refused)
    text = (
        f"{BEGIN}\n\nOf the {len(found)} presets that the libretro project publishes {read} are read, with every "
        "pass. The others:\n\n| presets | refused for | such as |\n|--:|---|---|\n"
    )
    for said, count in rows.most_common():
        text += f"| {count} | {said} | {', '.join(f'`{name}`' for name in examples[said][:3])} |\n"
    return f"{text}\n{END}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the presets lie, at any depth")
    folder = parser.parse_args().folder
    found: dict[str, str] = {}
    for preset in sorted(folder.rglob("*.glslp")):
        name = preset.relative_to(folder).as_posix()
        found[name] = refusal(preset)
        print(name, found[name].partition("\n")[0], flush=True)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(before + section(found) + rest.partition(END)[2], encoding="utf-8")


if __name__ == "__main__":
    main()
