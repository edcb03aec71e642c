"""docs/kernels.md says what is so: its code parses, its table is the operations table."""

from __future__ import annotations

import linecache
import re
import sys
import types
from pathlib import Path

import pytest

from docs.kernels import PAGE, filled
from passgraph.language.kernel import Kernel
from passgraph.language.lower import Facts, ImageFacts, lower
from passgraph.language.operations import OPERATIONS
from passgraph.language.sized import loops_over_sizes

#: Where the names of the language are.
LANGUAGE = ("symbols", "primitives", "functions", "vectors")
TEXT = PAGE.read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


def test_the_table_is_the_operations_table() -> None:
    assert filled(TEXT) == TEXT, "docs/kernels.md is older than the table of operations; run: python docs/kernels.py"
    assert all(row.doc in TEXT.replace("\\|", "|") for row in OPERATIONS.values())


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: re.findall(r"def (\w+)", block)[-1])
def test_every_block_of_the_page_is_a_kernel(block: str, tmp_path: Path) -> None:
    path = tmp_path / "block.py"
    names = "".join(f"from passgraph.language.{module} import *\n" for module in LANGUAGE)
    path.write_text(f"import passgraph as pg\n{names}\n{block}", encoding="utf-8")
    module = types.ModuleType("block")
    sys.modules["block"] = module
    linecache.checkcache(str(path))
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), vars(module))
    del sys.modules["block"]
    made = [value for value in vars(module).values() if isinstance(value, Kernel)]
    assert made
    for kernel in made:
        sizes = {name: ImageFacts(size=(64, 48)) for name in kernel.program.images}
        facts = Facts(images=sizes, size=(1, 1)) if loops_over_sizes(kernel.program) else Facts()
        assert lower(kernel.program, facts).outputs


def test_there_are_blocks_to_check() -> None:
    assert len(BLOCKS) >= 6
