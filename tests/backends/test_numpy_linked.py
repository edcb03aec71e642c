"""Machine code that is loaded without LLVM: what is linked, what is left to LLVM, and that both compute the same."""

from __future__ import annotations

import ctypes
import gc
import sys
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.machine import native
from passgraph.backends.numpy.machine.compiler import compiled, load_object
from passgraph.backends.numpy.machine.linked import MARK, linked, loaded
from passgraph.backends.numpy.machine.processor import told_by_linux

linux = pytest.mark.skipif(sys.platform != "linux", reason="code is linked where object files are ELF's for AMD64")

#: Constants in two sections, a table of places to jump to, and another function of the module.
PLAIN = """
@table = private constant [8 x double] [double 1.5, double 2.5, double 3.5, double 4.5,
                                        double 5.5, double 6.5, double 7.5, double 8.5]
define internal double @chosen(i64 %n) noinline {
  %seen = alloca i64
  switch i64 %n, label %other [ i64 0, label %a  i64 1, label %b  i64 2, label %c  i64 3, label %d  i64 4, label %e ]
a:
  store volatile i64 0, ptr %seen
  %xa = load volatile i64, ptr %seen
  ret double 0.1
b:
  store volatile i64 1, ptr %seen
  store volatile i64 7, ptr %seen
  ret double 0.2
c:
  store volatile i64 2, ptr %seen
  %xc = load volatile i64, ptr %seen
  ret double 0.3
d:
  store volatile i64 3, ptr %seen
  store volatile i64 7, ptr %seen
  ret double 0.4
e:
  store volatile i64 4, ptr %seen
  %xe = load volatile i64, ptr %seen
  ret double 0.5
other:
  ret double -1.0
}
define double @entered(i64 %n) {
  %at = getelementptr double, ptr @table, i64 %n
  %one = load double, ptr %at
  %other = call double @chosen(i64 %n)
  %sum = fadd double %one, %other
  ret double %sum
}
"""
#: What LLVM calls by itself, one of them twice.
LIBRARY = """
declare double @exp2(double)
declare double @log2(double)
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
define double @entered(i64 %n) {
  %room = alloca [4096 x double]
  call void @llvm.memset.p0.i64(ptr %room, i8 0, i64 32768, i1 0)
  %at = getelementptr double, ptr %room, i64 %n
  %zero = load volatile double, ptr %at
  %x = sitofp i64 %n to double
  %y = call double @exp2(double %x)
  %z = call double @log2(double %y)
  %w = call double @exp2(double %z)
  %sum = fadd double %w, %zero
  ret double %sum
}
"""
OUTSIDE = """
declare double @j0(double)
define double @entered(i64 %n) {
  %x = sitofp i64 %n to double
  %y = call double @j0(double %x)
  ret double %y
}
"""
WRITTEN = """
@count = internal global i64 5
define double @entered(i64 %n) {
  %old = load i64, ptr @count
  %new = add i64 %old, %n
  store i64 %new, ptr @count
  %y = sitofp i64 %new to double
  ret double %y
}
"""


ENTERED = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_int64)


def called(address: int, *numbers: int) -> list[float]:
    function = ENTERED(address)
    return [function(number) for number in numbers]


@linux
def test_linked_code_computes_what_llvm_loads() -> None:
    code = compiled(PLAIN, 0)
    image = linked(code, "entered")
    assert image is not None and image.startswith(MARK)
    wanted = [1.6, 2.7, 3.8, 4.9, 6.0, 5.5, 6.5, 7.5]
    address, unload = load_object(code, "entered")
    by_llvm = called(address, *range(8))
    unload()
    assert by_llvm == pytest.approx(wanted, abs=1e-15)
    for _ in range(2):  # at two places
        assert called(loaded(image)[0], *range(8)) == by_llvm


@linux
def test_the_c_librarys_functions_are_reached_from_anywhere() -> None:
    """By a jump with an address of 64 bits: in a large process the library may lie farther off than a call reaches."""
    image = linked(compiled(LIBRARY, 0), "entered")
    assert image is not None and image.count(b"memset") == image.count(b"exp2") == 1
    for _ in range(2):
        assert called(loaded(image)[0], *range(8)) == [2.0**n for n in range(8)]


@pytest.mark.parametrize("text", [OUTSIDE, WRITTEN], ids=["calls another function", "writes to itself"])
def test_what_needs_more_than_its_own_text_is_left_to_llvm(text: str) -> None:
    assert linked(compiled(text, 0), "entered") is None


def test_what_is_no_object_file_of_this_kind_is_left_to_llvm() -> None:
    code = compiled(PLAIN, 0)
    for other in (b"", b"\x7fELF", b"MZ" + bytes(200), code[:18] + b"\xb7\x00" + code[20:]):  # 0xb7: AArch64
        assert linked(other, "entered") is None
    assert linked(code, "left") is None


@linux
def test_kernels_are_linked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kept on disk as they are run; an object file there is still loaded, by LLVM."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(native, "_codes", {})

    def emit(name: str) -> str:
        return PLAIN.replace("@entered", f"@{name}")

    parts = ("a test of linking", str(tmp_path))
    first = native.function_code(parts, emit).function(ENTERED)(2)
    (file,) = (tmp_path / "code").iterdir()
    assert file.read_bytes()[32:].startswith(MARK)
    native.remember("code", file.name, compiled(emit(file.stem), 0))
    native._codes.clear()
    assert native.function_code(parts, lambda _: pytest.fail("compiled anew")).function(ENTERED)(2) == first


def test_a_processor_is_told_by_what_decides_its_instructions(tmp_path: Path) -> None:
    text = "processor\t: {}\nvendor_id\t: V\ncpu family\t: 25\nmodel\t\t: 17\nmodel name\t: M\nstepping\t: 1\n"
    file = tmp_path / "cpuinfo"
    file.write_text(f"{text.format(0)}cpu MHz\t: 3.1\nflags\t\t: sse2 avx2\n\n{text.format(1)}flags\t\t: sse2\n\n")
    told = told_by_linux(file)
    if sys.platform != "linux":
        assert told is None
        return
    assert told == ("V\n25\n17\nM\n1", frozenset({"sse2", "avx2"}))
    file.write_text(file.read_text().replace("3.1", "2.9"))
    assert told_by_linux(file) == told  # the clock is no property of the code
    file.write_text("processor\t: 0\nBogoMIPS\t: 50.00\nFeatures\t: fp asimd\n\n")
    assert told_by_linux(file) is None  # another family of processors
    assert told_by_linux(tmp_path / "missing") is None


def mappings() -> int:
    """Pieces of this process's memory that hold code of nobody's file."""
    lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    return sum(line.split()[1].startswith("r-x") and len(line.split()) == 5 for line in lines)


@linux
@pytest.mark.parametrize("by_llvm", [False, True], ids=["linked", "by LLVM"])
def test_code_goes_with_the_last_that_has_it(by_llvm: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    if by_llvm:
        monkeypatch.setattr(native, "linked", lambda code, name: None)

    def made(number: int) -> native.Code:
        return native.function_code((str(tmp_path), str(number)), lambda name: PLAIN.replace("@entered", f"@{name}"))

    one, before = made(0), mappings()
    for number in range(1, 100):
        assert made(number).function(ENTERED)(2) == 3.8
    assert mappings() - before < 50, "at most a few wait to be unloaded"
    function = made(0).function(ENTERED)
    assert made(0) is one
    del one
    assert function(2) == 3.8


def test_closed_programs_leave_no_code() -> None:
    def program(number: int) -> pg.Program:
        kernel = pg.kernel(source=f"def k(p: Image) -> vec4:\n    return p[0, 0] * {number}.0625")
        return pg.compile(kernel(pg.Input("p", "rgba32f", (64, 64)), into=pg.target("o", "rgba32f")))

    def codes() -> int:
        gc.collect()
        return len(native._codes)

    image = np.ones((64, 64, 4), np.float32)
    with program(0) as made:
        made(p=image)
    before = codes()
    for number in range(1, 20):
        with program(number) as made:
            assert made(p=image)["o"][0, 0, 0] == number + 0.0625
    del made
    assert codes() <= before
