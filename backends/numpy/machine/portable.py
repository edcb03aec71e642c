"""Text that numba printed for this machine, as text for any: what jit.py makes and the package ships (shipped.py)."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import re

import llvmlite.binding as llvm

#: Names that numba makes of a function's path and of the types that it takes.
_MANGLED = re.compile(r"_ZN\w+")
#: One part of such a name, after its length.
_PART = re.compile(r"0?(\d+)")

#: What says where the text came from, or what LLVM found out and finds again: newer versions have words for it that
#: older ones cannot read.  Of an argument only ``noalias`` stays, which nothing can find out.
_DROPPED = (
    r"^target .*\n", r"^source_filename .*\n", r"^; ModuleID .*\n", r"^; Function Attrs: .*\n", r"^attributes #.*\n",
    r"(?<=.) #\d+(?=[ \n])", r" +; preds = .*$", r"\b(dso_local|local_unnamed_addr|noundef) ",
    r" (readonly|writeonly|readnone|nonnull|immarg|captures\([^)]*\)|initializes\(\([^)]*\)\))(?=[ ,)])",
    r"\brange\([^)]*\) ", r"\b(samesign|disjoint|nneg) ", r"(?<=trunc )(nuw |nsw )+",
    r"(?<=getelementptr )(nusw |nuw )+", r"(?<=getelementptr inbounds )nuw ",
)  # fmt: skip


def portable(text: str, function: str, name: str) -> str:
    """One function of a text with all that it calls inside, called ``name``: no processor's, no system's, and read by
    every LLVM from 20 on."""
    text = _readable(text.replace(f"@{function}(", f"@{name}("))
    module = llvm.parse_assembly(re.sub(r"^target .*\n", "", text, flags=re.MULTILINE))
    module.get_function(name).linkage = "external"
    _optimise(module)
    text = str(module)
    for pattern in _DROPPED:
        text = re.sub(pattern, "", text, flags=re.MULTILINE)
    # An entry point that calls it follows, where it is compiled.
    text = text.replace(f"define i32 @{name}(", f"define internal i32 @{name}(")
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _optimise(module: llvm.ModuleRef) -> None:
    """As far as any processor likes it: vectors are made where it is known what is run on."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(cpu="generic", features="", opt=2)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = options.slp_vectorization = options.loop_unrolling = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    module.verify()


def _readable(text: str) -> str:
    """Mangled names as the last part of their path and a number, in order of appearance: numba's own change from one
    process to the next."""
    known: dict[str, str] = {}
    counts: dict[str, int] = {}

    def name(found: re.Match[str]) -> str:
        mangled = found[0]
        if mangled not in known:
            rest, last = mangled[len("_ZN") :], ""
            while part := _PART.match(rest):
                end = part.end() + int(part[1])
                last, rest = rest[part.end() : end], rest[end:]
            counts[last] = counts.get(last, 0) + 1
            known[mangled] = f"{last.strip('_')}.{counts[last]}"
        return known[mangled]

    return _MANGLED.sub(name, text)
