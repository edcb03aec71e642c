"""Everything that OpenGL can be asked for, of the current context: asked by going through all numbers there are."""

from __future__ import annotations

import ctypes
from typing import Any, TypeAlias

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.gl_functions import Functions

#: What was asked, and for which index or unit → what came back.
State: TypeAlias = dict[tuple[str, int, int], bytes]
#: Behind it lie vendors' own, of which Mesa 22 has two that end the process.
_LAST, _ROOM, _NAMES = 0x9580, 4096, 400
#: Clocks and free memory.
_CHANGING = {0x8E28, 0x9047, 0x9048, 0x9049, 0x904A, 0x904B, 0x87FB, 0x87FC, 0x87FD}
_UNITS, _UNIT_NUMBERS = 16, (0x8068, 0x8069, 0x806A, 0x8514, 0x84F6, 0x8C1C, 0x8C1D, 0x9104, 0x9105, 0x8C2C, 0x8919)
_KINDS = ("Texture", "Buffer", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader", "Sampler")


class Dump:
    """Of one context; which numbers it knows is found once."""

    def __init__(self, gl: Functions) -> None:
        self.gl = gl
        self._ints, self._room = (ctypes.c_int64 * _ROOM)(), (ctypes.c_int * 64)()
        gl.drain()
        self.numbers = [n for n in range(1, _LAST) if n not in _CHANGING and self._knows(n)]
        self.indexed = [
            (n, k) for n in self.numbers_with_index() for k in range(16) if self._asked(gl.GetIntegeri_v, n, k)
        ]

    def _knows(self, number: int) -> bool:
        self.gl.GetInteger64v(number, self._ints)
        return bool(self.gl.GetError() == g.NO_ERROR)

    def _asked(self, ask: Any, *arguments: Any) -> bool:
        ask(*arguments, self._room)
        return bool(self.gl.GetError() == g.NO_ERROR)

    def numbers_with_index(self) -> list[int]:
        """Also those that are known with an index alone."""
        return [n for n in range(1, _LAST) if n not in _CHANGING and self._asked(self.gl.GetIntegeri_v, n, 0)]

    def __call__(self) -> State:
        gl, found = self.gl, State()
        gl.drain()
        for number in self.numbers:
            ctypes.memset(self._ints, 0, 512)
            gl.GetInteger64v(number, self._ints)
            found["integer", number, 0] = bytes(self._ints)[:512]
            ctypes.memset(self._room, 0, 64)
            gl.GetFloatv(number, self._room) if number not in _LONG else None
            found["float", number, 0] = bytes(self._room)
        for number, index in self.indexed:
            ctypes.memset(self._room, 0, 64)
            gl.GetIntegeri_v(number, index, self._room)
            found["indexed", number, index] = bytes(self._room)
        active = gl.integer(0x84E0)
        for unit in range(_UNITS):
            gl.ActiveTexture(g.TEXTURE0 + unit)
            for number in _UNIT_NUMBERS:
                found["unit", number, unit] = gl.integer(number).to_bytes(4, "little", signed=True)
        gl.ActiveTexture(active)
        gl.drain()
        return found


#: Lists that may be longer than the room for floats.
_LONG = {0x86A3, 0x87FF, 0x8DF8, 0x8DF9}


def texture_parameters(gl: Functions, target: int, name: int) -> State:
    """All of a texture's."""
    found, room, before = State(), (ctypes.c_int * 16)(), gl.integer(0x8069)
    gl.BindTexture(target, name)
    for number in range(0x800, _LAST):
        ctypes.memset(room, 0, 64)
        gl.GetTexParameteriv(target, number, room)
        if gl.GetError() == g.NO_ERROR:
            found["texture", number, name] = bytes(room)
    gl.BindTexture(target, before)
    return found


def objects(gl: Functions) -> set[tuple[str, int]]:
    """Every object of the current context."""
    return {(kind, name) for kind in _KINDS for name in range(1, _NAMES) if getattr(gl, f"Is{kind}")(name)}


def differences(before: State, after: State) -> list[str]:
    """What is no longer as it was, in words."""
    keys = sorted(before.keys() | after.keys())
    return [
        f"{what} {number:#06x}[{index}]"
        for what, number, index in keys
        if before.get((what, number, index)) != after.get((what, number, index))
    ]
