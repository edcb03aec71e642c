"""LLVM: text becomes an object file for this processor.  Imported only where there is something to compile."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from functools import cache
from typing import Any

import llvmlite.binding as llvm


@cache
def machine() -> Any:
    """Target machine of this processor."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    name, features = host()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=name, features=features, opt=2, reloc="pic", codemodel="default")


@cache
def host() -> tuple[str, str]:
    """This processor's name and its features, as LLVM calls them."""
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def compiled(text: str, loops: int) -> bytes:
    """The object file of a module; ``loops`` as in `optimised`."""
    return bytes(machine().emit_object(optimised(text, loops=loops)))


def optimised(text: str, *, loops: int = 0) -> Any:
    """A module as it becomes machine code.

    In text of kernels what is to be a vector is one already: LLVM leaves loops alone and works at its level 2.
    Other text has loops over single numbers; where ``loops`` is not 0, it makes vectors of them at that level, 1 to 3.
    """
    module = llvm.parse_assembly(text)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=loops or 2)
    options.loop_vectorization, options.slp_vectorization, options.loop_unrolling = loops > 0, False, False
    builder = llvm.create_pass_builder(machine(), options)
    builder.getModulePassManager().run(module, builder)
    return module


@cache
def _engine() -> Any:
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine())


def load_object(code: bytes, function: str) -> int:
    """Where a function of an object file is, loaded by LLVM."""
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return int(engine.get_function_address(function))
