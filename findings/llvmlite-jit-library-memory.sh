#!/usr/bin/env bash
# 1. Most would guess: closing the resource tracker of a JIT library (llvmlite's OrcJIT binding) gives back all of its
#    memory, so that a service may load and unload libraries in one LLJIT for ever.
# 2. What is: the code is unmapped, but about 8 kB a library stay until the LLJIT itself is closed, since the library's
#    JITDylib is cleared and not removed from its session. A new LLJIT every few libraries keeps memory level: an old
#    one is freed with its last library.
# 3. llvmlite 0.50.0, ffi/orcjit.cpp, LLVMPY_LLJIT_Dylib_Tracker_Dispose; Linux, glibc 2.33 or later (mallinfo2).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet "llvmlite==0.50.0"
cat > measure.py <<'PY'
import ctypes, sys
import llvmlite.binding as llvm

llvm.initialize_native_target()
llvm.initialize_native_asmprinter()
machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
module = llvm.parse_assembly("define i32 @answer() {\n  ret i32 42\n}\n")
code = machine.emit_object(module)
numbers = iter(range(10**9))


class Mallinfo2(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in
                "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost".split()]


libc = ctypes.CDLL(None)
libc.mallinfo2.restype = Mallinfo2


def in_use():
    info = libc.mallinfo2()
    return info.uordblks + info.hblkhd


def load_and_unload(jit):
    library = llvm.JITLibraryBuilder().add_object_img(code).export_symbol("answer").link(jit, f"l{next(numbers)}")
    assert ctypes.CFUNCTYPE(ctypes.c_int32)(library["answer"])() == 42
    library.close()


def one_for_all(count, jit=llvm.create_lljit_compiler(machine, use_jit_link=True)):
    for _ in range(count):
        load_and_unload(jit)


def renewed(count):
    for first in range(0, count, 16):
        jit = llvm.create_lljit_compiler(machine, use_jit_link=True)
        for _ in range(min(16, count - first)):
            load_and_unload(jit)
        jit.close()


found = []
for way in (one_for_all, renewed):
    way(64)
    before = in_use()
    way(512)
    found.append((in_use() - before) / 512)
    print(f"{way.__name__}: {found[-1]:.0f} bytes stay of each library that was closed")
sys.exit(0 if found[0] > 4000 and found[1] < 200 else 1)
PY
venv/bin/python measure.py
