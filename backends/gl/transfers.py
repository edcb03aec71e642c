"""Transfer pictures between the caller's memory and textures directly, if OpenGL can express their row layout.

Drivers do no rounding.  Numbers are transferred unconverted; halves to float32 is exact.  Our own pass quantizes
float32.  Normalized integers are divided on the host, in cache: drivers multiply by a rounded reciprocal (llvmpipe
does), and integers are a quarter or half of the bytes to read back.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, FloatBlock
from passgraph.backends.driver import shaped
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.passes import run_pixels
from passgraph.backends.gl.state import Rows
from passgraph.backends.gl.textures import (
    FLOAT_TYPE,
    RGBA,
    Texture,
    gl_format_of,
    placements_of,
    with_stencil,
)
from passgraph.formats import FORMATS, Format, float_format
from passgraph.language.scalar import ScalarProgram
from passgraph.quantise import convert, converted, numbers_of, transfer_format

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend

#: The host converts up to this many numbers faster than a pass starts.
SMALL = 1 << 14
_HALF = 0x140B
#: OpenGL's types → NumPy's names.
_READ_AS = {0x1401: np.uint8, 0x1403: np.uint16, FLOAT_TYPE: np.float32}
#: Formats other than four channels in which the bound framebuffer is read.
_OFFERED_FORMAT, _OFFERED_TYPE = 0x8B9B, 0x8B9A
_EMPTY = Block(np.zeros(1, np.float32), np.zeros(1, np.int32))


def rows_of(array: NDArray[Any]) -> Rows | None:
    """Return the row layout of an array (height, width, channels) for OpenGL; None if OpenGL cannot express it.

    >>> rows_of(np.zeros((4, 8, 3), np.uint8)[:, 2:5]), rows_of(np.zeros((4, 8, 3), np.uint8)[::-1])
    (Rows(length=8, alignment=1), None)
    """
    height, width, channels = array.shape
    pixel = channels * array.itemsize
    if not array.dtype.isnative or not array.flags.aligned:
        return None
    if (channels > 1 and array.strides[2] != array.itemsize) or (width > 1 and array.strides[1] != pixel):
        return None
    if height == 1:
        return Rows(width)
    length = array.strides[0] // pixel
    if length < width:
        return None
    fits = (n for n in (1, 2, 4, 8) if -(-length * pixel // n) * n == array.strides[0])
    alignment = next(fits, None)
    return None if alignment is None else Rows(length, alignment)


@cache
def storing_program(format_: Format, read: Format | None = None) -> ScalarProgram:
    """Return the program that quantizes the texels of ``values`` to a format, as kernels that write into it do.

    Nothing is encoded unless the values have another format and one of the two is sRGB.
    """
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.library import functions_of
    from passgraph.language.lower import lower
    from passgraph.language.parse import parse_kernel
    from passgraph.language.source import Source

    read = read or format_
    letters = "rgba"[: format_.channels]
    type_ = "float" if format_.channels == 1 else f"vec{format_.channels}"
    text = f"def stored(values: Image) -> {type_}: return values[0, 0].{letters}"
    kernel = parse_kernel(functions_of(Source("<passgraph transfers>", text))["stored"], "pixel")
    colour, alpha = format_.store
    is_raw = read.srgb == format_.srgb
    image = ImageFacts(read.channels, decode=None if is_raw else read.decode)
    facts = Facts(images={"values": image}, stores=((alpha if is_raw else colour, alpha),))
    return lower(kernel, facts)


def send_values(backend: GLBackend, texture: Texture, picture: FloatBlock) -> None:
    """Upload values to a texture, rounded to its format; a stencil becomes 0."""
    values = shaped(np.asarray(picture, np.float32), texture)
    format_ = texture.format
    if format_.number == "f4":
        send(backend, texture, values)
    elif values.size <= SMALL or not backend.draws(format_):
        send(backend, texture, numbers_of(values, format_))
    else:
        scratch = _scratch(backend, texture)
        send(backend, scratch, values)
        store(backend, scratch, texture)


def store(backend: GLBackend, source: Texture, destination: Texture, read: Format | None = None) -> None:
    """Copy the values of one picture into another, quantized as by kernels (:func:`storing_program`)."""
    placements = placements_of((destination,), (source,))
    program = backend.programs.pixel(storing_program(destination.format, read), placements)
    run_pixels(backend, program, (destination,), (source,), _EMPTY, destination.size)
    backend.unbind()


def _scratch(backend: GLBackend, texture: Texture) -> Texture:
    """Return a float32 texture with the channels and the size of another."""
    scratch, format_ = backend.values, float_format(texture.format.channels)
    if scratch is None or (scratch.format, scratch.size) != (format_, texture.size):
        if scratch is not None:
            backend.values = None
            backend.objects.forget(scratch)
        backend.values = scratch = backend.new_texture(format_, texture.size, gl_format_of(format_))
    return scratch


def send(backend: GLBackend, texture: Texture, numbers: NDArray[Any]) -> None:
    """Upload numbers in a texture's format directly; a stencil becomes 0."""
    given, gl, (width, height) = shaped(numbers, texture), backend.context.gl, texture.size
    # OpenGL ES does not add alpha.
    sent = texture.gl_format if texture.padded and gl.has.is_es else gl_format_of(texture.format)
    given = with_stencil(given) if sent.stored.stencil else converted(given, texture.format, sent.stored)
    rows = rows_of(given)
    if rows is None:
        given, rows = np.ascontiguousarray(given), Rows()
    with fixed.transfer(gl, rows):
        gl.BindTexture(g.TEXTURE_2D, texture.name)
        gl.TexSubImage2D(g.TEXTURE_2D, 0, 0, 0, width, height, sent.external, sent.type, given.ctypes.data)


def receive(backend: GLBackend, texture: Texture, into: NDArray[Any]) -> None:
    """Download a texture into an array: as values for float32, else unconverted."""
    destination, format_ = shaped(into, texture), texture.format
    wanted = transfer_format(into, format_)
    if format_.steps and wanted is not format_:
        numbers = np.empty(destination.shape, format_.number)
        _fetch(backend, texture, numbers, gl_format_of(format_).type)
        convert(numbers, format_, destination, wanted)
    else:
        _fetch(backend, texture, destination, gl_format_of(wanted).type)


def _fetch(backend: GLBackend, texture: Texture, destination: NDArray[Any], type_: int) -> None:
    rows = rows_of(destination)
    if rows is None:
        plain = np.empty(destination.shape, destination.dtype.newbyteorder("="))
        _fetch(backend, texture, plain, type_)
        np.copyto(destination, plain)
        return
    if backend.context.gl.has.is_es:
        read_pixels(backend, texture, destination, type_, rows)
        return
    gl, format_ = backend.context.gl, texture.format
    external = gl_format_of(FORMATS["depth32f"] if format_.stencil else format_).external
    with fixed.transfer(gl, rows):
        gl.BindTexture(g.TEXTURE_2D, texture.name)
        gl.GetTexImage(g.TEXTURE_2D, 0, external, type_, destination.ctypes.data)


def read_pixels(backend: GLBackend, texture: Texture, room: NDArray[Any], type_: int, rows: Rows) -> None:
    """Read through a framebuffer, as in OpenGL ES: four channels, or the driver's own choice; depth as color."""
    if texture.format.is_depth:
        depth, texture = texture, _scratch(backend, texture)
        store(backend, depth, texture)
    gl, (width, height) = backend.context.gl, texture.size
    if type_ == _HALF:  # only some drivers can read four halves
        type_ = FLOAT_TYPE
    dtype = np.dtype(_READ_AS[type_])
    framebuffer = backend.objects.framebuffer((texture,), None)
    gl.BindFramebuffer(g.FRAMEBUFFER, framebuffer)
    external = gl_format_of(texture.format).external
    offered = gl.integer(_OFFERED_FORMAT), gl.integer(_OFFERED_TYPE)
    straight = room.dtype == dtype and (external == RGBA or offered == (external, type_))
    target = room if straight else np.empty((height, width, 4), dtype)
    with fixed.transfer(gl, rows if straight else Rows()):
        gl.ReadPixels(0, 0, width, height, external if straight else RGBA, type_, target.ctypes.data)
    if not straight:
        np.copyto(room, target[..., : room.shape[2]], casting="same_kind")
    backend.unbind()
