"""Mistakes in what several backends share: the printer, the spelling of operations, the prelude, the plan."""

from __future__ import annotations

from tests.mutation.mutant import Mutant


def _op(row: str, old: str, new: str, *names: str, backend: str = "gl", harmless: str = "") -> Mutant:
    return Mutant(row, old, new, backend, tuple(f"operations/{name}" for name in names), harmless)


def _pre(function: str, old: str, new: str, *catchers: str, harmless: str = "") -> Mutant:
    return Mutant(function, old, new, "gl", catchers, harmless)


def _plan(function: str, old: str, new: str, *first: str, harmless: str = "") -> Mutant:
    return Mutant(function, old, new, "gl", (*first, "plans/", "sequences/"), harmless)


def _composite(function: str, old: str, new: str) -> Mutant:
    return Mutant(function, old, new, "numpy", ("composites/",))


def _long(function: str, old: str, new: str, backend: str = "numpy", where: str = "composites/long arrays") -> Mutant:
    return Mutant(function, old, new, backend, (where,))


def _reduce(function: str, old: str, new: str, *catchers: str) -> Mutant:
    return Mutant(function, old, new, "gl", catchers or ("plans/sums", "plans/a histogram", "plans/less last"))


#: Of the row of floats, which GLSL's row of ints is like up to its end.
_FLOATS = '"add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "div"'

MUTANTS = (
    # Long arrays
    _long("entry", 's.Lit("int", type_.length - 1)', 's.Lit("int", type_.length - 2)'),
    _long("entry", 'e.op("max", index, s.Lit("int", 0))', 'e.op("max", index, s.Lit("int", 1))'),
    _long("entry", 's.Lit("int", WIDTH - 1)', 's.Lit("int", WIDTH // 2 - 1)'),
    _long("entry", 's.Lit("int", WIDTH_BITS)', 's.Lit("int", WIDTH_BITS + 1)', "gl"),
    _long("entry", 'e.op("add", first, s.Lit("int", k))', "first"),
    _long("_from_halves", 'e.op("bit_or", e.op("to_int", low), upper)', "upper"),
    _long("picture_of", "halves[:, 0], halves[:, 1] =", "halves[:, 1], halves[:, 0] ="),
    _long("numbers_in", "halves[:, 1] << HALF_BITS", "halves[:, 1]"),
    _long("Buffers.bring", "self.written[resource] is not value or ", "", where="composites/long arrays that"),
    _long("Shared.finish", "(n, t) for n, t in self.buffers.items() if n in read", "(n, t) for n, t in ()"),
    _long("picked", 'not hasattr(value, "_fields")', "not hasattr(value, field)"),
    # Ranges of parameters
    Mutant("ends", "max(first, least)", "max(first + 1, least)", "numpy", ("language/loops and offsets within a par",)),
    Mutant(
        "ends",
        "math.floor(high), most)",
        "math.floor(high) - 1, most)",
        "numpy",
        ("language/loops and offsets within a par",),
    ),
    # Runs
    _plan("earliest_first", "reversed(list(pairwise(chain)))", "pairwise(chain)"),
    _plan("Execution._begin_history", "np.asarray(resource.initial, np.float32)", "np.zeros(1, np.float32)"),
    _plan("Execution._default_value", "self.runs if", "0 if"),
    _plan("Resources.histories", "image.frames_ago)", "1)"),
    # The printer
    Mutant("FLOOR_DIVIDE", "? q - 1 : q;", "? q : q;", "gl", ("operations/floor_divide",)),
    Mutant("INT_MOD", "? r + b : r;", "? r : r;", "opencl", ("operations/int_mod",)),
    Mutant(
        "Printer.branch",
        'f"if ({self.operand(i.condition)}) {{"',
        'f"if (!{self.operand(i.condition)}) {{"',
        "gl",
        ("language/",),
    ),
    Mutant(
        "CLike.choice",
        "({condition} ? {then} : {orelse})",
        "({condition} ? {orelse} : {then})",
        "gl",
        ("operations/smoothstep", "operations/sign"),
    ),
    Mutant(
        "Printer.float_literal",
        'text = f"{exact!r}',
        "text = f\"{float(format(exact, '.6g'))!r}",
        "gl",
        ("operations/radians", "operations/exp"),
    ),
    Mutant(
        "Printer.instruction",
        '"break;" if isinstance(i, s.Break) else "continue;"',
        '"continue;" if isinstance(i, s.Break) else "break;"',
        "gl",
        ("language/",),
    ),
    Mutant(
        "INT_MIN_TEXT", 'INT_MIN_TEXT = "(-2147483647 - 1)"', 'INT_MIN_TEXT = "(-2147483647)"', "gl", ("operations/",)
    ),
    Mutant(
        "Printer.float_literal",
        "0 < abs(exact) < SMALLEST_NORMAL or negative_zero",
        "0 < abs(exact) < SMALLEST_NORMAL",
        "gl",
        ("language/identities",),
        "docs/kernels.md promises no sign of a zero",
    ),
    # How operations are spelled
    _op("SPELLED", '"roundEven({0})"', '"floor({0} + 0.5)"', "round"),
    _op("SPELLED", '"rint({0})"', '"round({0})"', "round", backend="opencl"),
    _op("SPELLED", '"({0} || {1})"', '"({0} && {1})"', "logical_or"),
    _op("SPELLED", '"({0} >> ({1} & 31))"', '"(({0} >> ({1} & 31)) & 0x7fffffff)"', "shift_right", backend="opencl"),
    _op("SPELLED", '"({0} ^ {1})"', '"({0} | {1})"', "bit_xor"),
    _op("SPELLED", '"({0} ? 1.0 : 0.0)"', '"({0} ? 0.0 : 1.0)"', "to_float of bools"),
    # The prelude: every target runs it, the reference does not
    _pre(
        "sign",
        "return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)",
        "return 1.0 if x >= 0.0 else -1.0",
        "operations/sign",
    ),
    _pre("mix", "return x * (1.0 - a) + y * a", "return y * (1.0 - a) + x * a", "operations/mix"),
    _pre("step", "return 0.0 if x < edge else 1.0", "return 0.0 if x <= edge else 1.0", "operations/step"),
    _pre("mod", "raised = rest + size if rest < 0.0 else rest", "raised = rest", "operations/mod"),
    _pre("mod", "q = floor(abs(magnitude / size))", "q = floor(abs(magnitude / size) + 0.9999)", "operations/mod"),
    _pre("mod", "other_sign = (x < 0.0) != (y < 0.0)", "other_sign = (x < 0.0)", "operations/mod"),
    _pre(
        "reduce_angle",
        "return min(max(r, -0.8), 0.8)",
        "return min(max(r, -0.7), 0.7)",
        "operations/sin",
        "operations/cos",
    ),
    _pre("smoothstep", "width = 0.5 * high - start", "width = high - start", "operations/smoothstep"),
    Mutant(
        "_length_of",
        's.Lit("int", 0x02000000)',
        's.Lit("int", 0x02800000)',
        "numpy",
        ("operations/length",),
    ),
    Mutant("_step_of", 's.Lit("int", 0x78000000)', 's.Lit("int", 0)', "numpy", ("operations/length",)),
    Mutant(
        "NEAR_ONE",
        "NEAR_ONE = 0x7F000000",
        "NEAR_ONE = 0x3F800000",
        "numpy",
        ("operations/normalize",),
    ),
    _pre(
        "smoothstep", "return t * t * (3.0 - 2.0 * t)", "return t * t * (3.0 - 2.000001 * t)", "operations/smoothstep"
    ),
    _pre(
        "exp",
        "exponent = round(y * 1.44269504088896341)",
        "exponent = floor(y * 1.44269504088896341)",
        "operations/exp",
    ),
    _pre("exp", "p = p * f + 1.6666665459e-1", "p = p * f + 1.6680e-1", "operations/exp", "operations/sinh"),
    _pre(
        "exp",
        "p = p * f + 1.6666665459e-1",
        "p = p * f + 1.6666666667e-1",
        "operations/exp",
        harmless="the series' own coefficient: the error stays inside the table's 3 units",
    ),
    _pre("sine_polynomial", "p = p * z + 8.3321608736e-3", "p = p * z + 8.3421608736e-3", "operations/sin"),
    _pre("cosine_polynomial", "p = p * z - 1.388731625493765e-3", "p = p * z - 1.398731625493765e-3", "operations/cos"),
    _pre(
        "cos",
        "return -value if ((k + 1) & 2) == 2 else value",
        "return -value if (k & 2) == 2 else value",
        "operations/cos",
    ),
    _pre(
        "reduce_angle",
        "near = (x - quarter * 1.5703125) - quarter * 4.837512969970703125e-4",
        "near = x - quarter * 1.570796251296997",
        "operations/sin",
    ),
    _pre("atan", "p = p * z + 1.99777106478e-1", "p = p * z + 1.9987e-1", "operations/atan"),
    _pre(
        "atan2",
        "turned = angle + (3.14159265358979323846 if y >= 0.0",
        "turned = angle + (3.14159265358979323846 if y > 0.0",
        "operations/atan2",
    ),
    _pre(
        "pow",
        "rest = high * 0.00031222839606925845 + low",
        "rest = high * 0.00031222839606925845 + 0.0 * low",
        "operations/pow",
    ),
    _pre("pow", "signed = -defined if odd_exponent and x < 0.0", "signed = -defined if x < 0.0", "operations/pow"),
    _pre("pow", "size = abs(x) if whole_exponent else x", "size = x", "operations/pow"),
    Mutant(
        "whole_power",
        'x, n = e.op("div", ONE, x), -n',
        "n = -n",
        "gl",
        ("operations/pow of known exponents",),
    ),
    _pre(
        "log2",
        "result = tail * 0.44269504088896341 + f * 0.44269504088896341 + tail + f + e",
        "result = (tail + f) * 1.44269504 + e",
        "operations/log2",
        harmless="rounds once more, within the table's 3 units",
    ),
    # On numpy, which stores floats: hardware turns a NaN into 0 by itself.
    _pre(
        "quantize_half",
        "normal = (size + 0xFFF + ((size >> 13) & 1)) & -8192",
        "normal = (size + 0x1000) & -8192",
        "language/stored",
        "pictures/",
    ),
    _pre(
        "quantize_half",
        "normal = (size + 0xFFF + ((size >> 13) & 1)) & -8192",
        "normal = size & -8192",
        "language/stored",
        "pictures/",
    ),
    _pre(
        "quantize_half",
        "size >= 0x477FF000 else rounded",
        "size > 0x47800000 else rounded",
        "language/stored",
        "pictures/",
    ),
    _pre(
        "encode_srgb",
        "1.055 * pow(c, 0.4166666666666667) - 0.055",
        "1.055 * pow(c, 0.45) - 0.055",
        "language/stored",
        "pictures/",
    ),
    _pre(
        "decode_srgb",
        "return x / 12.92 if x <= 0.04045 else",
        "return x / 12.92 if x <= 0.4045 else",
        "language/stored",
        "pictures/",
    ),
    # The plan: results are known to the bit, whatever is optimised
    _plan(
        "_Shared.taken",
        "self.busy[0][0] < first:",
        "self.busy[0][0] <= first:",
        "sequences/memories shared along a chain",
    ),
    _plan("lifetimes", "spans[resource] = (first, index)", "spans[resource] = (first, first)"),
    _plan(
        "emit",
        "*outputs.values(), *before, *before.values(), *read.values(),",
        "*outputs.values(), *read.values(),",
    ),
    _plan(
        "_handed_on",
        "return {r for step in steps if not step.static for r in step.reads if r in static}",
        "return set()",
    ),
    _plan(
        "_mark_static",
        "if any(isinstance(v, (Value, Derived)) and not v.static for v in step.values.values()):",
        "if False:",
    ),
    _plan("_mark_static", "changing = with_history | {", "changing = {"),
    _plan("_share_pictures", "if (load.content, node) in copies:", "if False:"),
    _plan("_fusable", "not consumer.program.image(name).pointwise or", "False or"),
    _plan(
        "_fusable",
        "if any(target in counts.wanted for target in producer.colours):",
        "if False:",
    ),
    _plan("_fusable", "if counts.readers[producer.node] != {consumer.node}:", "if False:"),
    _plan("_with_copies", "if any(nx.has_path(graph, draw, r) for r in waits_for):", "if False:"),
    _plan(
        "cull",
        "*(work.final[s] for s in history)",
        "",
        harmless="a graph that reads history which no output needs is refused before",
    ),
    _plan("Execution._run_steps", "static_changed |= self._upload(pictures)", "self._upload(pictures)"),
    _plan("Execution._move_history", "for now, before in self._histories:", "for now, before in ():"),
    _plan(
        "Execution._upload",
        "if name in static and self._uploaded.get(name) is picture:",
        "if name in static and name in self._uploaded:",
    ),
    _plan("Execution._changed", "return last_static is None or any(", "return last_static is None or False and any("),
    _plan(
        "Execution.run",
        "self._static_seen, self._moves_due = static, True",
        "self._static_seen, self._moves_due = static, False",
    ),
    # Lowering: the reference interprets what comes before it
    Mutant(
        "Emitter._fold",
        'if name == "sub" and right and',
        'if name == "sub" and',
        "gl",
        ("language/identities",),
    ),
    Mutant(
        "Emitter.choose",
        "return then if condition.value else orelse",
        "return orelse if condition.value else then",
        "gl",
        ("language/",),
    ),
    Mutant(
        "Emitter.texel",
        's.Lit("float", 0.0), s.Lit("float", 1.0))',
        's.Lit("float", 0.0), s.Lit("float", 0.0))',
        "gl",
        ("pictures/",),
    ),
    Mutant(
        "Emitter._choose_bool",
        'self.op("logical_and", self.op("logical_not", condition), orelse)',
        'self.op("logical_and", condition, orelse)',
        "gl",
        ("language/",),
    ),
    Mutant(
        "_TERMS",
        '"{x} * (1.0 - {da})"',
        '"{x} * {da}"',
        "gl",
        ("draw states/blend factor one_minus_destination_alpha",),
    ),
    Mutant(
        "_EQUATIONS",
        '"{destination} - {source}"',
        '"{source} - {destination}"',
        "gl",
        ("draw states/blend equation reverse",),
    ),
    Mutant("blend_text", '"sa": "1.0" if opaque', '"sa": "0.0" if opaque', "gl", ("draws/blend",)),
    Mutant(
        "blend_text",
        "_combined(blend.alpha_terms,",
        "_combined((blend.source, blend.destination, blend.equation),",
        "gl",
        ("draw states/blend",),
    ),
    Mutant("blend_text", "'min(max(0.0, source), 1.0)'", "'source'", "gl", ("draws/blend from beyond",)),
    Mutant("BORDERS", '"i % size"', '"(i + 1) % size"', "numpy", ("language/a wide neighbourhood, repeat",)),
    Mutant(
        "BORDERS",
        "2 * size - 1 - i % (2 * size)",
        "2 * size - 2 - i % (2 * size)",
        "opencl",
        ("language/a wide neighbourhood, mirror",),
    ),
    Mutant(
        "BORDERS",
        "max(2 * size - 2, 1) - i % max(2 * size - 2, 1)",
        "max(2 * size - 1, 1) - i % max(2 * size - 2, 1)",
        "gl",
        ("language/a wide neighbourhood, reflect-101",),
    ),
    # Reads by place
    *(
        Mutant("_LIBRARY", old, new, "numpy", ("pictures/nearest, three times as large",))
        for old, new in (
            (
                "image.texel(ivec2(floor(position * vec2(image.size))))",
                "image.texel(ivec2(round(position * vec2(image.size))))",
            ),
            ("if image.is_nearest:\n        return nearest(", "if image.is_blank:\n        return nearest("),
        )
    ),
    *(
        Mutant(function, old, new, "numpy", ("pictures/linear, levels", "pictures/nearest, levels"))
        for function, old, new in (
            ("_LIBRARY", "below[channel], beside_below[channel]", "beside_below[channel], below[channel]"),
            ("_LIBRARY", "return mix(upper, lower, at - base)", "return mix(lower, upper, at - base)"),
            ("_LIBRARY", "at + ivec2(0, first)", "at + ivec2(0, first + 1)"),
            ("_LIBRARY", "max(image.size >> clamp(", "max((image.size + 1) >> clamp("),
            ("_LIBRARY", "at = ivec2(x, y + z * size.y)", "at = ivec2(x, y + z * size.x)"),
            ("_LIBRARY", "return mix(result[0], result[1], f.z)", "return mix(result[1], result[0], f.z)"),
            ("_rules", "rule == {number}", "rule == {3 - number}"),
        )
    ),
    Mutant("Printer.trips", '"<" if i.step > 0', '"<=" if i.step > 0', "gl", ("language/",)),
    Mutant("SPELLED", _FLOATS, _FLOATS.replace("+", "-"), "gl", ("operations/add",)),
    Mutant("SPELLED", _FLOATS, _FLOATS.replace("{0} - {1}", "{1} - {0}"), "gl", ("operations/sub",)),
    Mutant("SPELLED", '"({0} / {1})"', '"({1} / {0})"', "gl", ("operations/div", "operations/inversesqrt")),
    Mutant(
        "SPELLED",
        '"div": "({0} / {1})", "neg": "(-{0})"',
        '"div": "({0} / {1})", "neg": "({0})"',
        "gl",
        ("operations/neg",),
    ),
    Mutant("_NUMBERS", '"({1} < {0} ? {1} : {0})"', '"({0} < {1} ? {1} : {0})"', "gl", ("operations/min",)),
    Mutant("_NUMBERS", '"({1} < {0} ? {1} : {0})"', '"({0} < {1} ? {0} : {1})"', "gl", ("operations/min",)),
    Mutant("_NUMBERS", '"({0} < {1} ? {1} : {0})"', '"({1} < {0} ? {0} : {1})"', "opencl", ("operations/max",)),
    Mutant("SPELLED", '"abs": "abs({0})", "round"', '"abs": "({0})", "round"', "gl", ("operations/abs",)),
    Mutant("_NUMBERS", '"({0} < {1})"', '"({0} <= {1})"', "gl", ("operations/less",)),
    Mutant("_NUMBERS", '"({0} >= {1})"', '"({0} > {1})"', "opencl", ("operations/greater_equal",)),
    Mutant("_NUMBERS", '"({0} == {1})"', '"({0} <= {1})"', "gl", ("operations/equal",)),
    Mutant("SPELLED", '"floor({0})"', '"trunc({0})"', "gl", ("operations/floor",)),
    Mutant("SPELLED", '"ceil({0})"', '"(floor({0}) + 1.0)"', "gl", ("operations/ceil",)),
    Mutant("SPELLED", '"trunc({0})"', '"floor({0})"', "opencl", ("operations/trunc",)),
    Mutant("SPELLED", '"({0} << ({1} & 31))"', '"({0} << ({1} & 15))"', "gl", ("operations/shift_left",)),
    Mutant("SPELLED", '"sqrt({0})"', '"(sqrt({0}) * 1.0000008)"', "gl", ("operations/sqrt",)),
    Mutant(
        "SPELLED",
        '"sqrt({0})"',
        '"(sqrt({0}) * 1.0000001)"',
        "gl",
        ("operations/sqrt",),
        harmless="about one unit in the last place, where the table allows 3",
    ),
    Mutant(
        "quantize",
        "return round(min(max(0.0, x), 1.0) * steps) / steps",
        "return floor(min(max(0.0, x), 1.0) * steps + 0.5) / steps",
        "gl",
        ("pictures/r16 7x5", "language/stored", "pictures/"),
    ),
    Mutant(
        "quantize",
        "return round(min(max(0.0, x), 1.0) * steps) / steps",
        "return round(min(max(x, 0.0), 1.0) * steps) / steps",
        "numpy",
        ("language/stored",),
    ),
    Mutant("dependencies", "in_place[draw] |= dict.fromkeys(other_readers)", "pass", "gl", ("plans/", "sequences/")),
    Mutant(
        "dependencies",
        "if content in root_contents or any(content in work.passes[r].done.drawn_over for r in other_readers):",
        "if False:",
        "gl",
        ("plans/", "sequences/"),
    ),
    Mutant(
        "COMMUTATIVE",
        "if row.commutes)",
        'if row.commutes or row.name == "sub")',
        "gl",
        ("language/identities", "operations/sub"),
    ),
    # What is taken apart: matrices that are not square, arrays of structs, of arrays and of images
    _composite("_matmul", "for row in rows(a, left.rows)]\n    if", "for row in rows(a, right.rows)]\n    if"),
    _composite("in_order", "array = np.swapaxes(array, -1, -2)", "pass"),
    _composite(
        "_clamped",
        'return apply("min", [apply("max", [index, low], span), high], span)',
        'return apply("max", [index, low], span)',
    ),
    _composite("Place.index", "_int(-1, span), span)", "_int(0, span), span)"),
    _composite(
        "Place.index", 'inside = apply("logical_and", [inside, _inside', 'inside = apply("logical_or", [inside, _inside'
    ),
    _composite("_table_type", "reversed(sides)", "sides"),
    _composite("_rows", "len(values) // sides[0]", "len(values) // sides[-1]"),
    _composite("nth", "if k else first", "if k > 1 else first"),
    _composite("each_image", "ir.Literal(INT, first + half, span)", "ir.Literal(INT, first + half - 1, span)"),
    _composite("each_image", "branch(images[half:], first + half)", "branch(images[half:], first)"),
    # Reductions, which the oracle computes as they are written: what they must give, cases say
    _reduce("joined", "return a + b", "return a - b"),
    _reduce("joined", "b.x == a.x and b.z < a.z", "b.x == a.x", "plans/the first place"),
    Mutant(  # gl and opencl count without adding rows up
        "at_place",
        "at.x < image.size.x and at.y < image.size.y",
        "at.x < image.size.x",
        "numpy",
        ("plans/a histogram",),
    ),
    _reduce("joined", "not first and b.x == a.x", "first and b.x == a.x", "plans/the first place"),
    _reduce("level", "ivec2(SIDE, 0), ivec2(SIDE * SIDE, 1)", "ivec2(SIDE, 0), ivec2(SIDE, 1)"),
    _reduce(
        "per_texel", "float(size.x // result_size.x) * float(size.y // result_size.y)", "float(size.x // result_size.x)"
    ),
    _reduce("bin_of", "number >= low and number <= high", "number <= high"),
    _reduce("bin_of", "min(place, float(bins - 1)) + 1.0", "place + 1.0"),
    _reduce("count_bins", "4 * pixel().x", "3 * pixel().x"),
    _reduce("count_bins", "2.0 * quarter", "quarter"),
    _reduce("counted", "number == bins.w", "number == bins.z"),
    _reduce("count_of_bin", "pixel().x % quarter", "pixel().x"),
    _reduce("count_of_bin", "place == 1", "place == 3"),
    _reduce("_taken", "-(-size[0] // declared.width)", "(size[0] // declared.width)"),
    # Loops, match and discard: Python is the truth, which the reference may not share
    Mutant("Loops._index", '"greater_equal", count', '"greater", count', "numpy", ("language/bounds from data",)),
    Mutant(
        "Loops._trips",
        'e.op("floor_divide", e.op("sub", between, one), step)',
        'e.op("floor_divide", between, step)',
        "gl",
        ("language/bounds from data",),
    ),
    Mutant(
        "Loops._count",
        '                value = e.choose(e.op("greater", step, zero), value, zero)',
        "                pass",
        "numpy",
        ("language/bounds from data",),
    ),
    Mutant(
        "Loops._reach",
        "low = min([first.low] * rises",
        "low = min([first.high] * rises",
        "numpy",
        ("language/offsets within bounds",),
    ),
    Mutant("NumberDomain.trips", "over = trip >= counts", "over = trip > counts", "numpy", ("language/bounds from",)),
    Mutant("_condition", "[ast.Eq()]", "[ast.GtE()]", "numpy", ("language/match",)),
    Mutant("Builder.keep_or_clear", 'if self.stage != "pixel":', "if self.stage:", "numpy", ("language/discard",)),
)
