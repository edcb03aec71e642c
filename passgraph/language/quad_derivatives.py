"""Derivatives: compute a value at the neighboring pixels of a quad and subtract."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

from passgraph.language import ir
from passgraph.language.source import Span, fail
from passgraph.language.types import FLOAT, INT, IVEC2, Scalar, Vector, element_of, with_element
from passgraph.language.typing_rules import apply, widen
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.language.function_body import Builder


#: The bit in which horizontal, or vertical, neighbors differ.
AXES = {"x": 1, "y": 2}
#: A variable by its name, or a block by the identity of its statement.
Node: TypeAlias = str | int


class Feeding:
    """Data flow of a kernel's statements: assignments, reads, and what derivatives depend on.

    ``derivatives`` maps the variables of derivatives to their axis; each variable's value is the expression to
    differentiate.
    """

    def __init__(self, body: tuple[ir.Stmt, ...], derivatives: Mapping[str, str]) -> None:
        self.derivatives = derivatives
        self.types: dict[str, Any] = {}
        #: For branches and loops: the variables assigned inside; those read in an iteration before they are assigned;
        #: True if a derivative is inside; True if a jump out of it is inside.
        self.assigned: dict[int, frozenset[str]] = {}
        self.exposed: dict[int, frozenset[str]] = {}
        self.holding: set[int] = set()
        self.leaving: set[int] = set()
        self._hangs: dict[Node, set[Node]] = {}
        self._varying: set[Node] = set(derivatives)  # nodes that differ from pixel to pixel by themselves
        self._indices: dict[int, str] = {}  # indices of loops
        self._block(body, 0, 0)
        self.needed = self._needed()
        #: Variables that are equal in all pixels: they do not depend on the pixel, and are not assigned in blocks that
        #: pixels execute separately.
        self.common = self._common()
        self.pixels = tuple(sorted({0, *(pixel for _, pixel in self.needed)}))

    def _block(self, statements: Iterable[ir.Stmt], around: int, loop: int) -> frozenset[str]:
        assigned: set[str] = set()
        for statement in statements:
            if isinstance(statement, ir.Assign):
                assigned.add(statement.name)
                self.types[statement.name] = statement.value.type
                self._depend(statement.name, around, *names(statement.value))
                if _depends_on_pixel(statement.value):
                    self._varying.add(statement.name)
                if statement.name in self.derivatives:
                    self.holding.add(around)
            elif isinstance(statement, (ir.If, ir.For)):
                assigned |= self._inside(statement, around, loop)
            else:
                self._depend(loop, around)
                self.leaving.add(around)
        return frozenset(assigned)

    def _inside(self, statement: ir.If | ir.For, around: int, loop: int) -> frozenset[str]:
        here = id(statement)
        self._depend(here, around, *(name for part in _decides(statement) for name in names(part)))
        if any(map(_depends_on_pixel, _decides(statement))):
            self._varying.add(here)
        if isinstance(statement, ir.If):
            assigned = self._block(statement.then, here, loop) | self._block(statement.orelse, here, loop)
            if here in self.leaving:
                self.leaving.add(around)
        else:
            self.types[statement.name] = statement.start.type
            self._depend(statement.name, here)
            self._indices[here] = statement.name
            assigned = self._block(statement.body, here, here)
            self.leaving.discard(here)  # jumps inside leave this loop, and no enclosing one
            live: set[str] = set()
            self._expose(statement.body, live)
            self.exposed[here] = frozenset(live - {statement.name})
        if here in self.holding:
            self.holding.add(around)
        self.assigned[here] = assigned
        return assigned

    def _depend(self, node: Node, *sources: Node) -> None:
        self._hangs.setdefault(node, set()).update(sources)

    def _expose(self, statements: tuple[ir.Stmt, ...], live: set[str]) -> None:
        """Turn the set of variables live after some statements, ``live``, into those live before them."""
        for statement in reversed(statements):
            if isinstance(statement, ir.Assign):
                live.discard(statement.name)
                live |= names(statement.value)
            elif isinstance(statement, ir.If):
                orelse = set(live)
                self._expose(statement.then, live)
                self._expose(statement.orelse, orelse)
                live |= orelse | names(statement.condition)
            elif isinstance(statement, ir.For):
                live |= self.exposed[id(statement)]
                live.update(*map(names, _decides(statement)))
            else:
                live.clear()

    def _needed(self) -> frozenset[tuple[str, int]]:
        """Return the variables that some pixel of the quad needs, regardless of assignments in between."""
        pending: list[tuple[Node, int]] = []
        for name, axis in self.derivatives.items():
            pending += [(node, AXES[axis]) for node in self._hangs.get(name, ())]
        needed: set[tuple[Node, int]] = set()
        while pending:
            node, pixel = pending.pop()
            if (node, pixel) in needed:
                continue
            needed.add((node, pixel))
            both = (pixel, pixel ^ AXES[self.derivatives[node]]) if node in self.derivatives else (pixel,)  # type: ignore[index]
            pending += [(other, p) for other in self._hangs.get(node, ()) for p in both]
        return frozenset((node, pixel) for node, pixel in needed if isinstance(node, str))

    def _common(self) -> frozenset[str]:
        users: dict[Node, list[Node]] = {}
        for node, dependents in self._hangs.items():
            for other in dependents:
                users.setdefault(other, []).append(node)
        own: set[Node] = set()
        pending = list(self._varying)
        while pending:
            node = pending.pop()
            if node not in own:
                own.add(node)
                pending += users.get(node, ())
        # A pixel runs its block after another pixel's: assignments there must not change its initial values.
        blocks = [(names | {self._indices.get(block, "")}) - {""} for block, names in self.assigned.items()]
        before = -1
        while before != len(own):
            before = len(own)
            for names in blocks:
                if not own.isdisjoint(names):
                    own |= names
        return frozenset(name for name in self.types if name not in own)


def _depends_on_pixel(expression: ir.Expr) -> bool:
    """Return True if an expression may differ from pixel to pixel although its variables do not."""
    return any(
        node.name != "output_size" if isinstance(node, ir.Builtin) else isinstance(node, ir.Texel) and node.relative
        for node in _nodes(expression)
    )


def _decides(statement: ir.If | ir.For) -> tuple[ir.Expr, ...]:
    if isinstance(statement, ir.If):
        return (statement.condition,)
    return statement.start, statement.stop, statement.step


def names(expression: ir.Expr) -> set[str]:
    """Return the variables that an expression reads."""
    return {node.name for node in _nodes(expression) if isinstance(node, ir.Local)}


def _nodes(expression: ir.Expr) -> Iterator[Any]:
    """Yield the parts of an expression, each once."""
    pending: list[Any] = [expression]
    seen: set[int] = set()
    while pending:
        node = pending.pop()
        if id(node) not in seen:
            seen.add(id(node))
            yield node
            pending += ir.parts_of(node)


#: Functions that kernels call, with their axes: "x" to the right, "y" down.
DERIVATIVES = {"dfdx": "x", "dfdy": "y", "fwidth": "xy"}
#: Stages with neighboring pixels.
STAGES = ("pixel", "fragment")
#: Most statements visited, once for each pixel, so that compilation is bounded.
MAX_VISITS = 1_000_000
#: A variable of a pixel: its name, and the pixel's suffix.
_Held = tuple[str, str]


def derivative(name: str, axes: str, value: ir.Expr, builder: Builder, span: Span) -> ir.Expr:
    """Return the change of a value along ``"x"``, to the right, or ``"y"``, down; along ``"xy"``, the sum of both
    magnitudes.

    The builder's body computes it; ``name`` is its name in errors.
    """
    if builder.stage not in STAGES:
        fail(
            span,
            f"{name}() exists in pixel and fragment kernels, not in a {builder.stage} kernel: a vertex has no "
            "neighboring pixels",
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
    """Return a kernel's statements with its derivatives computed."""
    return _Quads(body, builder).run() if builder.derivatives else body


@dataclass(frozen=True)
class _World:
    """The pixels of a quad while a kernel is processed; all follow one of them.

    Attributes
    ----------
    leader : the pixel whose conditions decide
    ends : for each pixel, the suffix of its variables
    pixels : the computed pixels
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

    So later uses are known: ``live`` are the variables of other pixels that are read before they are assigned again.
    This pixel's own have no suffix, and are all computed.
    """

    def __init__(self, body: tuple[ir.Stmt, ...], builder: Builder) -> None:
        self.body, self.builder = body, builder
        self.feeding = Feeding(body, builder.derivatives)
        self.worlds = self.visits = 0
        self.places: dict[str, ir.Assign] = {}  # positions of the pixels, as far as needed

    def run(self) -> tuple[ir.Stmt, ...]:
        world = _World(0, ("", "@x", "@y", "@xy"), self.feeding.pixels)
        body = self._block(self.body, world, set(), frozenset())
        return (*self.places.values(), *body)

    # Statements

    def _block(
        self, statements: tuple[ir.Stmt, ...], world: _World, live: set[_Held], at_jump: Collection[_Held]
    ) -> tuple[ir.Stmt, ...]:
        moved: list[ir.Stmt] = []
        self._visit(len(statements) * len(world.pixels))
        for statement in reversed(statements):
            if isinstance(statement, ir.Assign):
                self._assign(statement, world, live, moved)
            elif isinstance(statement, (ir.If, ir.For)):
                self._inside(statement, world, live, at_jump, moved)
            else:
                live.clear()
                live.update(at_jump)
                moved.append(statement)
        return tuple(reversed(moved))

    def _assign(self, statement: ir.Assign, world: _World, live: set[_Held], moved: list[ir.Stmt]) -> None:
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
            self._write(ir.Assign(statement.name + end, value, statement.span), end, moved)

    def _difference(self, statement: ir.Assign, axis: str, pixel: int, world: _World, live: set[_Held]) -> ir.Expr:
        """Return the value at the odd pixel minus that at the even one; this pixel's position decides which is
        which."""
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
        moved: list[ir.Stmt],
    ) -> None:
        """Emit a branch or loop for each pixel that needs it, by its own conditions; jumps out of it follow the
        leader."""
        here = id(statement)
        if isinstance(statement, ir.If) and here in self.feeding.leaving:
            self._if(statement, world, live, at_jump, moved)
            return
        wanted = [p for p in world.pixels if self._matters(here, world.ends[p], live)]
        worlds = [self._around(world, p) if here in self.feeding.holding else world.alone(p) for p in wanted]
        for inner in reversed(worlds):
            if isinstance(statement, ir.If):
                self._if(statement, inner, live, at_jump, moved)
            else:
                self._for(statement, inner, live, moved)
        # Before any of them: they begin with the pixels' values at that time.
        for inner in worlds:
            self._enter(world, inner, live, moved)

    def _matters(self, block: int, end: str, live: set[_Held]) -> bool:
        """Return True if a block is computed for the pixel with this suffix."""
        return not end or any((name, end) in live for name in self.feeding.assigned[block])

    def _around(self, world: _World, leader: int) -> _World:
        """Return the quad's pixels led by another one, with variables of their own for all others."""
        self.worlds += 1
        ends = [f"@{self.worlds}{end}" for end in ("", "x", "y", "xy")]
        ends[leader] = world.ends[leader]
        return _World(leader, (ends[0], ends[1], ends[2], ends[3]), world.pixels)

    def _enter(self, world: _World, inner: _World, live: set[_Held], moved: list[ir.Stmt]) -> None:
        self._visit(len(live))
        for pixel in inner.pixels:
            before, end = world.ends[pixel], inner.ends[pixel]
            if before == end:
                continue
            for name in sorted(name for name, other in live if other == end):
                live.discard((name, end))
                variable = ir.Local(self.feeding.types[name], name)
                self._write(ir.Assign(name + end, self._at(variable, pixel, before, live)), end, moved)

    def _if(
        self, statement: ir.If, world: _World, live: set[_Held], at_jump: Collection[_Held], moved: list[ir.Stmt]
    ) -> None:
        in_else = set(live)
        then = self._block(statement.then, world, live, at_jump)
        orelse = self._block(statement.orelse, world, in_else, at_jump)
        live |= in_else
        condition = self._at(statement.condition, world.leader, world.end, live)
        self._write(ir.If(condition, then, orelse, statement.span), world.end, moved)

    def _for(self, statement: ir.For, world: _World, live: set[_Held], moved: list[ir.Stmt]) -> None:
        feeding, name = self.feeding, statement.name
        # Values that an iteration may carry to the next one, if a derivative depends on them.
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
        self._write(ir.For(name + world.end, start, stop, step, body, statement.span), world.end, moved)

    def _visit(self, count: int) -> None:
        self.visits += count
        if self.visits > MAX_VISITS:
            fail(
                self.body[0].span,
                f"the kernel takes more than {MAX_VISITS} steps to compute its derivatives; derivatives of derivatives "
                "inside branches and loops take many: compute them first",
            )

    def _write(self, statement: ir.Stmt, end: str, moved: list[ir.Stmt]) -> None:
        if end:
            self.builder.count_statement(statement.span)
        moved.append(statement)

    # Expressions

    def _at(self, expression: ir.Expr, pixel: int, end: str, live: set[_Held]) -> ir.Expr:
        """Return an expression at a pixel of the quad; its variables there become live."""
        if not end:
            return expression
        common = self.feeding.common
        live.update((name, end) for name in names(expression) - common)
        moved_parts: dict[int, ir.Expr] = {}

        def moved(part: ir.Expr) -> ir.Expr:
            if id(part) not in moved_parts:
                self.builder.count_expression(part.span)
                if isinstance(part, ir.Local):
                    moved_parts[id(part)] = part if part.name in common else replace(part, name=part.name + end)
                else:
                    moved_parts[id(part)] = self._moved(ir.with_parts(part, moved), pixel)
            return moved_parts[id(part)]

        return moved(expression)

    def _moved(self, expression: ir.Expr, pixel: int) -> ir.Expr:
        axes = [axis for axis, bit in AXES.items() if pixel & bit]
        if isinstance(expression, ir.Builtin) and expression.name == "pixel" and axes:
            return self._pixel(axes)
        if isinstance(expression, ir.Builtin) and expression.key.is_of_triangle:
            return replace(expression, axes="".join(axes))
        if isinstance(expression, ir.Texel) and expression.relative:
            span = expression.span
            x, y = (
                apply("add", [offset, self._step(axis)], span) if axis in axes else offset
                for axis, offset in (("x", expression.x), ("y", expression.y))
            )
            return replace(expression, x=x, y=y)
        return expression

    # Positions of the pixels

    def _place(self, name: str, value: ir.Expr) -> ir.Expr:
        self.places.setdefault(name, ir.Assign(name, value))
        return ir.Local(value.type, name)

    def _odd(self, axis: str) -> ir.Expr:
        pixel = ir.Builtin(IVEC2, "pixel")
        last = apply("bit_and", [ir.Swizzle(INT, pixel, ("xy".index(axis),)), ir.Literal(INT, 1)], self.body[0].span)
        return self._place(f"$odd.{axis}", apply("equal", [last, ir.Literal(INT, 1)], self.body[0].span))

    def _step(self, axis: str) -> ir.Expr:
        """Return the direction to the quad's other pixel: -1 from an odd one, else 1."""
        step = ir.Select(INT, self._odd(axis), ir.Literal(INT, -1), ir.Literal(INT, 1))
        return self._place(f"$step.{axis}", step)

    def _pixel(self, axes: list[str]) -> ir.Expr:
        bits = ir.Construct(IVEC2, tuple(ir.Literal(INT, int(axis in axes)) for axis in AXES))
        other = apply("bit_xor", [ir.Builtin(IVEC2, "pixel"), bits], self.body[0].span)
        return self._place(f"$pixel.{''.join(axes)}", other)
