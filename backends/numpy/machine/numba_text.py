# mypy: disable-error-code="no-untyped-call,misc,unused-ignore,attr-defined"
"""Compile functions with numba and print them as LLVM text for any machine (development only)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm

#: numba's code to release arrays calls this for memory of numba's own, which our arrays never have.
_GIVE_BACK = "NRT_MemInfo_call_dtor"


@lru_cache(maxsize=1)
def dispatcher_class() -> type[Any]:
    """Return numba's CPU dispatcher for functions whose arrays do not overlap.

    Otherwise LLVM must assume that a store into one array changes the others, and loops stay scalar.  numba has the
    flag but no option for it, so the target options are replaced by a subclass that sets it; a test looks for
    ``noalias`` in the text.
    """
    from numba.core.cpu import CPUTargetOptions
    from numba.core.registry import CPUDispatcher, CPUTarget, cpu_target

    class NoAliasOptions(CPUTargetOptions):  # type: ignore[misc]
        def finalize(self, flags: Any, options: Any) -> None:
            super().finalize(flags, options)
            flags.noalias = True

    class NoAliasTarget(CPUTarget):  # type: ignore[misc]
        options = NoAliasOptions

        # One context for all: types and compiled functions are those of the ordinary target.
        @property
        def typing_context(self) -> Any:
            return cpu_target.typing_context

        @property
        def target_context(self) -> Any:
            return cpu_target.target_context

    class NoAliasDispatcher(CPUDispatcher):  # type: ignore[misc]
        targetdescr = NoAliasTarget("cpu")

    return NoAliasDispatcher


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function for other code to call: no GIL, IEEE arithmetic, non-overlapping arrays."""
    options = {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": False}
    return dispatcher_class()(py_func=function, targetoptions=options)


def llvm_text(function: Callable[..., Any], pieces: int, kinds: Sequence[str]) -> tuple[str, str]:
    """Return numba's LLVM text of a function and its callees, and its name there.

    ``pieces`` and ``kinds`` describe its arguments, see :class:`~.shipped.NumbaCode`.
    """
    from numba import types
    from numba.core.compiler import Flags, compile_extra
    from numba.core.registry import cpu_target

    elements = {"i64": types.int64, "i32": types.int32, "u8": types.uint8, "f64": types.float64, "f32": types.float32}
    argument_types: list[Any] = [types.int64] * pieces
    for kind in kinds:
        element, _, rest = kind.partition("[")
        argument_types.append(types.Array(elements[element], int(rest[0]), "C") if rest else elements[element])
    flags: Any = Flags()
    flags.error_model, flags.boundscheck, flags.nrt, flags.noalias = "numpy", False, False, True
    flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
    with _unoptimised():
        context = cpu_target.target_context
        compiled = compile_extra(cpu_target.typing_context, context, function, tuple(argument_types), None, flags, {})
    assert compiled.signature.return_type in (types.int64, types.none)
    text = compiled.library.get_llvm_str()
    # Internal functions need not be visible, and may be inlined.
    text = re.sub(r"^define (?!internal)(linkonce_odr )?", "define internal ", text, flags=re.MULTILINE)
    text = re.sub(r"= common (local_unnamed_addr )?global", "= internal global", text)
    text = re.sub(rf"^declare void @{_GIVE_BACK}\(ptr\).*$", "", text, flags=re.MULTILINE)
    text += f"\ndefine internal void @{_GIVE_BACK}(ptr %memory) {{\n  ret void\n}}\n"
    return text, compiled.fndesc.llvm_func_name


@contextmanager
def _unoptimised() -> Iterator[None]:
    """Keep numba from optimizing for the processor of the build machine."""
    from numba.core import config

    before = config.OPT
    config.OPT = type(before)(0)
    try:
        yield
    finally:
        config.OPT = before


#: Names that numba builds from a function's path and argument types.
_MANGLED = re.compile(r"_ZN\w+")
#: One part of such a name, after its length.
_PART = re.compile(r"0?(\d+)")

#: Origin of the text, and attributes that LLVM can derive again: newer versions use words that older ones cannot read.
#: Of arguments only ``noalias`` stays, which cannot be derived.
_DROPPED = (
    r"^target .*\n", r"^source_filename .*\n", r"^; ModuleID .*\n", r"^; Function Attrs: .*\n", r"^attributes #.*\n",
    r"(?<=.) #\d+(?=[ \n])", r" +; preds = .*$", r"\b(dso_local|local_unnamed_addr|noundef) ",
    r" (readonly|writeonly|readnone|nonnull|immarg|captures\([^)]*\)|initializes\(\([^)]*\)\))(?=[ ,)])",
    r"\brange\([^)]*\) ", r"\b(samesign|disjoint|nneg) ", r"(?<=trunc )(nuw |nsw )+",
    r"(?<=getelementptr )(nusw |nuw )+", r"(?<=getelementptr inbounds )nuw ",
)  # fmt: skip


def portable(text: str, function: str, name: str) -> str:
    """Return one function with all its callees inlined, called ``name``: independent of processor and system, and
    readable by every LLVM from 20 on."""
    text = _readable(text.replace(f"@{function}(", f"@{name}("))
    module = llvm.parse_assembly(re.sub(r"^target .*\n", "", text, flags=re.MULTILINE))
    module.get_function(name).linkage = "external"
    _optimise(module)
    text = str(module)
    for pattern in _DROPPED:
        text = re.sub(pattern, "", text, flags=re.MULTILINE)
    # When compiled, it is followed by an entry point that calls it.
    text = text.replace(f"define i32 @{name}(", f"define internal i32 @{name}(")
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _optimise(module: llvm.ModuleRef) -> None:
    """Optimize as far as is independent of the processor; vectorization waits until the processor is known."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(cpu="generic", features="", opt=2)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = options.slp_vectorization = options.loop_unrolling = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    module.verify()


def _readable(text: str) -> str:
    """Replace mangled names by the last part of their path and a number, in order of appearance: numba's own names
    change from one process to the next."""
    short_names: dict[str, str] = {}
    counts: dict[str, int] = {}

    def name(match: re.Match[str]) -> str:
        mangled = match[0]
        if mangled not in short_names:
            rest, last = mangled[len("_ZN") :], ""
            while part := _PART.match(rest):
                end = part.end() + int(part[1])
                last, rest = rest[part.end() : end], rest[end:]
            counts[last] = counts.get(last, 0) + 1
            short_names[mangled] = f"{last.strip('_')}.{counts[last]}"
        return short_names[mangled]

    return _MANGLED.sub(name, text)
