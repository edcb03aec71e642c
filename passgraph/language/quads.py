"""Derivatives: how much a value grows from one pixel to the next, by computing it at both.

Pixels go in quads, 2x2, whose top left one has even coordinates.  A derivative is the value at the odd pixel of this
pixel's row (or column) in its quad minus that at the even one.  A kernel says what it computes at any pixel, so what
feeds its derivatives is written into it once more for the other pixels: its variables under other names, ``pixel()``
and relative texels moved.  A fragment of a draw has there what its triangle's planes say, also outside of the triangle;
backends hand it in (:func:`.ir.other_pixel`).  Nothing else behind the parser knows of derivatives.

What the others compute before a derivative hangs on their own conditions.  Only the branches and loops around it they
enter as this pixel does, from what they hold on their own, and leave as it does; what they assign there serves the
derivatives inside.  So a derivative of a derivative is one too.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.feeding import AXES, Feeding, names
from passgraph.language.source import Span, fail
from passgraph.language.types import FLOAT, INT, IVEC2, Scalar, Vector, element_of, with_element
from passgraph.language.typing_rules import apply, widen

if TYPE_CHECKING:
    from passgraph.language.frame import Builder

#: Functions that kernels call, and the axes along which each looks: "x" to the right, "y" down.
DERIVATIVES = {"dfdx": "x", "dfdy": "y", "fwidth": "xy"}
#: Stages that have pixels beside theirs.
STAGES = ("pixel", "fragment")
#: Statements looked at, once for each pixel: text may not make compiling endless.
MAX_VISITS = 1_000_000
#: A variable of a pixel: its name, and what the name ends in there.
_Held = tuple[str, str]


def derivative(name: str, axes: str, value: ir.Expr, builder: Builder, span: Span) -> ir.Expr:
    """How much a typed value grows along ``"x"``, to the right, or ``"y"``, down; the sizes of both, along ``"xy"``.

    The builder's body computes it; ``name`` is what errors call it.
    """
    if builder.stage not in STAGES:
        fail(
            span,
            f"{name}() exists in pixel and fragment kernels, not in a {builder.stage} kernel: a vertex has no pixels "
            "beside it",
        )
    if not isinstance(value.type, (Scalar, Vector)) or element_of(value.type) not in (FLOAT, INT):
        fail(span, f"{name}() takes a float or a float vector, got {value.type}")
    value = builder.name_it(widen(value, with_element(value.type, FLOAT), span, f"the argument of {name}()"), span)
    growths = []
    for axis in axes:
        growth = ir.Local(value.type, builder.fresh(f"dfd{axis}"), span)
        builder.derivatives[growth.name] = axis
        builder.emit(ir.Assign(growth.name, value, span))
        growths.append(growth)
    if len(growths) == 1:
        return growths[0]
    return apply("add", [apply("abs", [growth], span) for growth in growths], span)


def expanded(body: tuple[ir.Stmt, ...], builder: Builder) -> tuple[ir.Stmt, ...]:
    """A kernel's statements with its derivatives computed."""
    return _Quads(body, builder).run() if builder.derivatives else body


@dataclass(frozen=True)
class _World:
    """The pixels of a quad on their way through a kernel, all as one of them goes.

    Attributes
    ----------
    leader : the pixel whose conditions hold
    ends : for each pixel, what the names of its variables end in
    pixels : those that are computed
    """

    leader: int
    ends: tuple[str, str, str, str]
    pixels: tuple[int, ...]

    @property
    def end(self) -> str:
        return self.ends[self.leader]

    def alone(self, pixel: int) -> _World:
        return replace(self, leader=pixel, pixels=(pixel,))


class _Quads:
    """Writes a kernel's statements for all pixels of a quad, from the last to the first.

    So what later ones need is known: ``live`` are the variables of other pixels that are read before they are assigned
    again.  This pixel's own have no ending, and are all computed.
    """

    def __init__(self, body: tuple[ir.Stmt, ...], builder: Builder) -> None:
        self.body, self.builder = body, builder
        self.feeding = Feeding(body, builder.derivatives)
        self.worlds = self.visits = 0
        self.places: dict[str, ir.Assign] = {}  # where the pixels lie, as far as it is asked for

    def run(self) -> tuple[ir.Stmt, ...]:
        world = _World(0, ("", "@x", "@y", "@xy"), self.feeding.pixels)
        made = self._block(self.body, world, set(), frozenset())
        return (*self.places.values(), *made)

    # Statements

    def _block(
        self, statements: tuple[ir.Stmt, ...], world: _World, live: set[_Held], at_jump: Collection[_Held]
    ) -> tuple[ir.Stmt, ...]:
        made: list[ir.Stmt] = []
        self._visit(len(statements) * len(world.pixels))
        for statement in reversed(statements):
            if isinstance(statement, ir.Assign):
                self._assign(statement, world, live, made)
            elif isinstance(statement, (ir.If, ir.For)):
                self._inside(statement, world, live, at_jump, made)
            else:
                live.clear()
                live.update(at_jump)
                made.append(statement)
        return tuple(reversed(made))

    def _assign(self, statement: ir.Assign, world: _World, live: set[_Held], made: list[ir.Stmt]) -> None:
        for pixel in reversed(world.pixels):
            end = world.ends[pixel]
            if end and (statement.name, end) not in live:
                continue
            live.discard((statement.name, end))
            axis = self.builder.derivatives.get(statement.name)
            if axis is None:
                value = self._at(statement.value, pixel, end, live)
            else:
                value = self._difference(statement, axis, pixel, world, live)
            self._write(ir.Assign(statement.name + end, value, statement.span), end, made)

    def _difference(self, statement: ir.Assign, axis: str, pixel: int, world: _World, live: set[_Held]) -> ir.Expr:
        """The value at the odd pixel minus that at the even one; which is which this pixel's place says."""
        bit, span = AXES[axis], statement.span
        here, there = (self._at(statement.value, p, world.ends[p], live) for p in (pixel & ~bit, pixel | bit))
        one, other = apply("sub", [here, there], span), apply("sub", [there, here], span)
        return ir.Select(one.type, self._odd(axis), one, other, span)  # type: ignore[arg-type]

    def _inside(
        self,
        statement: ir.If | ir.For,
        world: _World,
        live: set[_Held],
        at_jump: Collection[_Held],
        made: list[ir.Stmt],
    ) -> None:
        """A branch or loop for each pixel that needs it, as that one goes; what jumps out, as the leader goes."""
        here = id(statement)
        if isinstance(statement, ir.If) and here in self.feeding.leaving:
            self._if(statement, world, live, at_jump, made)
            return
        wanted = [p for p in world.pixels if self._matters(here, world.ends[p], live)]
        worlds = [self._around(world, p) if here in self.feeding.holding else world.alone(p) for p in wanted]
        for inner in reversed(worlds):
            if isinstance(statement, ir.If):
                self._if(statement, inner, live, at_jump, made)
            else:
                self._for(statement, inner, live, made)
        # Before any of them: they begin with what the pixels hold then.
        for inner in worlds:
            self._enter(world, inner, live, made)

    def _matters(self, block: int, end: str, live: set[_Held]) -> bool:
        """Whether a block is computed for the pixel whose variables end so."""
        return not end or any((name, end) in live for name in self.feeding.assigned[block])

    def _around(self, world: _World, leader: int) -> _World:
        """The pixels of a quad led by another one, with variables of their own for all but that one."""
        self.worlds += 1
        ends = [f"@{self.worlds}{end}" for end in ("", "x", "y", "xy")]
        ends[leader] = world.ends[leader]
        return _World(leader, (ends[0], ends[1], ends[2], ends[3]), world.pixels)

    def _enter(self, world: _World, inner: _World, live: set[_Held], made: list[ir.Stmt]) -> None:
        self._visit(len(live))
        for pixel in inner.pixels:
            before, end = world.ends[pixel], inner.ends[pixel]
            if before == end:
                continue
            for name in sorted(name for name, other in live if other == end):
                live.discard((name, end))
                held = ir.Local(self.feeding.types[name], name)
                self._write(ir.Assign(name + end, self._at(held, pixel, before, live)), end, made)

    def _if(
        self, statement: ir.If, world: _World, live: set[_Held], at_jump: Collection[_Held], made: list[ir.Stmt]
    ) -> None:
        in_else = set(live)
        then = self._block(statement.then, world, live, at_jump)
        orelse = self._block(statement.orelse, world, in_else, at_jump)
        live |= in_else
        condition = self._at(statement.condition, world.leader, world.end, live)
        self._write(ir.If(condition, then, orelse, statement.span), world.end, made)

    def _for(self, statement: ir.For, world: _World, live: set[_Held], made: list[ir.Stmt]) -> None:
        feeding, name = self.feeding, statement.name
        # What a trip may hand to the next one, as far as a derivative anywhere hangs on it.
        handed = {
            (other, world.ends[p])
            for other in feeding.exposed[id(statement)]
            for p in world.pixels
            if world.ends[p] and (other, p) in feeding.needed and other not in feeding.common
        }
        after = frozenset(live | handed)
        at_start = set(after)
        body = self._block(statement.body, world, at_start, after)
        for pixel in world.pixels:
            end = world.ends[pixel]
            if pixel != world.leader and (name, end) in at_start:
                body = (ir.Assign(name + end, ir.Local(INT, name + world.end), statement.span), *body)
            at_start.discard((name, end))
        live |= at_start
        start, stop, step = (
            self._at(b, world.leader, world.end, live) for b in (statement.start, statement.stop, statement.step)
        )
        self._write(ir.For(name + world.end, start, stop, step, body, statement.span), world.end, made)

    def _visit(self, count: int) -> None:
        self.visits += count
        if self.visits > MAX_VISITS:
            fail(
                self.body[0].span,
                f"the kernel takes more than {MAX_VISITS} steps to compute its derivatives; derivatives of derivatives "
                "inside branches and loops take many: compute them before",
            )

    def _write(self, statement: ir.Stmt, end: str, made: list[ir.Stmt]) -> None:
        if end:
            self.builder.count_statement(statement.span)
        made.append(statement)

    # Expressions

    def _at(self, expression: ir.Expr, pixel: int, end: str, live: set[_Held]) -> ir.Expr:
        """An expression at a pixel of the quad; what it reads there is live."""
        if not end:
            return expression
        common = self.feeding.common
        live.update((name, end) for name in names(expression) - common)
        made: dict[int, ir.Expr] = {}

        def moved(part: ir.Expr) -> ir.Expr:
            if id(part) not in made:
                self.builder.count_expression(part.span)
                if isinstance(part, ir.Local):
                    made[id(part)] = part if part.name in common else replace(part, name=part.name + end)
                else:
                    made[id(part)] = self._moved(ir.with_parts(part, moved), pixel)
            return made[id(part)]

        return moved(expression)

    def _moved(self, expression: ir.Expr, pixel: int) -> ir.Expr:
        axes = [axis for axis, bit in AXES.items() if pixel & bit]
        if isinstance(expression, ir.Builtin) and expression.name == "pixel" and axes:
            return self._pixel(axes)
        if isinstance(expression, ir.Builtin) and ir.of_triangle(expression.name):
            return replace(expression, name=ir.other_pixel(expression.name, "".join(axes)))
        if isinstance(expression, ir.Texel) and expression.relative:
            span = expression.span
            x, y = (
                apply("add", [offset, self._step(axis)], span) if axis in axes else offset
                for axis, offset in (("x", expression.x), ("y", expression.y))
            )
            return replace(expression, x=x, y=y)
        return expression

    # Where the pixels lie

    def _place(self, name: str, value: ir.Expr) -> ir.Expr:
        self.places.setdefault(name, ir.Assign(name, value))
        return ir.Local(value.type, name)

    def _odd(self, axis: str) -> ir.Expr:
        pixel = ir.Builtin(IVEC2, "pixel")
        last = apply("bit_and", [ir.Swizzle(INT, pixel, ("xy".index(axis),)), ir.Literal(INT, 1)], self.body[0].span)
        return self._place(f"$odd.{axis}", apply("equal", [last, ir.Literal(INT, 1)], self.body[0].span))

    def _step(self, axis: str) -> ir.Expr:
        """From this pixel to the other one: -1 from an odd one, else 1."""
        step = ir.Select(INT, self._odd(axis), ir.Literal(INT, -1), ir.Literal(INT, 1))
        return self._place(f"$step.{axis}", step)

    def _pixel(self, axes: list[str]) -> ir.Expr:
        bits = ir.Construct(IVEC2, tuple(ir.Literal(INT, int(axis in axes)) for axis in AXES))
        other = apply("bit_xor", [ir.Builtin(IVEC2, "pixel"), bits], self.body[0].span)
        return self._place(f"$pixel.{''.join(axes)}", other)
