"""mpv user shaders as written: blocks of directives (``//!HOOK MAIN``) with the GLSL behind them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from passgraph.errors import InputError
from passgraph.graph.formulas import Formula, evaluated

MAX_BLOCKS = 256
_DIRECTIVE = re.compile(r"^//!\s*([A-Z]+)\b[ \t]*(.*?)[ \t]*$")
#: What a block may say; those that are refused, with the reason.
_KNOWN = frozenset(["HOOK", "BIND", "SAVE", "DESC", "WIDTH", "HEIGHT", "WHEN", "OFFSET", "COMPONENTS", "PARAM", "TYPE",
                    "MINIMUM", "MAXIMUM"])  # fmt: skip
_REFUSED = {"COMPUTE": "a compute shader", "TEXTURE": "a texture within the file", "STORAGE": "a storage buffer",
            "BUFFER": "a buffer", "VAR": "a variable of a buffer"}  # fmt: skip
_SIGNS = {"+": "add", "-": "sub", "*": "mul", "/": "div"}
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


def rpn_formula(text: str, sizes: dict[str, tuple[Formula, Formula]], where: str) -> Formula:
    """A size in postfix form, ``HOOKED.w 2 *``, as a formula of the frame's.

    >>> rpn_formula("MAIN.w 2 *", {"MAIN": ("width", "height")}, "WIDTH")
    ('mul', 'width', 2.0)
    """
    stack: list[Formula] = []
    for word in text.split():
        if word in _SIGNS:
            if len(stack) < 2:
                raise InputError(f"{where}: {text!r} has too few operands for {word}")
            other = stack.pop()
            stack.append((_SIGNS[word], stack.pop(), other))
        else:
            stack.append(_operand(word, sizes, text, where))
    if len(stack) != 1:
        raise InputError(f"{where}: {text!r} is no size in postfix form, such as HOOKED.w 2 *")
    return stack[0]


def holds(text: str, sizes: dict[str, tuple[Formula, Formula]], where: str) -> bool:
    """Whether a condition holds for a frame of :data:`NOMINAL` size."""
    stack: list[float] = []
    for word in text.split():
        if word == "!":
            if not stack:
                raise InputError(f"{where}: {text!r} has too few operands for !")
            stack.append(float(not stack.pop()))
        elif word in _SIGNS or word in ("<", ">", "=", "%"):
            if len(stack) < 2:
                raise InputError(f"{where}: {text!r} has too few operands for {word}")
            b, a = stack.pop(), stack.pop()
            stack.append(_worked_out(word, a, b))
        else:
            stack.append(evaluated(_operand(word, sizes, text, where), NOMINAL))
    if len(stack) != 1:
        raise InputError(f"{where}: {text!r} is no condition in postfix form, such as OUTPUT.w MAIN.w >")
    return stack[0] != 0


def _worked_out(sign: str, a: float, b: float) -> float:
    if sign in _SIGNS:
        return evaluated((_SIGNS[sign], a, b), NOMINAL)
    if sign == "%":
        return a % b if b else 0.0
    return float({"<": a < b, ">": a > b, "=": a == b}[sign])


def _operand(word: str, sizes: dict[str, tuple[Formula, Formula]], text: str, where: str) -> Formula:
    name, dot, side = word.partition(".")
    if dot and name in sizes and side in ("w", "width", "h", "height"):
        return sizes[name][0 if side.startswith("w") else 1]
    try:
        number = float(word)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e9:
        known = ", ".join(f"{one}.w" for one in sizes)
        raise InputError(f"{where}: {text!r} has {word!r}; a size has numbers, + - * / and {known} and their .h")
    return number
