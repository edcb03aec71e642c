"""What numba compiles: Python functions over arrays and numbers, to LLVM text that stands by itself.

Only who changes such functions needs this, and numba: their text is shipped (shipped.py).
"""

# mypy: disable-error-code="no-untyped-call,misc,unused-ignore,attr-defined"
from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

#: numba's code for giving back arrays calls this for memory of numba's own, which no array here has.
_GIVE_BACK = "NRT_MemInfo_call_dtor"


@lru_cache(maxsize=1)
def dispatcher_class() -> type[Any]:
    """numba's CPU dispatcher whose functions promise that their arrays do not overlap.

    Without that promise LLVM must assume that a store into one array changes the others, and loops stay scalar.  numba
    has the flag but no option for it, so the target options are swapped for a subclass that sets it; pinned by a test
    that looks for ``noalias`` in the text.
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
    """A function for others to call: no GIL, IEEE arithmetic, arrays apart."""
    options = {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": False}
    return dispatcher_class()(py_func=function, targetoptions=options)


def llvm_text(function: Callable[..., Any], pieces: int, kinds: Sequence[str]) -> tuple[str, str]:
    """LLVM text of a function and of all that it calls as numba writes it down, and its name there.

    ``pieces`` and ``kinds`` say what it takes, see :class:`~.numba_code.NumbaCode`.
    """
    from numba import types
    from numba.core.compiler import Flags, compile_extra
    from numba.core.registry import cpu_target

    elements = {"i64": types.int64, "i32": types.int32, "u8": types.uint8, "f64": types.float64, "f32": types.float32}
    given: list[Any] = [types.int64] * pieces
    for kind in kinds:
        element, _, rest = kind.partition("[")
        given.append(types.Array(elements[element], int(rest[0]), "C") if rest else elements[element])
    flags: Any = Flags()
    flags.error_model, flags.boundscheck, flags.nrt, flags.noalias = "numpy", False, False, True
    flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
    with _unoptimised():
        context = cpu_target.target_context
        made = compile_extra(cpu_target.typing_context, context, function, tuple(given), None, flags, {})
    assert made.signature.return_type in (types.int64, types.none)
    text = made.library.get_llvm_str()
    # What is called from here alone need not be seen, and may become part of the caller.
    text = re.sub(r"^define (?!internal)(linkonce_odr )?", "define internal ", text, flags=re.MULTILINE)
    text = re.sub(r"= common (local_unnamed_addr )?global", "= internal global", text)
    text = re.sub(rf"^declare void @{_GIVE_BACK}\(ptr\).*$", "", text, flags=re.MULTILINE)
    text += f"\ndefine internal void @{_GIVE_BACK}(ptr %memory) {{\n  ret void\n}}\n"
    return text, made.fndesc.llvm_func_name


@contextmanager
def _unoptimised() -> Iterator[None]:
    """numba optimises for the processor of the machine that it runs on."""
    from numba.core import config

    before = config.OPT
    config.OPT = type(before)(0)
    try:
        yield
    finally:
        config.OPT = before
