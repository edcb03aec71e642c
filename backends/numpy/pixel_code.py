"""Generated code of pixel passes: loops over rows of the output, with the border apart from the interior.

In the interior every relative read lies between its image's left and right edges; the rule for rows is the same all
along a row, so that no clamp is left in the inner loop and LLVM vectorises it.
A pass is a chain of one (see chains.py).  Threads take pieces by a shared counter until none is left.
"""

from __future__ import annotations

from collections.abc import Sequence

from passgraph.backends.numpy.chains import Stage, reach
from passgraph.backends.numpy.channels import single_channel
from passgraph.backends.numpy.jit import HEADER, indented
from passgraph.backends.numpy.llvm_names import argument_names
from passgraph.language import scalar as s


def pixel_module(chain: Sequence[Stage]) -> tuple[str, dict[str, object]]:
    """Text of a module with one function ``pieces``, and the names to put into it.

    Its arguments: the counter; the number of pieces, columns of them, their width and height, the target's size;
    columns of each stage's rings; of each stage the images (with sizes) that no stage makes, and its parameter
    blocks; the rings; the last stage's outputs.
    """
    codes = [StageCode(chain, number) for number in range(len(chain))]
    arguments = ["counter", "count", "columns", "tile", "band", "width", "height"]
    arguments += [f"pitch{code.number}" for code in codes[:-1]]
    arguments += [name for code in codes for name in code.arguments()]
    arguments += [name for code in codes[:-1] for name in code.stores] + codes[-1].stores
    text = [
        HEADER,
        "from passgraph.backends.numpy.intrinsics import pg_take",
        *(line for code in codes for line in code.bodies()),
        f"def pieces({', '.join(arguments)}):",
        *indented(_piece(codes)),
        "pieces = compiled(pieces)",
        "",
    ]
    return "\n".join(text), {f"PROGRAM{code.number}": code.program for code in codes}


def _piece(codes: Sequence[StageCode]) -> list[str]:
    """Take a piece, make its rows, take the next."""
    rows: list[str] = []
    for code in codes[:-1]:
        behind = f"behind{code.number}"
        down = code.stage.margin.down
        # The first row of a piece asks for all rows above it too, each further row for one more.
        rows += [
            f"for y in range({behind}, min(height, bottom + {down + 1})):",
            *indented(code.row()),
            f"{behind} = min(height, bottom + {down + 1})",
        ]
    rows += ["y = bottom", *codes[-1].row()]
    return [
        "while True:",
        *indented(
            [
                "piece = pg_take(counter)",
                "if piece >= count:",
                "    break",
                "x0 = piece % columns * tile",
                "y0 = piece // columns * band",
                *(line for code in codes for line in code.span()),
                "for bottom in range(y0, min(height, y0 + band)):",
                *indented(rows),
            ]
        ),
    ]


def builtin(name: str, program: s.ScalarProgram, prefix: str = "im") -> str:
    """What a builtin of a pixel pass is in generated code."""
    known = {
        "pixel.0": "int32(x)", "pixel.1": "int32(y)",
        "output_size.0": "int32(width)", "output_size.1": "int32(height)",
    }  # fmt: skip
    if name in known:
        return known[name]
    image, _, axis = name.removeprefix("size.").rpartition(".")
    index = [use.name for use in program.images].index(image)
    return f"int32({prefix}{index}_{'wh'[int(axis)]})"


class StageCode:
    """The text of one stage; its names end in its number."""

    def __init__(self, chain: Sequence[Stage], number: int) -> None:
        self.number, self.stage = number, chain[number]
        program, channels = self.stage.step.program, self.stage.channels
        one = single_channel(program, channels)
        self.program, self.alike = (one, channels[0]) if one is not None else (program, 0)
        self.reach = reach(program.images)
        self.last = number == len(chain) - 1
        kind = "out" if self.last else f"ring{number}_"
        self.stores = [f"{kind}{slot}" for slot in range(len(channels))]
        self.rings = {image: (chain[producer], producer, slot) for image, producer, slot in self.stage.rings}

    def arguments(self) -> list[str]:
        names = []
        for image in range(len(self.program.images)):
            if image not in self.rings:
                names += [f"im{self.number}_{image}{end}" for end in ("", "_w", "_h")]
        return [*names, f"floats{self.number}", f"ints{self.number}"]

    def bodies(self) -> list[str]:
        """The program twice: where relative reads stay between their images' left and right edges, and anywhere."""
        rings = tuple((image, stage.rows) for image, (stage, _, _) in sorted(self.rings.items()))
        given = f"PROGRAM{self.number}, {{}}, {self.alike}, rings={rings}"
        return [
            f"inside{self.number} = body_intrinsic({given.format(True)})",
            f"border{self.number} = body_intrinsic({given.format(False)})",
        ]

    def span(self) -> list[str]:
        """The columns and the first row that this stage makes for a piece."""
        margin = self.stage.margin
        lines = [
            f"from{self.number} = max(0, x0 - {margin.left})",
            f"to{self.number} = min(width, x0 + tile + {margin.right})",
        ]
        if not self.last:
            lines.append(f"behind{self.number} = max(0, y0 - {margin.up})")
        return lines

    def row(self) -> list[str]:
        """Row ``y`` from its first to its last column."""
        left, right, _, _ = self.reach
        begin, end = f"from{self.number}", f"to{self.number}"
        lines = ["row = y * width"]
        if not self.last:
            lines.append(f"kept = y % {self.stage.rows} * pitch{self.number} - {begin}")
        if not (left or right):
            return [*lines, *self._interior(begin, end)]
        return [
            *lines,
            f"first = min(max({left}, {begin}), {end})",
            f"last = max(min(width - {right}, {end}), first)",
            *self._interior("first", "last"),
            "for part in range(2):",
            *indented(
                [
                    f"start = {begin} if part == 0 else last",
                    f"stop = first if part == 0 else {end}",
                    *self._edge("start", "stop"),
                ]
            ),
        ]

    def _given(self) -> str:
        """Members of the tuple that the body takes."""
        prefix = f"im{self.number}_"
        texts = {"floats": f"floats{self.number}", "ints": f"ints{self.number}"}
        for image in range(len(self.program.images)):
            for end in ("", "_w", "_h"):
                texts[f"im{image}{end}"] = f"{prefix}{image}{end}"
            if image in self.rings:
                _, producer, slot = self.rings[image]
                texts[f"im{image}"] = f"ring{producer}_{slot}"
                texts[f"im{image}_w"], texts[f"im{image}_h"] = "width", "height"
                texts[f"im{image}_pitch"], texts[f"im{image}_from"] = f"pitch{producer}", f"from{producer}"
        builtins = [name for name, _ in self.program.builtins]
        names = argument_names(self.program, builtins, tuple(sorted(self.rings)))
        sizes = {name: builtin(name, self.program, prefix) for name in builtins}
        for image, use in enumerate(self.program.images):
            if image in self.rings:
                sizes |= {f"size.{use.name}.0": "int32(width)", f"size.{use.name}.1": "int32(height)"}
        return ", ".join(texts.get(name) or sizes.get(name) or name for name in names)

    def _interior(self, first: str, last: str) -> list[str]:
        """The loop over a stretch of a row; by single numbers where all channels are alike."""
        if self.alike:
            body = [f"r = inside{self.number}(({self._given()},))", *self._stores("j")]
            return ["x = 0", f"for j in range({first} * {self.alike}, {last} * {self.alike}):", *indented(body)]
        body = ["j = 0", f"r = inside{self.number}(({self._given()},))", *self._stores("0")]
        return [f"for x in range({first}, {last}):", *indented(body)]

    def _edge(self, first: str, last: str) -> list[str]:
        if self.alike:
            call = [f"r = border{self.number}(({self._given()},))", *self._stores(f"x * {self.alike} + j")]
            body = [f"for j in range({self.alike}):", *indented(call)]
        else:
            body = ["j = 0", f"r = border{self.number}(({self._given()},))", *self._stores("0")]
        return [f"for x in range({first}, {last}):", *indented(body)]

    def _stores(self, place: str) -> list[str]:
        base = "row" if self.last else "kept"
        if self.alike:
            return [f"{self.stores[0]}[uint64({base} * {self.alike} + {place})] = r[0]"]
        lines, number = [], 0
        for name, count in zip(self.stores, self.stage.channels, strict=True):
            for channel in range(count):
                lines.append(f"{name}[uint64(({base} + x) * {count} + {channel})] = r[{number}]")
                number += 1
        return lines
