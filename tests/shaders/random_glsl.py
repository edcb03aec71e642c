"""Shaders made by chance: ints, calls, every kind of branch, loop and exit.

Calls and steps stand in statements of their own: where an expression reads what it changes, drivers differ.
"""

from __future__ import annotations

import random

#: What a variable is cut to after each assignment, so that products stay small.
_CUT = "(({}) & 255)"
_MAX_DEPTH = 4


class Maker:
    """One shader."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.functions = 0
        self.loops = 0  # names of counters given out

    def text(self) -> str:
        parts = ["int shared_one = 3;"]
        for _ in range(self.chance.randrange(1, 4)):
            names = ["a", "b", "l"]
            body = f"int l = {self.chance.randrange(9)}; {self.block(names, 0, 'value')}"
            parts.append(f"int f{self.functions}(int a, inout int b) {{ {body} return {self.number(names, 0)}; }}")
            self.functions += 1
        names = ["m", "n", "k"]
        main = self.block(names, 0, "void")
        parts.append(
            "void main() { int m = int(gl_FragCoord.x), n = int(gl_FragCoord.y), k = 7; int t[3] = int[3](1, 2, 3);"
            f" {main} gl_FragColor = vec4(m, n, k + t[0] + 2 * t[1] + 3 * t[2], shared_one); }}"
        )
        return "\n".join(parts)

    def pick(self, names: list[str]) -> str:
        return self.chance.choice([*names, "shared_one"])

    def number(self, names: list[str], depth: int) -> str:
        kind = self.chance.randrange(9)
        if depth > 1 or kind < 4:
            return str(self.chance.randrange(12)) if kind == 0 else self.pick(names)
        left, right = self.number(names, depth + 1), self.number(names, depth + 1)
        if kind == 4:
            return f"({self.condition(names)} ? {left} : {right})"
        if kind == 5:
            return f"({left} / {self.chance.choice([-7, -3, 2, 3, 5])})"
        return f"({left} {self.chance.choice(['+', '-', '*', '&', '|', '^'])} {right})"

    def condition(self, names: list[str]) -> str:
        sign = self.chance.choice(["<", ">", "<=", ">=", "==", "!="])
        one = f"{self.number(names, 2)} {sign} {self.number(names, 2)}"
        if self.chance.randrange(4):
            return one
        link = self.chance.choice(["&&", "||", "^^"])
        return f"(({one}) {link} !({self.condition(names)}))"

    def block(self, names: list[str], depth: int, result: str, loop: bool = False) -> str:
        count = self.chance.randrange(1, 4)
        return " ".join(self.statement(names, depth, result, loop) for _ in range(count))

    def statement(self, names: list[str], depth: int, result: str, loop: bool) -> str:
        kind = self.chance.randrange(13)
        inner = depth + 1
        if kind < 4 or depth >= _MAX_DEPTH:
            return self.assignment(names, result)
        if kind < 6:
            orelse = f" else {{ {self.block(names, inner, result, loop)} }}" if self.chance.randrange(2) else ""
            return f"if ({self.condition(names)}) {{ {self.block(names, inner, result, loop)} }}{orelse}"
        if kind < 9 and sum(name[0] == "i" for name in names) < 2:
            return self.loop(names, inner, result)
        if kind == 9:
            cases = " ".join(
                f"{label}: {self.block(names, inner, result, True).replace('continue;', 'break;')}"
                f"{' break;' if self.chance.randrange(2) else ''}"
                for label in self.chance.sample(["case 0", "case 1", "case 3", "default"], 3)
            )
            return f"switch ({self.pick(names)} & 3) {{ {cases} break; }}"
        if kind == 10 and loop:
            return f"if ({self.condition(names)}) {self.chance.choice(['break;', 'continue;'])}"
        if kind == 11:
            exit_ = {"value": f"return {self.number(names, 1)};", "void": "return;"}[result]
            early = f"gl_FragColor = vec4({self.pick(names)}); " if result == "void" else ""
            return f"if ({self.condition(names)}) {{ {early}{exit_} }}"
        return f"{{ int l = {self.number(names, 1)}; {self.block([*names, 'l'], inner, result, loop)} }}"

    def assignment(self, names: list[str], result: str) -> str:
        own = [name for name in names if name[0] != "i"]  # a counter that is written may have no end
        name = self.pick(own)
        # Loops within loops of data make fewer trips than OpenGL allows, so those of functions stay out of loops.
        alone = result == "void" and own == names
        if alone and self.functions and not self.chance.randrange(3):
            one, other = self.chance.sample(own, 2)
            call = f"f{self.chance.randrange(self.functions)}({self.number(names, 1)}, {one})"
            return f"{other} = {call}; {other} = {_CUT.format(other)};"
        if result == "void" and not self.chance.randrange(5):
            return f"t[({self.pick(names)} & 3) % 3] += {self.number(names, 1)};"
        value = self.number(names, 0)
        return f"{name} = {_CUT.format(value)};"

    def loop(self, names: list[str], depth: int, result: str) -> str:
        self.loops += 1
        i, count = f"i{self.loops}", self.chance.randrange(1, 6)
        body = self.block([*names, i], depth, result, True)
        kind = self.chance.randrange(4)
        if kind == 0:
            return f"{{ int {i} = 0; while ({i}++ < {count}) {{ {body} }} }}"
        if kind == 1:
            return f"{{ int {i} = 0; do {{ {body} }} while (++{i} < {count}); }}"
        if kind == 2:
            return f"for (int {i} = {self.pick(names)} & 3; {i} < {count}; {i}++) {{ {body} }}"
        return f"for (int {i} = {count}; {i} > 0; --{i}) {{ {body} }}"


def random_shader(seed: int) -> str:
    """The text of a shader; the same for the same seed."""
    return Maker(seed).text()
