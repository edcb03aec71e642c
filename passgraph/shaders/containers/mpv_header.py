"""mpv user shaders as written: blocks of directives (``//!HOOK MAIN``) with the GLSL behind them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from passgraph.errors import GraphError, InputError
from passgraph.graph.formulas import Formula, evaluated

MAX_BLOCKS = 256
_DIRECTIVE = re.compile(r"^//!\s*([A-Z]+)\b[ \t]*(.*?)[ \t]*$")
#: What a block may say; those that are refused, with the reason.
_KNOWN = frozenset(["HOOK", "BIND", "SAVE", "DESC", "WIDTH", "HEIGHT", "WHEN", "OFFSET", "COMPONENTS", "PARAM", "TYPE",
                    "MINIMUM", "MAXIMUM", "TEXTURE", "SIZE", "FORMAT", "FILTER", "BORDER", "STORAGE"])  # fmt: skip
_REFUSED = {"COMPUTE": "a compute shader", "BUFFER": "a buffer", "VAR": "a variable of a buffer"}
#: Directives that name a texture or a parameter.
_NAMES = frozenset(["HOOK", "BIND", "SAVE", "PARAM", "TEXTURE"])
_SIGNS = {"+": "add", "-": "sub", "*": "mul", "/": "div", "%": "rest", "<": "less", ">": "less", "=": "equal"}
#: Width and height by the name of a texture.
Sizes: TypeAlias = Mapping[str, tuple[Formula, Formula]]
#: Sizes of textures in the conditions of ``WHEN`` are compared for a frame of this size: all but ratios is a guess.
NOMINAL = (1920, 1080)


@dataclass(frozen=True)
class MpvBlock:
    """One pass (or parameter): its directives, each with its line, and its GLSL, with line numbers of the file."""

    line: int
    said: dict[str, list[tuple[str, int]]] = field(default_factory=dict)
    code: str = ""

    def first(self, name: str, otherwise: str = "") -> str:
        return self.said[name][0][0] if name in self.said else otherwise

    def all(self, name: str) -> list[str]:
        return [value for value, _ in self.said.get(name, [])]

    @property
    def is_aligned(self) -> bool:
        """Whether what passes before have moved is put back by this one."""
        return self.first("OFFSET") == "ALIGN"

    def offset(self, file: str) -> tuple[float, float]:
        """Texels of its result by which the pass moves the picture."""
        if self.is_aligned or "OFFSET" not in self.said:
            return 0.0, 0.0
        text, line = self.said["OFFSET"][0]
        found = re.fullmatch(r"([-+]?\d*\.?\d+)\s+([-+]?\d*\.?\d+)", text)
        if found is None:
            raise InputError(f"{file}:{line}: //!OFFSET is two numbers of texels or ALIGN, got {text!r}")
        return float(found[1]), float(found[2])

    def components(self, file: str, otherwise: int) -> int:
        """How many components of its result count."""
        text, line = self.said.get("COMPONENTS", [(str(otherwise), self.line)])[0]
        if text not in ("1", "2", "3", "4"):
            raise InputError(f"{file}:{line}: //!COMPONENTS is 1 to 4, got {text!r}")
        return int(text)

    def expressions(self) -> list[str]:
        """What it says in postfix form."""
        return [text for name in ("WIDTH", "HEIGHT", "WHEN") for text in self.all(name)]


def is_mpv(text: str) -> bool:
    """Whether a text has a hook of mpv's."""
    return re.search(r"^//!\s*HOOK\b", text, re.MULTILINE) is not None


def read_blocks(text: str, file: str) -> list[MpvBlock]:
    """The blocks of a file.

    Raises
    ------
    InputError
        For a directive that is unknown or not read here, with file and line.
    """
    blocks: list[MpvBlock] = []
    code: list[str] = []
    in_head = False
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        found = _DIRECTIVE.match(line)
        if found is not None:
            if not in_head:
                _close(blocks, code)
                blocks.append(MpvBlock(number))
                if len(blocks) > MAX_BLOCKS:
                    raise InputError(f"{file}:{number}: more than {MAX_BLOCKS} passes")
                code = [""] * number
            name, value = found[1], found[2]
            if name in _REFUSED:
                raise InputError(f"{file}:{number}: {_REFUSED[name]} (//!{name}) is not read here\n    {line}")
            if name not in _KNOWN:
                raise InputError(f"{file}:{number}: //!{name} is no directive of mpv's\n    {line}")
            if name in _NAMES and re.fullmatch(r"(?!gl_|pg_)[A-Za-z_]\w*", value, re.ASCII) is None:
                raise InputError(
                    f"{file}:{number}: //!{name} is a name that shaders can write, got {value!r}\n    {line}"
                )
            blocks[-1].said.setdefault(name, []).append((value, number))
            code = [""] * number
        else:
            code.append(line)
        in_head = found is not None
    _close(blocks, code)
    return blocks


def _close(blocks: list[MpvBlock], code: list[str]) -> None:
    if blocks:
        blocks[-1] = MpvBlock(blocks[-1].line, blocks[-1].said, "\n".join(code))


def rpn_formula(text: str, sizes: Sizes, where: str, values: Mapping[str, float] = {}) -> Formula:
    """What is written in postfix form, ``HOOKED.w 2 *``, as a formula of the frame's size; parameters have values.

    >>> rpn_formula("MAIN.w 2 *", {"MAIN": ("width", "height")}, "WIDTH")
    ('mul', 'width', 2.0)
    """
    stack: list[Formula] = []
    for word in text.split():
        count = 1 if word == "!" else 2 if word in _SIGNS else 0
        if len(stack) < count:
            raise InputError(f"{where}: {text!r} has too few operands for {word}")
        if count == 1:
            stack.append(("equal", stack.pop(), 0.0))
        elif count == 2:
            b, a = stack.pop(), stack.pop()
            stack.append(("less", b, a) if word == ">" else (_SIGNS[word], a, b))
        else:
            stack.append(_operand(word, sizes, values, text, where))
    if len(stack) != 1:
        raise InputError(f"{where}: {text!r} is no size or condition in postfix form, such as HOOKED.w 2 *")
    return stack[0]


def side_formula(text: str, sizes: Sizes, where: str, values: Mapping[str, float] = {}) -> Formula:
    """A side in pixels: what is written, rounded to the nearest as mpv does.

    >>> side_formula("MAIN.w 2 /", {"MAIN": ("width", "height")}, "WIDTH")
    ('floor', ('add', ('div', 'width', 2.0), 0.5))
    """
    side = rpn_formula(text, sizes, where, values)
    return side if _is_whole(side) else ("floor", ("add", side, 0.5))


def _is_whole(formula: Formula) -> bool:
    if isinstance(formula, tuple):
        kept = formula[0] in ("add", "sub", "mul")
        return formula[0] == "floor" or (kept and all(_is_whole(part) for part in formula[1:]))
    return isinstance(formula, str) or float(formula).is_integer()


def holds(text: str, sizes: Sizes, where: str, values: Mapping[str, float] = {}) -> bool:
    """Whether a condition holds for a frame of :data:`NOMINAL` size; one that divides by zero does not."""
    condition = rpn_formula(text, sizes, where, values)
    try:
        return evaluated(condition, NOMINAL) != 0
    except GraphError:
        return False


def _operand(word: str, sizes: Sizes, values: Mapping[str, float], text: str, where: str) -> Formula:
    name, dot, side = word.partition(".")
    if dot and name in sizes and side in ("w", "width", "h", "height"):
        return sizes[name][0 if side.startswith("w") else 1]
    if word in values:
        return values[word]
    try:
        number = float(word)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e9:
        known = ", ".join([*(f"{one}.w" for one in sizes), *values])
        raise InputError(f"{where}: {text!r} has {word!r}; there are numbers, {' '.join(_SIGNS)} ! and {known}")
    return number
