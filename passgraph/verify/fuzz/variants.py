"""Rewrite a kernel into an equivalent one (metamorphic testing, as GraphicsFuzz does for shaders).

The text is parsed with ``ast`` and unparsed; each rewriting keeps all operations and their order, so backends that
compile without contraction must give the same bits.  On others, both forms must lie within the oracle's bounds.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable
from itertools import pairwise

from hypothesis import strategies as st

from passgraph.backends.base import Backend
from passgraph.graph.targets import Target
from passgraph.verify.fuzz.cases import EXACT, Case, Tally, inputs_of, judged, output_of, run, same_bits
from passgraph.verify.fuzz.random_expressions import Features
from passgraph.verify.fuzz.random_kernels import SIDE, kernels

#: Conditions that never hold, which a compiler cannot know.
OPAQUE = ("c[0, 0].x < 0.0 and c[0, 0].x > 1.0", "pixel().x < 0", "output_size().y == 0", "c[1, 0].w * 0.0 == 1.0")
#: Type by the first letter of a name in generated kernels.
TYPES = {"x": "float", "y": "float", "f": "float", "v": "vec3", "u": "vec2", "p": "vec4", "m": "mat3"}
REWRITINGS = ("one trip", "dead code", "outlined", "inlined", "reordered", "identity", "nested if")


def names_in(node: ast.AST, *, written: bool) -> set[str]:
    """Return the variables that some code reads, or writes."""
    names: set[str] = set()
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store) == written:
            names.add(part.id)
        # a[i] = … and v.xy = … write a and v.
        if written and isinstance(part, (ast.Subscript, ast.Attribute)) and isinstance(part.ctx, ast.Store):
            names.update(n.id for n in ast.walk(part.value) if isinstance(n, ast.Name))
    return names


class Rewriting:
    """Rewrites one place of a kernel; ``place`` selects among the possible ones."""

    def __init__(self, text: str, place: int) -> None:
        self.tree = ast.parse(text)
        self.place = place
        function = self.tree.body[-1]
        assert isinstance(function, ast.FunctionDef)
        self.kernel = function

    def blocks(self) -> list[list[ast.stmt]]:
        """Return every list of statements of the kernel, the function's own first."""
        blocks = [self.kernel.body]
        for node in ast.walk(self.kernel):
            if isinstance(node, (ast.If, ast.For)):
                blocks += [block for block in (node.body, node.orelse) if block]
        return blocks

    def _places(self, fits: Callable[[ast.stmt], bool]) -> list[tuple[list[ast.stmt], int]]:
        return [(block, i) for block in self.blocks() for i, s in enumerate(block) if fits(s)]

    def _chosen(self, fits: Callable[[ast.stmt], bool]) -> tuple[list[ast.stmt], int] | None:
        places = self._places(fits)
        return places[self.place % len(places)] if places else None

    def _known(self, statement: ast.stmt) -> bool:
        """Return True for an assignment to variables of the kernel's first statements, so that it adds no name."""
        return isinstance(statement, (ast.Assign, ast.AugAssign)) and names_in(statement, written=True) <= {*"xyuvpma"}

    def _movable(self, statement: ast.stmt) -> bool:
        """Return True for a statement that can be nested: it adds no name and does not jump out."""
        if isinstance(statement, (ast.If, ast.For)):
            jumps = any(isinstance(n, (ast.Return, ast.Break, ast.Continue)) for n in ast.walk(statement))
            return not jumps
        return self._known(statement) and statement not in self.kernel.body[:3]

    def one_trip(self) -> None:
        """Put a statement in a loop of one trip."""
        if place := self._chosen(self._movable):
            block, i = place
            bounds = ("1", "3, 4", "5, 0, -9")[self.place % 3]
            once = f"once{sum(isinstance(n, ast.For) for n in ast.walk(self.kernel))}"
            loop = _statement(f"for {once} in range({bounds}): pass")
            assert isinstance(loop, ast.For)
            loop.body = [block[i]]
            block[i] = loop

    def nested_if(self) -> None:
        """Put a statement in a branch that always runs, which a compiler cannot know."""
        if place := self._chosen(self._movable):
            block, i = place
            branch = _statement(f"if not ({OPAQUE[self.place % len(OPAQUE)]}): pass")
            assert isinstance(branch, ast.If)
            branch.body = [block[i]]
            block[i] = branch

    def dead_code(self) -> None:
        """Add a copy of another statement, or a loop, behind a condition that never holds."""
        # After the kernel's first statements, so that every name is defined.
        if place := self._chosen(lambda s: self._known(s) and s not in self.kernel.body[:2]):
            block, i = place
            branch = _statement(f"if {OPAQUE[self.place % len(OPAQUE)]}: pass")
            assert isinstance(branch, ast.If)
            dead = [copy.deepcopy(block[i]), _statement("for never in range(9): x += y * 1.5")]
            branch.body = dead if self.place % 2 else dead[:1]
            block.insert(i + 1, branch)

    def reordered(self) -> None:
        """Swap two neighbors that neither read nor write each other's variables."""
        places = []
        for block in self.blocks():
            for i, (a, b) in enumerate(pairwise(block)):
                if isinstance(a, ast.Assign) and isinstance(b, ast.Assign):
                    writes = [names_in(s, written=True) for s in (a, b)]
                    reads = [names_in(s, written=False) for s in (a, b)]
                    if not (writes[0] & (writes[1] | reads[1]) or writes[1] & reads[0]):
                        places.append((block, i))
        if places:
            block, i = places[self.place % len(places)]
            block[i], block[i + 1] = block[i + 1], block[i]

    def _assigned(self, statement: ast.stmt) -> bool:
        """Return True for ``name = value`` of a type known by the name, with names of known types in the value."""
        if not (isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name)):
            return False
        called = {n.func.id for n in ast.walk(statement) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
        read = names_in(statement.value, written=False) - called
        return statement.targets[0].id in ("x", "y", "v", "u") and read <= {*"xyvupm"} and "pixel" not in called

    def outlined(self) -> None:
        """Compute an assigned value by a function of the variables that it reads."""
        if place := self._chosen(self._assigned):
            block, i = place
            statement = block[i]
            assert isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name)
            read = sorted(names_in(statement.value, written=False) & {*"xyvupm"})
            result = TYPES[statement.targets[0].id]
            # Ints convert at the return as they do at an assignment.
            parameters = ", ".join(f"{n}: {TYPES[n]}" for n in read)
            function = _statement(f"def outlined({parameters}) -> {result}: return 0.0")
            assert isinstance(function, ast.FunctionDef) and isinstance(function.body[0], ast.Return)
            function.body[0].value = statement.value
            statement.value = ast.parse(f"outlined({', '.join(read)})", mode="eval").body
            self.tree.body.insert(len(self.tree.body) - 1, function)

    def inlined(self) -> None:
        """Replace a call of ``blend`` by its body, with a variable for each argument."""
        inline = _Inline(self.place)
        self.kernel = inline.visit(self.kernel)
        self.tree.body[-1] = self.kernel

    def identity(self) -> None:
        """Pass a value through operations that do not change its bits."""
        if place := self._chosen(self._assigned):
            block, i = place
            statement = block[i]
            assert isinstance(statement, ast.Assign)
            text = ast.unparse(statement.value)
            forms = (f"({text}) * 1.0", f"-(-({text}))", f"({text}) / 1.0", f"({text}) if x == x or True else ({text})")
            statement.value = ast.parse(forms[self.place % len(forms)], mode="eval").body

    def text(self) -> str:
        return ast.unparse(ast.fix_missing_locations(self.tree)) + "\n"


class _Inline(ast.NodeTransformer):
    """Replaces ``blend(a, b, t)`` by the expression that the function returns."""

    def __init__(self, place: int) -> None:
        self.skip = place % 3

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if not (isinstance(node.func, ast.Name) and node.func.id == "blend"):
            return node
        self.skip -= 1
        if self.skip >= 0:
            return node
        a, b, t = (ast.unparse(argument) for argument in node.args)
        return ast.parse(f"(({a}) * (1.0 - ({t})) + ({b}) * ({t}))", mode="eval").body


def _statement(text: str) -> ast.stmt:
    return ast.parse(text).body[0]


def rewritten(text: str, name: str, place: int) -> str:
    """Return a kernel's text with one rewriting at one place; the same text if none is possible."""
    rewriting = Rewriting(text, place)
    getattr(rewriting, name.replace(" ", "_"))()
    return rewriting.text()


@st.composite
def variants(draw: st.DrawFn, side: int = SIDE) -> Case:
    """Generate a kernel and its rewritten form: a case of kind ``variant``."""
    case = draw(kernels(Features(wild=draw(st.booleans())), side))
    text = case["text"]
    steps = st.tuples(st.sampled_from(REWRITINGS), st.integers(0, 11))
    other = text
    for name, place in draw(st.lists(steps, min_size=1, max_size=4)):
        if name != "outlined" or "outlined" not in other:
            other = rewritten(other, name, place)
    return {**case, "kind": "variant", "other": other}


def pair_of(case: Case) -> tuple[Target, Target]:
    """Return both forms as graphs."""
    return output_of(case, case["text"]), output_of(case, case["other"])


def variant_outcome(case: Case, both_forms: tuple[Target, Target], backends: list[Backend], tally: Tally) -> str:
    """Compare the bits of both forms; if a backend may contract, return the oracle's verdict on the rewritten one."""
    _, other = both_forms
    for backend in backends:
        pictures = [run({"out": out}, backend, None, **inputs_of(case, out))["out"] for out in both_forms]
        tally.verdicts[backend.name] += 1
        if same_bits(*pictures):
            continue
        if backend.name in EXACT:
            return f"{backend.name}: the rewritten kernel gives other bits"
        why = judged({"out": other}, [backend], tally, **inputs_of(case, other))
        if why:
            return f"rewritten, {why}"
    return ""
