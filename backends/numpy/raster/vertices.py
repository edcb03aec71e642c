"""The vertex stage of a draw: clip coordinates and varyings of a stretch of vertices."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import ATTRIBUTES, Block
from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.machine.builder import IRBuilder
from passgraph.backends.numpy.machine.native import function_code, lanes
from passgraph.backends.numpy.raster.kernel import found_in, image_names, image_sizes
from passgraph.backends.numpy.vector.lane_body import LaneBody
from passgraph.backends.numpy.vector.lanes import Lanes, counting
from passgraph.backends.numpy.vector.operations import F32, F64, I64
from passgraph.cached import cached_property
from passgraph.formats import Format
from passgraph.plan.data import DrawStep

if TYPE_CHECKING:
    from passgraph.backends.numpy.storage import Storage

_CALL = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)


class VertexStage:
    """A compiled vertex program."""

    def __init__(self, step: DrawStep) -> None:
        program = step.vertex
        parts = ("vertices", program.key, repr([n for n, _ in program.builtins]), str(len(step.varyings)))
        held = [(format_.number, format_.steps) for format_ in _image_formats(step)]
        self.code = function_code((*parts, repr(held), str(lanes())), lambda name: _text(step, name))
        self.context = np.zeros(len(_context_names(step)), np.int64)

    @cached_property
    def function(self) -> Any:
        return self.code.function(_CALL)

    def bound(
        self, block: Block, attributes: Sequence[Any], images: Sequence[Storage], clip: Any, varyings: Any
    ) -> Callable[[int, int], None]:
        """A function of the first vertex and the one behind the last.  It keeps alive what it reads and writes."""
        arrays = (block.floats, block.ints, clip, varyings, *attributes)
        pictures = [part for image in images for part in image.anywhere]
        self.context[:] = [*(array.ctypes.data for array in arrays), *pictures]
        function, context = self.function, self.context.ctypes.data

        def run(first: int, last: int, held: tuple[Any, ...] = (*arrays, *images)) -> None:
            function(context, first, last)

        return run


def _context_names(step: DrawStep) -> list[str]:
    """Entries of the context, in order."""
    return ["floats", "ints", "clip", "varyings", *step.vertex.attributes, *image_names(step.vertex)]


def _image_formats(step: DrawStep) -> tuple[Format, ...]:
    return step.image_formats[: len(step.vertex.images)]


def _text(step: DrawStep, name: str) -> str:
    """LLVM text of ``vertices(context, first, last)``."""
    module = ir.Module(name)
    kind = ir.FunctionType(ir.VoidType(), [ir.PointerType(), I64, I64])
    function = ir.Function(module, kind, name)
    b = Lanes(IRBuilder(function), lanes())
    context, first, last = function.args
    memory = found_in(b, context, _context_names(step))
    with counting(b, first, last, ir.Constant(I64, b.lanes)) as at:
        vertex = b.add(at, b.counting(I64))
        mask = b.icmp_signed("<", vertex, last)
        given = image_sizes(step.vertex, memory)
        for builtin in (name for name, _ in step.vertex.builtins if name not in given):
            attribute, _, component = builtin.removeprefix("vertex.").partition(".")
            first = b.mul(vertex, ir.Constant(I64, ATTRIBUTES[attribute][1]))
            index = b.add(first, ir.Constant(I64, int(component or 0)))
            given[builtin] = b.load_at(memory[attribute], index, F32, mask)
        results = LaneBody(step.vertex, b, given, memory, mask, _image_formats(step)).results()
        for part, value in enumerate(results[:4]):
            index = b.add(b.mul(vertex, ir.Constant(I64, 4)), ir.Constant(I64, part))
            b.store_at(memory["clip"], index, b.fpext(value, F64), F64, mask)
        count = len(step.varyings)
        for part, value in enumerate(results[4:]):
            index = b.add(b.mul(vertex, ir.Constant(I64, count)), ir.Constant(I64, part))
            b.store_at(memory["varyings"], index, value, F32, mask)
    b.ret_void()
    return str(module)
