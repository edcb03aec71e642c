"""Machine code from LLVM text of our own, kept on disk: a second process needs no compiler."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from passgraph.disk_cache import recall, remember, text_digest
from passgraph.language import borders

#: Held by whoever compiles or loads: LLVM's engine and what numba knows are one for the process, made once.
_compiling = threading.RLock()
if hasattr(os, "register_at_fork"):
    # A child must not begin with a lock, or half a module, of a thread that it does not have.
    os.register_at_fork(
        before=_compiling.acquire, after_in_parent=_compiling.release, after_in_child=_compiling.release
    )


@lru_cache(maxsize=1)
def _machine() -> tuple[Any, str, str]:
    """Target machine of this processor, its name and its features."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    name, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    target = llvm.Target.from_default_triple()
    return (
        target.create_target_machine(cpu=name, features=features, opt=2, reloc="pic", codemodel="default"),
        name,
        features,
    )


def lanes() -> int:
    """Numbers in one vector: a register's worth where there are many registers."""
    with _compiling:
        return 16 if "+avx512f" in _machine()[2] else 8


@lru_cache(maxsize=1)
def _engine() -> Any:
    empty = llvm.parse_assembly("")
    return llvm.create_mcjit_compiler(empty, _machine()[0])


_loaded: dict[str, int] = {}


def function_address(parts: tuple[str, ...], emit: Callable[[str], str], *, loops: int = 0) -> int:
    """Where the function is that ``emit(name)`` gives the LLVM text of; ``parts`` tell it from every other.

    ``loops``: the level at which LLVM makes vectors of its loops, see :func:`optimised`.

    Threads take turns: what one is compiling, another that asks for it finds made.
    """
    with _compiling:
        return _address(parts, emit, loops)


def _address(parts: tuple[str, ...], emit: Callable[[str], str], loops: int) -> int:
    _, cpu, features = _machine()
    # Border rules come from the language's own text, beside the programs among the parts.
    texts = (text_digest(Path(__file__).parents[1], (".py", ".ll")), text_digest(Path(borders.__file__).parent))
    told = (*texts, llvmlite.__version__, cpu, features, *parts)
    key = hashlib.sha256("\0".join(told).encode()).hexdigest()[:40]
    if key not in _loaded:
        name = f"pg_{key}"
        code = recall("code", f"{name}.o")
        if code is None:
            code = _compiled(emit(name), loops)
            remember("code", f"{name}.o", code)
        engine = _engine()
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        _loaded[key] = engine.get_function_address(name)
    return _loaded[key]


def _compiled(text: str, loops: int) -> bytes:
    return bytes(_machine()[0].emit_object(optimised(text, loops=loops)))


def optimised(text: str, *, loops: int = 0) -> Any:
    """A module as it becomes machine code.

    In text of kernels what is to be a vector is one already: LLVM leaves loops alone and works at its level 2.
    Other text has loops over single numbers; where ``loops`` is not 0, it makes vectors of them at that level, 1 to 3.
    """
    machine = _machine()[0]
    module = llvm.parse_assembly(text)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=loops or 2)
    options.loop_vectorization, options.slp_vectorization, options.loop_unrolling = loops > 0, False, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return module
