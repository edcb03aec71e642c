"""Machine code as one run of bytes that works wherever it lies: linked when it is compiled, loaded without LLVM.

LLVM makes an object file: sections, and places in them that hold distances to others.  Once its sections lie side by
side every such distance is known, and a function of the C library (the few that LLVM calls by itself, as ``memset``) is
reached by a jump of its own behind them.  What is not of this kind (another processor or file format) stays an object
for LLVM to load.
"""

from __future__ import annotations

import ctypes
import mmap
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, ClassVar

#: Begins what is linked; the format's number is its last byte.
MARK = b"passgraph code 3"
#: Where it is entered, and how many bytes the names take of the functions that it jumps to, which come next.
_HEAD = struct.Struct("<QQ")
#: ``jmp *[rip]``, before the address that it jumps to: set where the code is loaded, since each process has another.
_JUMP = struct.Struct("<6sQ2x")
_JUMP_BEHIND = bytes.fromhex("ff2500000000")
#: What every C library has of what LLVM calls by itself.
_OUTSIDE = frozenset(
    {"memset", "memcpy", "memmove", *(f"{name}{kind}" for name in ("exp2", "log2") for kind in ("", "f"))}
)

# System V ABI, chapter 4 "Object files", and its AMD64 supplement.
_ELF_64_LITTLE = b"\x7fELF\x02\x01"
_RELOCATABLE, _AMD64 = 1, 62
_WRITTEN, _IN_MEMORY = 1, 2
_PROGBITS, _SYMBOLS, _RELOCATIONS = 1, 2, 4
#: Where code and data are that unwinders ask for: nothing here is thrown.
_UNWIND = b".eh_frame"
#: The distance from its own place, to a symbol or to a function's entry: the same where all is in one module.
_DISTANCES = (2, 4)


@dataclass(frozen=True)
class _Section:
    layout: ClassVar = struct.Struct("<IIQQQQIIQQ")
    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    alignment: int
    entry_bytes: int


def linked(code: bytes, function: str) -> bytes | None:
    """An object file as code for anywhere, entered at ``function``; None for what only LLVM can load."""
    if code[:6] != _ELF_64_LITTLE or struct.unpack_from("<HH", code, 16) != (_RELOCATABLE, _AMD64):
        return None
    (first,) = struct.unpack_from("<Q", code, 40)
    count, names = struct.unpack_from("<HH", code, 60)
    sections = [_Section(*_Section.layout.unpack_from(code, first + 64 * n)) for n in range(count)]
    image, places = bytearray(), dict[int, int]()
    for number, section in enumerate(sections):
        if not section.flags & _IN_MEMORY or _text(code, sections[names], section.name) == _UNWIND:
            continue
        if section.kind != _PROGBITS or section.flags & _WRITTEN:
            return None
        image += bytes(-len(image) % max(section.alignment, 1))
        places[number] = len(image)
        image += code[section.offset : section.offset + section.size]
    image += bytes(-len(image) % _JUMP.size)
    jumps, outside = len(image), dict[str, int]()
    table = next(section for section in sections if section.kind == _SYMBOLS)
    symbols = list(struct.iter_unpack("<IBBHQQ", code[table.offset : table.offset + table.size]))
    for section in sections:
        if section.kind != _RELOCATIONS or section.info not in places:
            continue
        start = places[section.info]
        for offset, what, added in struct.iter_unpack("<QQq", code[section.offset : section.offset + section.size]):
            named, _, _, home, value, _ = symbols[what >> 32]
            if what & 0xFFFFFFFF not in _DISTANCES:
                return None
            if home in places:
                to = places[home] + value
            elif (name := _text(code, sections[table.link], named).decode()) in _OUTSIDE:
                to = jumps + _JUMP.size * outside.setdefault(name, len(outside))
            else:
                return None
            struct.pack_into("<i", image, start + offset, to + added - (start + offset))
    for name, _, _, home, value, _ in symbols:
        if home in places and _text(code, sections[table.link], name) == function.encode():
            called = " ".join(outside).encode()
            return MARK + _HEAD.pack(places[home] + value, len(called)) + called + image
    return None


def _text(code: bytes, strings: _Section, at: int) -> bytes:
    return code[strings.offset + at : code.index(b"\0", strings.offset + at)]


def loaded(code: bytes) -> tuple[int, Callable[[], object]]:
    """Where the function is that `linked` code is entered at, and what unloads it, when no thread may be in it.

    Raises
    ------
    OSError
        Where the system gives no memory for code.
    """
    entry, named = _HEAD.unpack_from(code, len(MARK))
    names = len(MARK) + _HEAD.size
    image, system = bytearray(code[names + named :]), _system()
    for name in code[names : names + named].decode().split():
        image += _JUMP.pack(_JUMP_BEHIND, _address(name))
    readable, private = mmap.PROT_READ | mmap.PROT_WRITE, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    address: int | None = system.mmap(None, len(image), readable, private, -1, 0)
    if address is None or address == ctypes.c_void_p(-1).value:
        raise OSError(ctypes.get_errno(), "no memory for code")
    ctypes.memmove(address, bytes(image), len(image))
    # Never both written and run.
    if system.mprotect(address, len(image), mmap.PROT_READ | mmap.PROT_EXEC):
        error = ctypes.get_errno()
        system.munmap(address, len(image))
        raise OSError(error, "memory for code cannot be run")
    return address + int(entry), partial(system.munmap, address, len(image))


def _address(name: str) -> int:
    address = ctypes.cast(getattr(_system(), name), ctypes.c_void_p).value
    assert address is not None
    return address


@cache
def _system() -> Any:
    library = ctypes.CDLL(None, use_errno=True)
    library.mmap.restype = ctypes.c_void_p
    library.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
    library.mprotect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
    library.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
    return library
