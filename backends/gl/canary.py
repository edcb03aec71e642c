"""Tells whether a context is still the one that it was: an address may be given to another one anew."""

from __future__ import annotations

import ctypes
import secrets

from passgraph.backends.gl import functions as g
from passgraph.backends.gl.functions import Functions
from passgraph.errors import BackendError


class OtherContextError(BackendError):
    """The context that is current is not the one that something was made in."""


class Canary:
    """A shader object that nobody compiles.  Such objects are shared, can be looked at without being bound, and keep
    their text: another context has no shader of this number, or one of another text."""

    def __init__(self, gl: Functions) -> None:
        self.gl = gl
        self.text = f"// passgraph {secrets.token_hex(8)}".encode()
        self.name: int = gl.CreateShader(g.FRAGMENT_SHADER)
        source = ctypes.c_char_p(self.text)
        gl.ShaderSource(self.name, 1, ctypes.byref(source), None)
        self._room = ctypes.create_string_buffer(len(self.text) + 1)

    def lives(self) -> bool:
        """Whether the current context shares objects with the one that it was made in."""
        if not self.gl.IsShader(self.name):
            return False
        self.gl.GetShaderSource(self.name, len(self._room), None, self._room)
        return self._room.value == self.text

    def look(self) -> None:
        """Raise OtherContextError where it does not."""
        if not self.lives():
            raise OtherContextError(
                "gl: the OpenGL context that this host was made in is gone, and another one is in its place; close "
                "this host and ask for Host.current() anew"
            )

    def release(self) -> None:
        self.gl.DeleteShader(self.name)
