"""The pictures of docs/render.md, made by the commands that stand there.

    python docs/render.py

runs each ``passgraph render`` of the page on models of pybullet's data; pictures go to docs/images/render/.
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from pathlib import Path

root = Path(__file__).resolve().parent.parent
if str(root) not in sys.path:
    sys.path.insert(0, str(root))

from passgraph.commands.entry import run

DOCS = Path(__file__).resolve().parent
COMMAND = re.compile(r"^passgraph (render .*-o (images/render/\S+))$", re.MULTILINE)


def commands() -> list[list[str]]:
    """The arguments of each command of the page that writes one of its pictures."""
    page = (DOCS / "render.md").read_text(encoding="utf-8")
    return [shlex.split(found[1]) for found in COMMAND.finditer(page)]


def main() -> int:
    import pybullet_data

    models = Path(pybullet_data.getDataPath())
    os.chdir(DOCS)
    (DOCS / "images" / "render").mkdir(parents=True, exist_ok=True)
    made = [[str(models / a) if (models / a).is_file() else a for a in arguments] for arguments in commands()]
    return max(run(arguments) for arguments in made)


if __name__ == "__main__":
    sys.exit(main())
