"""LLVM's text as it is written here, held against what `llvmlite.ir` writes of the same calls."""

from __future__ import annotations

import math
import re
from typing import Any

import llvmlite.binding as binding
import llvmlite.ir
import numpy as np
import pytest

from passgraph.backends.numpy.machine import llvm


def read(text: str) -> str:
    """The text as LLVM understands it, names in the order of their appearance."""
    with binding.create_context() as context, binding.parse_assembly(text, context) as module:
        module.verify()
        found, known = str(module), dict[str, str]()
    found = "\n".join(line.partition(" ; ")[0].rstrip() for line in found.splitlines() if not line.startswith(";"))
    found = re.sub(r'^(?:source_filename|target).*\n|""', "", found, flags=re.MULTILINE)
    labels = re.compile(r'(?<=%)"?[\w.]+"?|^"?[\w.]+"?(?=:)', re.MULTILINE)
    return labels.sub(lambda m: known.setdefault(m[0].strip('"'), f"n{len(known)}"), found).strip()


def both(write: Any, arguments: str) -> tuple[str, str]:
    """What a function makes of both kinds of builder, each with its module of types."""
    texts = []
    for kinds in (llvmlite.ir, llvm):
        module = kinds.Module("m")
        types = {"i": kinds.IntType(32), "l": kinds.IntType(64), "f": kinds.FloatType(), "p": kinds.PointerType()}
        types |= {"b": kinds.IntType(1), "F": kinds.VectorType(types["f"], 8), "I": kinds.VectorType(types["i"], 8)}
        signature = kinds.FunctionType(kinds.VoidType(), [types[letter] for letter in arguments])
        function = kinds.Function(module, signature, "made")
        if kinds is llvm:
            b: Any = llvm.IRBuilder(function)
        else:
            b = llvmlite.ir.IRBuilder(function.append_basic_block("entry"))
        write(b, kinds, types, *function.args)
        if not b.block.is_terminated:
            b.ret_void()
        texts.append(read(str(module)))
    return texts[0], texts[1]


def arithmetic(b: Any, kinds: Any, types: Any, x: Any, y: Any, m: Any, n: Any, p: Any) -> None:
    for name in ("fadd", "fsub", "fmul", "fdiv"):
        b.store(getattr(b, name)(x, y), p, align=4)
    for name in ("add", "sub", "mul", "sdiv", "srem", "shl", "ashr", "lshr", "and_", "or_", "xor"):
        b.store(getattr(b, name)(m, n), p)
    b.store(b.fneg(x), p)
    b.store(b.not_(m), p)
    for sign in ("<", "<=", ">", ">=", "==", "!="):
        for name, one, other in (("icmp_signed", m, n), ("icmp_unsigned", m, n), ("fcmp_ordered", x, y)):
            compared = getattr(b, name)(sign, one, other)
            b.store(b.select(compared, one, other), p)
    b.store(b.fcmp_unordered("!=", x, y), p)
    b.store(b.fcmp_unordered("uno", x, y), p)


@pytest.mark.parametrize("kinds", ["ffiip", "FFIIp"])
def test_arithmetic_on_numbers_and_vectors(kinds: str) -> None:
    expected, made = both(arithmetic, kinds)
    assert made == expected
    assert made.count(" = ") > 40


def casts(b: Any, kinds: Any, types: Any, i: Any, f: Any, long: Any, p: Any) -> None:
    half, double = kinds.HalfType(), kinds.DoubleType()
    made = (
        b.sext(i, types["l"]), b.zext(i, types["l"]), b.trunc(long, types["i"]), b.bitcast(i, types["f"]),
        b.fptrunc(f, half), b.fpext(f, double), b.sitofp(i, types["f"]), b.uitofp(i, types["f"]),
        b.fptosi(f, types["i"]), b.inttoptr(long, types["p"]),
    )  # fmt: skip
    for value in made:
        b.store(value, p)
    assert b.sext(i, types["i"]) is i


def test_casts() -> None:
    expected, made = both(casts, "iflp")
    assert made == expected


def constants(b: Any, kinds: Any, types: Any, p: Any) -> None:
    for value in (0.0, -0.0, 0.1, 1e-45, 3.4e38, 16777217.0):
        b.store(kinds.Constant(types["f"], value), p)
        b.store(kinds.Constant(kinds.DoubleType(), value), p)
    for value in (0.0, -1.5, 0.1, 6e-8):
        b.store(kinds.Constant(kinds.HalfType(), value), p)
    for value in (0, 1, -1, 2**31 - 1, -(2**31)):
        b.store(kinds.Constant(types["i"], value), p)
    for bit in (0, 1, True, False):
        b.store(kinds.Constant(types["b"], bit), p)
    for special in (math.nan, math.inf, -math.inf):
        bits = int(np.float32(special).view(np.int32))
        b.store(kinds.Constant(types["i"], bits).bitcast(types["f"]), p)
    entries = [kinds.Constant(types["i"], n) for n in (3, 1, 2)]
    b.store(kinds.Constant(kinds.ArrayType(types["i"], 3), entries), p)


def test_constants_round_to_their_type() -> None:
    expected, made = both(constants, "p")
    assert made == expected


def memory(b: Any, kinds: Any, types: Any, p: Any, i: Any, x: Any) -> None:
    array = b.alloca(types["f"], kinds.Constant(types["l"], 7))
    b.store(b.load(array, typ=types["F"], align=4), b.alloca(types["F"]))
    place = b.gep(p, [i], True, source_etype=types["f"])
    b.store(b.load(place, typ=types["f"]), b.gep(place, [i, i], source_etype=kinds.ArrayType(types["f"], 3)))
    b.atomic_rmw("add", p, i, "monotonic")
    one = kinds.Constant(types["i"], 1)
    b.store(b.insert_element(x, b.extract_element(x, one), i), p)
    order = kinds.Constant(kinds.VectorType(types["i"], 2), [1, 9]) if kinds is llvmlite.ir else None
    order = order or llvm.Value(kinds.VectorType(types["i"], 2), "<i32 1, i32 9>")
    pair = b.shuffle_vector(x, x, order)
    b.store(pair, p)
    kind = kinds.LiteralStructType([types["f"], pair.type])
    packed = b.insert_value(b.load(p, typ=kind), pair, 1)
    b.store(b.extract_value(packed, 0), p)


def test_memory_vectors_and_structs() -> None:
    expected, made = both(memory, "piF")
    assert made == expected


def branches(b: Any, kinds: Any, types: Any, c: Any, p: Any, i: Any) -> None:
    declared = kinds.Function(b.module, kinds.FunctionType(types["f"], [types["f"]]), "binding.fabs.f32")
    found = b.call(declared, [kinds.Constant(types["f"], -2.0)])
    through = b.inttoptr(b.sext(i, types["l"]), kinds.PointerType(kinds.FunctionType(kinds.VoidType(), [types["i"]])))
    b.call(through, [i], attrs=("noinline",))
    with b.if_then(c):
        b.store(found, p)
        with b.if_else(c) as (one, other):
            with one:
                b.store(i, p)
            with other:
                b.ret_void()
    begin, turn, behind = b.block, b.append_basic_block("turn"), b.append_basic_block("behind")
    b.branch(turn)
    b.position_at_end(turn)
    at = b.phi(types["i"])
    other = b.phi(types["f"])
    after = b.add(at, i)
    with b.goto_entry_block():
        early = b.sub(i, i)
    b.cbranch(b.icmp_signed("<", after, early), turn, behind)
    for value, block in ((i, begin), (after, turn)):
        at.add_incoming(value, block)
        other.add_incoming(found, block)
    b.position_at_end(behind)


def test_branches_loops_and_calls() -> None:
    """What goes to the entry block stands before its end; both sides of a branch meet unless one has ended."""
    expected, made = both(branches, "bpi")
    assert made == expected


def test_what_is_said_of_arguments_functions_loads_and_branches() -> None:
    module = llvm.Module("m")
    function = llvm.Function(
        module, llvm.FunctionType(llvm.IntType(1), [llvm.PointerType(), llvm.PointerType()]), "said"
    )
    function.linkage = "internal"
    function.attributes |= {"alwaysinline"}
    function.args[0].add_attribute("noalias")
    function.args[0].add_attribute("dereferenceable(64)")
    b = llvm.IRBuilder(function)
    table = llvm.GlobalVariable(
        module, llvm.Constant(llvm.ArrayType(llvm.IntType(1), 1), [llvm.Constant(llvm.IntType(1), 1)])
    )
    loaded = [b.load(place, typ=llvm.IntType(1), steady=True) for place in (*function.args, table)]
    one, other = b.append_basic_block("one"), b.append_basic_block("other")
    b.cbranch(loaded[0], one, other, (1000, 1))
    for block, value in ((one, loaded[1]), (other, loaded[2])):
        b.position_at_end(block)
        b.ret(value)
    text = read(str(module))
    assert "define internal i1 @said(ptr noalias dereferenceable(64) %n0, ptr %n1)" in text
    assert "alwaysinline" in text
    assert "@table.1 = internal constant [1 x i1] [i1 true]" in text
    assert text.count("!invariant.load") == 3
    assert '!{!"branch_weights", i32 1000, i32 1}' in text


def test_equal_types_are_one() -> None:
    assert llvm.VectorType(llvm.IntType(32), 8) is llvm.VectorType(llvm.IntType(32), 8)
    assert llvm.FunctionType(llvm.VoidType(), [llvm.IntType(8)]) is llvm.FunctionType(
        llvm.VoidType(), (llvm.IntType(8),)
    )
    assert llvm.IntType(32) is not llvm.IntType(64)
    assert llvm.PointerType(llvm.FunctionType(llvm.VoidType(), [])) is not llvm.PointerType()
