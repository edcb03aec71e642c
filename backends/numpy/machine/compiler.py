"""Compile LLVM text to object code for this processor, in parallel threads.

Imported only when there is something to compile.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import ctypes
import itertools
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, lru_cache, partial
from typing import Any

import llvmlite.binding as llvm
from llvmlite.binding import ffi
from llvmlite.binding.newpassmanagers import NewPassManager

from passgraph.backends.numpy.machine.llvm import POINTS

#: One per thread: a target machine caches results as it works.
_own = threading.local()
#: Libraries whose code is no longer used.
_unloaded: list[Any] = []
#: Libraries of one linker.  It takes 115 kB, and keeps 9 kB of each unloaded library (LLVM's JITDylib; seen in
#: llvmlite 0.50).
LIBRARIES = 16
#: Make the names of libraries unique.
_numbers = itertools.count()


@cache
def host() -> tuple[str, str]:
    """Return LLVM's name of this processor and its features."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def machine() -> Any:
    """Return a target machine of this processor, for this thread only."""
    if not hasattr(_own, "machine"):
        _own.machine = _new_machine()
    return _own.machine


def _new_machine() -> Any:
    name, features = host()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=name, features=features, opt=2, reloc="pic", codemodel="default")


def compiled(text: str, loops: int) -> bytes:
    """Return the object code of LLVM text; see :func:`optimised`."""
    # Each thread uses a context of its own.
    with llvm.create_context() as context, optimised(text, loops=loops, context=context) as module:
        with ffi.OutputString() as error:
            buffer = _without_lock("LLVMPY_TargetMachineEmitToMemory")(machine(), module, 1, error)
            if not buffer:
                raise RuntimeError(str(error))
        try:
            return ctypes.string_at(ffi.lib.LLVMPY_GetBufferStart(buffer), ffi.lib.LLVMPY_GetBufferSize(buffer))
        finally:
            ffi.lib.LLVMPY_DisposeMemoryBuffer(buffer)


def optimised(text: str, *, loops: int = 0, context: Any = None) -> Any:
    """Return an optimized module.

    Kernel text is already vectorized and shares common subexpressions.  So each function is simplified separately at
    LLVM's level 1: half the time of level 2 on whole modules, for equally fast code.  For loops over points one
    instruction pass suffices, in a third of that time; windows would be up to a twelfth slower.
    Other text has scalar loops; if ``loops`` is not 0, they are vectorized at that level, 1 to 3.
    """
    module = llvm.parse_assembly(text, context)
    try:
        _optimise(module, loops, POINTS in text)
    except BaseException:
        module.close()  # before its context, which LLVM accesses
        raise
    return module


def _optimise(module: Any, loops: int, points: bool) -> None:
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=loops or 1)
    options.loop_vectorization, options.slp_vectorization, options.loop_unrolling = loops > 0, False, False
    builder = llvm.create_pass_builder(machine(), options)
    run = _without_lock("LLVMPY_RunNewModulePassManager")
    if loops:
        with _disposing(builder.getModulePassManager()) as passes:
            run(passes, module, builder)
        return
    if len(_defined(module)) > 1:
        with _disposing(llvm.create_new_module_pass_manager()) as calls:
            calls.add_always_inliner_pass()
            calls.add_post_order_function_attributes_pass()  # functions that only read need not be called twice
            run(calls, module, builder)
    run = _without_lock("LLVMPY_RunNewFunctionPassManager")
    with _disposing(
        llvm.create_new_function_pass_manager() if points else builder.getFunctionPassManager()
    ) as simplify:
        if points:
            simplify.add_instruction_combine_pass()
        else:
            # The one pass of level 2 that speeds kernels up: it removes redundant computations across branches.
            simplify.add_new_gvn_pass()
        for function in _defined(module):
            run(simplify, function, builder)


@contextmanager
def _disposing(manager: Any) -> Iterator[Any]:
    """Free a pass manager at the end, up to 30 kB: llvmlite's classes inherit an empty ``_dispose`` (seen in 0.50)."""
    try:
        yield manager
    finally:
        NewPassManager._dispose(manager)


def _defined(module: Any) -> list[Any]:
    """Return the functions that a module defines; inlined ones are gone."""
    return [function for function in module.functions if not function.is_declaration]


def _without_lock(name: str) -> Any:
    """Return an LLVM function without llvmlite's global lock.

    LLVM only requires that threads share no context and no machine.
    """
    function = getattr(ffi.lib, name)
    return getattr(function, "_cfn", function)


def load_object(code: bytes, function: str) -> tuple[int, Callable[[], object]]:
    """Load a function of an object file through LLVM: return its address, and a function that unloads it. One thread at
    a time.

    Unloading is deferred to the next load: the garbage collector may unload it in a thread that is inside LLVM or
    forks.
    """
    while _unloaded:
        _unloaded.pop().close()
    builder = llvm.JITLibraryBuilder().add_object_img(code).add_current_process().export_symbol(function)
    number = next(_numbers)
    library = builder.link(_linker(number // LIBRARIES), f"{function}.{number}")
    return int(library[function]), partial(_unloaded.append, library)


@lru_cache(maxsize=1)
def _linker(generation: int) -> Any:
    """Return the linker of the newest libraries; older ones are freed with their last library.

    JITLink maps the sections of an object together.  LLVM's older loader (MCJIT) maps them wherever there is room,
    and ends the process where that is more than 2 GiB apart.
    """
    return llvm.create_lljit_compiler(machine(), use_jit_link=True)
