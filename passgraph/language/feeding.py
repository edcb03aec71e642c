"""What feeds a kernel's derivatives: which variables the other pixels of a quad must have, and what blocks hold.

Pixels of a quad are numbered by how they lie to this one: 0 is itself, 1 the one beside it, 2 the one above or below,
3 the one across.  So ``pixel ^ 1`` is the other one in a pixel's row, ``pixel ^ 2`` the other one in its column.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from passgraph.language import ir

#: The bit in which pixels differ that lie beside each other along x, or along y.
AXES = {"x": 1, "y": 2}
#: A variable by its name, or a block by the identity of its statement.
Node: TypeAlias = str | int


class Feeding:
    """Of a kernel's statements: what they assign and read, and what of it derivatives hang on.

    ``derivatives`` are the variables that take one, with its axis; what each is of stands as its value.
    """

    def __init__(self, body: tuple[ir.Stmt, ...], derivatives: Mapping[str, str]) -> None:
        self.derivatives = derivatives
        self.types: dict[str, Any] = {}
        #: Branches and loops: the variables assigned in one, those read in a loop's trip before the trip gives them a
        #: value, whether a derivative is inside, and whether a jump out of it.
        self.assigned: dict[int, frozenset[str]] = {}
        self.exposed: dict[int, frozenset[str]] = {}
        self.holding: set[int] = set()
        self.leaving: set[int] = set()
        self._hangs: dict[Node, set[Node]] = {}
        self._varying: set[Node] = set(derivatives)  # what differs from pixel to pixel by itself
        self._indices: dict[int, str] = {}  # of loops
        self._block(body, 0, 0)
        self.needed = self._needed()
        #: Variables that all pixels have in common: what computes them asks for no pixel, and stands in no block that
        #: pixels run by themselves.
        self.common = self._common()
        self.pixels = tuple(sorted({0, *(pixel for _, pixel in self.needed)}))

    def _block(self, statements: Iterable[ir.Stmt], around: int, loop: int) -> frozenset[str]:
        assigned: set[str] = set()
        for statement in statements:
            if isinstance(statement, ir.Assign):
                assigned.add(statement.name)
                self.types[statement.name] = statement.value.type
                self._hang(statement.name, around, *names(statement.value))
                if _asks_for_pixels(statement.value):
                    self._varying.add(statement.name)
                if statement.name in self.derivatives:
                    self.holding.add(around)
            elif isinstance(statement, (ir.If, ir.For)):
                assigned |= self._inside(statement, around, loop)
            else:
                self._hang(loop, around)
                self.leaving.add(around)
        return frozenset(assigned)

    def _inside(self, statement: ir.If | ir.For, around: int, loop: int) -> frozenset[str]:
        here = id(statement)
        self._hang(here, around, *(name for part in _decides(statement) for name in names(part)))
        if any(map(_asks_for_pixels, _decides(statement))):
            self._varying.add(here)
        if isinstance(statement, ir.If):
            made = self._block(statement.then, here, loop) | self._block(statement.orelse, here, loop)
            if here in self.leaving:
                self.leaving.add(around)
        else:
            self.types[statement.name] = statement.start.type
            self._hang(statement.name, here)
            self._indices[here] = statement.name
            made = self._block(statement.body, here, here)
            self.leaving.discard(here)  # what it holds leaves it, and nothing around it
            live: set[str] = set()
            self._expose(statement.body, live)
            self.exposed[here] = frozenset(live - {statement.name})
        if here in self.holding:
            self.holding.add(around)
        self.assigned[here] = made
        return made

    def _hang(self, node: Node, *others: Node) -> None:
        self._hangs.setdefault(node, set()).update(others)

    def _expose(self, statements: tuple[ir.Stmt, ...], live: set[str]) -> None:
        """From what is read after some statements, ``live``, to what is read before they give it a value."""
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
        """Variables that some pixel of the quad needs, whatever is assigned to them between."""
        pending: list[tuple[Node, int]] = []
        for name, axis in self.derivatives.items():
            pending += [(node, AXES[axis]) for node in self._hangs.get(name, ())]
        found: set[tuple[Node, int]] = set()
        while pending:
            node, pixel = pending.pop()
            if (node, pixel) in found:
                continue
            found.add((node, pixel))
            both = (pixel, pixel ^ AXES[self.derivatives[node]]) if node in self.derivatives else (pixel,)  # type: ignore[index]
            pending += [(other, p) for other in self._hangs.get(node, ()) for p in both]
        return frozenset((node, pixel) for node, pixel in found if isinstance(node, str))

    def _common(self) -> frozenset[str]:
        users: dict[Node, list[Node]] = {}
        for node, others in self._hangs.items():
            for other in others:
                users.setdefault(other, []).append(node)
        own: set[Node] = set()
        pending = list(self._varying)
        while pending:
            node = pending.pop()
            if node not in own:
                own.add(node)
                pending += users.get(node, ())
        # A pixel runs a block of its own after another has: what that one assigned there is not what it began with.
        blocks = [(made | {self._indices.get(block, "")}) - {""} for block, made in self.assigned.items()]
        before = -1
        while before != len(own):
            before = len(own)
            for made in blocks:
                if not own.isdisjoint(made):
                    own |= made
        return frozenset(name for name in self.types if name not in own)


def _asks_for_pixels(expression: ir.Expr) -> bool:
    """Whether an expression may differ from pixel to pixel although what it reads of variables does not."""
    return any(
        node.name != "output_size" if isinstance(node, ir.Builtin) else isinstance(node, ir.Texel) and node.relative
        for node in _nodes(expression)
    )


def _decides(statement: ir.If | ir.For) -> tuple[ir.Expr, ...]:
    if isinstance(statement, ir.If):
        return (statement.condition,)
    return statement.start, statement.stop, statement.step


def names(expression: ir.Expr) -> set[str]:
    """The variables that an expression reads."""
    return {node.name for node in _nodes(expression) if isinstance(node, ir.Local)}


def _nodes(expression: ir.Expr) -> Iterator[Any]:
    """What an expression is made of, each part once however often it is named."""
    pending: list[Any] = [expression]
    seen: set[int] = set()
    while pending:
        node = pending.pop()
        if id(node) not in seen:
            seen.add(id(node))
            yield node
            pending += ir.parts_of(node)
