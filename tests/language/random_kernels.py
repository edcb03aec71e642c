"""Random kernels with hypothesis: typed expressions, branches, loops with jumps, early returns, arrays."""

from __future__ import annotations

from hypothesis import strategies as st

NUMBERS = ["0.0", "1.0", "-0.5", "2.25", "3.0e38", "1.0e-30", "-7.0"]
WHOLE = ["0", "1", "-1", "2", "7", "31", "-2147483648", "2147483647"]


class Writer:
    """Writes one kernel; every choice is drawn, so that a failure shrinks."""

    def __init__(self, draw: st.DrawFn) -> None:
        self.draw = draw
        self.lines: list[str] = []
        self.depth = 1
        self.loops = 0
        self.count = 0
        self.names = {"float": ["x", "y", "z", "w"], "int": ["n"], "vec3": ["v"], "vec4": ["p"]}
        self.constant = {"n"}  # ints that may not be assigned to

    def pick(self, *options: str) -> str:
        return self.draw(st.sampled_from(options))

    def line(self, text: str) -> None:
        self.lines.append("    " * self.depth + text)

    def of(self, type_: str, depth: int = 3) -> str:
        """An expression of a type."""
        if depth == 0 or self.draw(st.integers(0, 3)) == 0:
            literals = {
                "float": NUMBERS,
                "int": WHOLE,
                "bool": ["True", "False"],
                "vec3": ["vec3(1, 2, 3)"],
                "vec4": ["p"],
            }
            return self.pick(*literals[type_], *self.names.get(type_, []) * 2)
        return getattr(self, f"_{type_}")(depth - 1)

    def _float(self, d: int) -> str:
        f = lambda: self.of("float", d)  # noqa: E731
        kind = self.pick("binary", "binary", "call", "call2", "choice", "part", "element", "dot", "from", "function")
        if kind == "binary":
            return f"({f()} {self.pick('+', '-', '*', '/')} {f()})"
        if kind == "call":
            return f"{self.pick('abs', 'floor', 'round', 'sign', 'fract', 'sqrt', 'exp2', 'atan')}({f()})"
        if kind == "call2":
            return f"{self.pick('min', 'max', 'step', 'mod')}({f()}, {f()})"
        if kind == "choice":
            return f"({f()} if {self.of('bool', d)} else {f()})"
        if kind == "part":
            return f"{self.of('vec3', d)}.{self.pick('x', 'y', 'z')}"
        if kind == "element":
            return f"a[0 + {self.of('int', d)}]"  # a literal out of range would be an error
        if kind == "dot":
            return f"dot({self.of('vec3', d)}, {self.of('vec3', d)})"
        return f"float({self.of('int', d)})" if kind == "from" else f"helper({f()}, {self.of('int', d)})"

    def _int(self, d: int) -> str:
        i = lambda: self.of("int", d)  # noqa: E731
        kind = self.pick("binary", "binary", "choice", "from", "unary")
        if kind == "binary":
            return f"({i()} {self.pick('+', '-', '*', '//', '%', '&', '|', '^', '<<', '>>')} {i()})"
        if kind == "choice":
            return f"({i()} if {self.of('bool', d)} else {i()})"
        return f"int({self.of('float', d)})" if kind == "from" else f"{self.pick('-', '~', 'abs')}({i()})"

    def _bool(self, d: int) -> str:
        kind = self.pick("float", "int", "logic", "not", "nan")
        if kind in ("float", "int"):
            return f"({self.of(kind, d)} {self.pick('<', '<=', '>', '==', '!=')} {self.of(kind, d)})"
        if kind == "logic":
            return f"({self.of('bool', d)} {self.pick('and', 'or')} {self.of('bool', d)})"
        return f"(not {self.of('bool', d)})" if kind == "not" else f"isnan({self.of('float', d)})"

    def _vec3(self, d: int) -> str:
        v = lambda: self.of("vec3", d)  # noqa: E731
        kind = self.pick("binary", "make", "swizzle", "choice", "mix", "scale")
        if kind == "binary":
            return f"({v()} {self.pick('+', '-', '*')} {v()})"
        if kind == "make":
            return f"vec3({self.of('float', d)}, {self.of('float', d)}, {self.of('float', d)})"
        if kind == "swizzle":
            return f"{v()}.{self.pick('zyx', 'xxy', 'bgr')}"
        if kind == "choice":
            return f"({v()} if {self.of('bool', d)} else {v()})"
        return f"mix({v()}, {v()}, {self.of('float', d)})" if kind == "mix" else f"({v()} * {self.of('float', d)})"

    def _vec4(self, d: int) -> str:
        return f"vec4({self.of('vec3', d)}, {self.of('float', d)})"

    # Statements

    def block(self, size: int, nest: int) -> None:
        for _ in range(self.draw(st.integers(1, size))):
            self.statement(nest)

    def statement(self, nest: int) -> None:
        kinds = ["set", "set", "new", "element", "swizzle", "add"]
        kinds += ["if", "if", "for"] * (nest > 0) + ["return"] + ["jump"] * (self.loops > 0)
        kind = self.pick(*kinds)
        if kind == "set":
            type_ = self.pick("float", "vec3")
            self.line(f"{self.pick(*self.names[type_])} = {self.of(type_)}")
        elif kind == "new":
            self.count += 1
            type_ = self.pick("float", "vec3", "int")
            self.line(f"t{self.count} = {self.of(type_)}")
            self.names[type_] = [*self.names[type_], f"t{self.count}"]
        elif kind == "element":
            self.line(f"a[0 + {self.of('int', 2)}] = {self.of('float')}")
        elif kind == "swizzle":
            self.line(
                self.pick(f"v.xy = {self.of('vec3')}.zx", f"v.z = {self.of('float')}", f"p.gb = {self.of('vec3')}.xy")
            )
        elif kind == "add":
            self.line(f"{self.pick(*self.names['float'])} {self.pick('+=', '-=', '*=')} {self.of('float')}")
        elif kind == "if":
            self.inside(f"if {self.of('bool')}:", nest)
            for word in ("elif", "else"):
                if self.draw(st.booleans()):
                    self.inside(f"elif {self.of('bool')}:" if word == "elif" else "else:", nest)
        elif kind == "for":
            self.count += 1
            index = f"i{self.count}"
            self.loops += 1
            self.names["int"] = [*self.names["int"], index]
            self.inside(f"for {index} in range({self.pick('1', '3', '1, 6, 2', '4, 0, -1', '70', '0')}):", min(nest, 2))
            self.names["int"] = [n for n in self.names["int"] if n != index]
            self.loops -= 1
        elif kind == "return":
            self.line(f"if {self.of('bool')}: return {self.of('vec4')}")
        else:
            self.line(f"if {self.of('bool')}: {self.pick('break', 'continue')}")

    def inside(self, head: str, nest: int) -> None:
        """A block of its own: names that it introduces end with it."""
        names = {type_: list(known) for type_, known in self.names.items()}
        self.line(head)
        self.depth += 1
        self.block(3, nest - 1)
        self.depth -= 1
        self.names = names


HELPER = """def helper(a: float, n: int) -> float:
    for i in range(3):
        if i == n:
            return a * 2.0
        a += float(i)
    return a

"""


@st.composite
def kernels(draw: st.DrawFn) -> str:
    """The text of a kernel over one image."""
    writer = Writer(draw)
    writer.line("p = c[0, 0]")
    writer.line("x, y, z, w = p.x, p.y, p.z, p.w")
    writer.line("v, n, a = p.xyz, int(p.w), [p.x, p.y, 1.0, 4.0]")
    writer.block(5, 2)
    writer.line(f"return {writer.of('vec4')} + vec4(x, y, v.z, a[n])")
    return HELPER + "def k(c: Image) -> vec4:\n" + "\n".join(writer.lines) + "\n"
