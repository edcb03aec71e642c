"""Mistakes in what several backends share: the printer, the spelling of operations, the prelude, the plan."""

from __future__ import annotations

from tests.mutation.mutant import Mutant

PRINTING = "backends/printing.py"
C_LIKE = "backends/c_like.py"
GLSL, OPENCL_C = "backends/gl/glsl_functions.py", "backends/opencl/opencl_c.py"
PRELUDE = "passgraph/language/prelude.py"
BORDERS = "passgraph/language/borders.py"
BLENDING = "passgraph/plan/blending.py"


def _op(file: str, old: str, new: str, *names: str, backend: str = "gl", harmless: str = "") -> Mutant:
    return Mutant(file, old, new, backend, tuple(f"operations/{name}" for name in names), harmless)


def _pre(old: str, new: str, *catchers: str, harmless: str = "") -> Mutant:
    return Mutant(PRELUDE, old, new, "gl", catchers, harmless)


def _plan(file: str, old: str, new: str, harmless: str = "") -> Mutant:
    return Mutant(f"passgraph/{file}", old, new, "gl", ("plans/", "sequences/"), harmless)


def _blend(old: str, new: str, *catchers: str) -> Mutant:
    """What all blend by is wrong; gl's hardware knows better."""
    return Mutant(BLENDING, old, new, "gl", catchers or ("draw states/blend",))


MUTANTS = (
    # Blending
    _blend('"{x} * (1.0 - {da})"', '"{x} * {da}"', "draw states/blend factor one_minus_destination_alpha"),
    _blend('"{destination} - {source}"', '"{source} - {destination}"', "draw states/blend equation reverse"),
    _blend('"sa": "1.0" if opaque', '"sa": "0.0" if opaque', "draws/blend"),
    _blend("_combined(blend.alpha_terms,", "_combined((blend.source, blend.destination, blend.equation),"),
    _blend("f'min(max({format_.low}, source), 1.0)'", "'source'", "draws/blend from beyond"),
    # Border rules: what a picture padded by NumPy gives knows better
    Mutant(BORDERS, '"i % size"', '"(i + 1) % size"', "numpy", ("language/a wide neighbourhood, repeat",)),
    Mutant(
        BORDERS,
        "2 * size - 1 - i % (2 * size)",
        "2 * size - 2 - i % (2 * size)",
        "opencl",
        ("language/a wide neighbourhood, mirror",),
    ),
    # The printer
    Mutant(C_LIKE, "? q - 1 : q;", "? q : q;", "gl", ("operations/floor_divide",)),
    Mutant(C_LIKE, "? r + b : r;", "? r : r;", "opencl", ("operations/int_mod",)),
    Mutant(PRINTING, '"<" if i.step > 0', '"<=" if i.step > 0', "gl", ("language/",)),
    Mutant(
        PRINTING,
        'f"if ({self.operand(i.condition)}) {{"',
        'f"if (!{self.operand(i.condition)}) {{"',
        "gl",
        ("language/",),
    ),
    Mutant(
        C_LIKE,
        "({condition} ? {then} : {orelse})",
        "({condition} ? {orelse} : {then})",
        "gl",
        ("operations/smoothstep", "operations/sign"),
    ),
    Mutant(
        PRINTING,
        'text = f"{exact!r}',
        "text = f\"{float(format(exact, '.6g'))!r}",
        "gl",
        ("operations/radians", "operations/exp"),
    ),
    Mutant(
        PRINTING,
        '"break;" if isinstance(i, s.Break) else "continue;"',
        '"continue;" if isinstance(i, s.Break) else "break;"',
        "gl",
        ("language/",),
    ),
    Mutant(PRINTING, 'INT_MIN_TEXT = "(-2147483647 - 1)"', 'INT_MIN_TEXT = "(-2147483647)"', "gl", ("operations/",)),
    Mutant(
        PRINTING,
        "0 < abs(exact) < SMALLEST_NORMAL or negative_zero",
        "0 < abs(exact) < SMALLEST_NORMAL",
        "gl",
        ("language/identities",),
        "docs/kernels.md promises no sign of a zero",
    ),
    # How operations are spelled
    _op(C_LIKE, '"({0} + {1})"', '"({0} - {1})"', "add"),
    _op(C_LIKE, '"({0} - {1})"', '"({1} - {0})"', "sub"),
    _op(C_LIKE, '"({0} / {1})"', '"({1} / {0})"', "div", "inversesqrt"),
    _op(C_LIKE, '"(-{0})"', '"({0})"', "neg"),
    _op(C_LIKE, '"({1} < {0} ? {1} : {0})"', '"({0} < {1} ? {1} : {0})"', "min"),
    _op(C_LIKE, '"({1} < {0} ? {1} : {0})"', '"({0} < {1} ? {0} : {1})"', "min"),
    _op(C_LIKE, '"({0} < {1} ? {1} : {0})"', '"({1} < {0} ? {0} : {1})"', "max", backend="opencl"),
    _op(GLSL, '"abs": "abs({0})", "round"', '"abs": "({0})", "round"', "abs"),
    _op(C_LIKE, '"({0} < {1})"', '"({0} <= {1})"', "less"),
    _op(C_LIKE, '"({0} >= {1})"', '"({0} > {1})"', "greater_equal", backend="opencl"),
    _op(C_LIKE, '"({0} == {1})"', '"({0} <= {1})"', "equal"),
    _op(C_LIKE, '"floor({0})"', '"trunc({0})"', "floor"),
    _op(C_LIKE, '"ceil({0})"', '"(floor({0}) + 1.0)"', "ceil"),
    _op(C_LIKE, '"trunc({0})"', '"floor({0})"', "trunc", backend="opencl"),
    _op(GLSL, '"roundEven({0})"', '"floor({0} + 0.5)"', "round"),
    _op(OPENCL_C, '"rint({0})"', '"round({0})"', "round", backend="opencl"),
    _op(C_LIKE, '"({0} || {1})"', '"({0} && {1})"', "logical_or"),
    _op(GLSL, '"({0} << ({1} & 31))"', '"({0} << ({1} & 15))"', "shift_left"),
    _op(C_LIKE, '"({0} >> ({1} & 31))"', '"(({0} >> ({1} & 31)) & 0x7fffffff)"', "shift_right", backend="opencl"),
    _op(C_LIKE, '"({0} ^ {1})"', '"({0} | {1})"', "bit_xor"),
    _op(GLSL, '"({0} ? 1.0 : 0.0)"', '"({0} ? 0.0 : 1.0)"', "to_float of bools"),
    _op(C_LIKE, '"sqrt({0})"', '"(sqrt({0}) * 1.0000008)"', "sqrt"),
    _op(
        C_LIKE,
        '"sqrt({0})"',
        '"(sqrt({0}) * 1.0000001)"',
        "sqrt",
        harmless="about one unit in the last place, where the table allows 3",
    ),
    # The prelude: every target runs it, the reference does not
    _pre(
        "return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)", "return 1.0 if x >= 0.0 else -1.0", "operations/sign"
    ),
    _pre("return x * (1.0 - a) + y * a", "return y * (1.0 - a) + x * a", "operations/mix"),
    _pre("return 0.0 if x < edge else 1.0", "return 0.0 if x <= edge else 1.0", "operations/step"),
    _pre("raised = rest + size if rest < 0.0 else rest", "raised = rest", "operations/mod"),
    _pre("q = floor(max(whole / size, 0.0))", "q = floor(max(whole / size + 0.9999, 0.0))", "operations/mod"),
    _pre("other_sign = (x < 0.0) != (y < 0.0)", "other_sign = (x < 0.0)", "operations/mod"),
    _pre("return min(max(r, -0.8), 0.8)", "return min(max(r, -0.7), 0.7)", "operations/sin", "operations/cos"),
    _pre("width = 0.5 * high - start", "width = high - start", "operations/smoothstep"),
    Mutant(
        "passgraph/language/expand.py",
        's.Lit("int", 0x02000000)',
        's.Lit("int", 0x02800000)',
        "numpy",
        ("operations/length",),
    ),
    Mutant(
        "passgraph/language/expand.py", 's.Lit("int", 0x78000000)', 's.Lit("int", 0)', "numpy", ("operations/length",)
    ),
    Mutant(
        "passgraph/language/expand.py",
        "NEAR_ONE = 0x7F000000",
        "NEAR_ONE = 0x3F800000",
        "numpy",
        ("operations/normalize",),
    ),
    _pre("return t * t * (3.0 - 2.0 * t)", "return t * t * (3.0 - 2.000001 * t)", "operations/smoothstep"),
    _pre("whole = round(y * 1.44269504088896341)", "whole = floor(y * 1.44269504088896341)", "operations/exp"),
    _pre("p = p * f + 1.6666665459e-1", "p = p * f + 1.6680e-1", "operations/exp", "operations/sinh"),
    _pre(
        "p = p * f + 1.6666665459e-1",
        "p = p * f + 1.6666666667e-1",
        "operations/exp",
        harmless="the series' own coefficient: the error stays inside the table's 3 units",
    ),
    _pre("p = p * z + 8.3321608736e-3", "p = p * z + 8.3421608736e-3", "operations/sin"),
    _pre("p = p * z - 1.388731625493765e-3", "p = p * z - 1.398731625493765e-3", "operations/cos"),
    _pre(
        "return -value if ((k + 1) & 2) == 2 else value",
        "return -value if (k & 2) == 2 else value",
        "operations/cos",
    ),
    _pre(
        "near = (x - quarter * 1.5703125) - quarter * 4.837512969970703125e-4",
        "near = x - quarter * 1.570796251296997",
        "operations/sin",
    ),
    _pre("p = p * z + 1.99777106478e-1", "p = p * z + 1.9987e-1", "operations/atan"),
    _pre(
        "turned = angle + (3.14159265358979323846 if y >= 0.0",
        "turned = angle + (3.14159265358979323846 if y > 0.0",
        "operations/atan2",
    ),
    _pre(
        "rest = high * 0.00031222839606925845 + low",
        "rest = high * 0.00031222839606925845 + 0.0 * low",
        "operations/pow",
    ),
    _pre("signed = -defined if odd_exponent and x < 0.0", "signed = -defined if x < 0.0", "operations/pow"),
    _pre("size = abs(x) if whole_exponent else x", "size = x", "operations/pow"),
    Mutant(
        "passgraph/language/expand.py",
        'x, n = e.op("div", ONE, x), -n',
        "n = -n",
        "gl",
        ("operations/pow of known exponents",),
    ),
    _pre(
        "result = tail * 0.44269504088896341 + f * 0.44269504088896341 + tail + f + e",
        "result = (tail + f) * 1.44269504 + e",
        "operations/log2",
        harmless="rounds once more, within the table's 3 units",
    ),
    _pre(
        "return round(min(max(low, x), 1.0) * steps) / steps",
        "return floor(min(max(low, x), 1.0) * steps + 0.5) / steps",
        "language/stored",
        "pictures/",
    ),
    # On numpy, which stores floats: hardware turns a NaN into 0 by itself.
    Mutant(
        PRELUDE,
        "return round(min(max(low, x), 1.0) * steps) / steps",
        "return round(min(max(x, low), 1.0) * steps) / steps",
        "numpy",
        ("language/stored",),
    ),
    _pre(
        "normal = (size + 0xFFF + ((size >> 13) & 1)) & -8192",
        "normal = (size + 0x1000) & -8192",
        "language/stored",
        "pictures/",
    ),
    _pre(
        "normal = (size + 0xFFF + ((size >> 13) & 1)) & -8192", "normal = size & -8192", "language/stored", "pictures/"
    ),
    _pre("size >= 0x477FF000 else rounded", "size > 0x47800000 else rounded", "language/stored", "pictures/"),
    _pre("1.055 * pow(c, 0.4166666666666667) - 0.055", "1.055 * pow(c, 0.45) - 0.055", "language/stored", "pictures/"),
    _pre(
        "return x / 12.92 if x <= 0.04045 else", "return x / 12.92 if x <= 0.4045 else", "language/stored", "pictures/"
    ),
    # The plan: results are known to the bit, whatever is optimised
    _plan("plan/emit.py", "self.busy[0][0] < first:", "self.busy[0][0] <= first:"),
    _plan("plan/data.py", "spans[resource] = (first, index)", "spans[resource] = (first, first)"),
    _plan(
        "plan/emit.py",
        "*outputs.values(), *finals, *finals.values(), *inputs.values(),",
        "*outputs.values(), *inputs.values(),",
    ),
    _plan(
        "plan/emit.py",
        "return {r for step in steps if not step.static for r in step.reads if r in static}",
        "return set()",
    ),
    _plan(
        "plan/emit.py",
        "if any(isinstance(v, (Value, Derived)) and not v.static for v in step.values.values()):",
        "if False:",
    ),
    _plan("plan/emit.py", "changing = with_history | {", "changing = {"),
    _plan("plan/emit.py", "if (load.content, node) in copies:", "if False:"),
    _plan("plan/fuse.py", "not consumer.program.image(name).pointwise or", "False or"),
    _plan(
        "plan/fuse.py",
        "if any(Target(spec, producer.node, slot) in known.wanted for slot, spec in enumerate(producer.node.into)):",
        "if False:",
    ),
    _plan("plan/fuse.py", "if known.readers[producer.node] != {consumer.node}:", "if False:"),
    _plan("plan/order.py", "in_place[draw] |= dict.fromkeys(others)", "pass"),
    _plan("plan/order.py", "if content in kept or any(content in r.drawn_over for r in others):", "if False:"),
    _plan("plan/order.py", "if any(nx.has_path(graph, draw, r) for r in others):", "if False:"),
    _plan(
        "plan/cull.py",
        "*(work.final[s] for s in history)",
        "",
        "a graph that reads history which no output needs is refused before",
    ),
    _plan("execution.py", "static_changed |= self._upload(pictures)", "self._upload(pictures)"),
    _plan("execution.py", "if resource.history is not None:", "if False:"),
    _plan(
        "execution.py",
        "if name in static and self._uploaded.get(name) is picture:",
        "if name in static and name in self._uploaded:",
    ),
    _plan("execution.py", "return seen is None or any(", "return seen is None or False and any("),
    _plan(
        "execution.py",
        "self._static_seen, self._swap_due = static, True",
        "self._static_seen, self._swap_due = static, False",
    ),
    # Lowering: the reference interprets what comes before it
    Mutant(
        "passgraph/language/emitter.py",
        'if name == "sub" and right and',
        'if name == "sub" and',
        "gl",
        ("language/identities",),
    ),
    Mutant(
        "passgraph/language/emitter.py",
        "if row.commutes)",
        'if row.commutes or row.name == "sub")',
        "gl",
        ("language/identities", "operations/sub"),
    ),
    Mutant(
        "passgraph/language/emitter.py",
        "return then if condition.value else orelse",
        "return orelse if condition.value else then",
        "gl",
        ("language/",),
    ),
    Mutant(
        "passgraph/language/emitter.py",
        's.Lit("float", 0.0), s.Lit("float", 1.0))',
        's.Lit("float", 0.0), s.Lit("float", 0.0))',
        "gl",
        ("pictures/",),
    ),
    Mutant(
        "passgraph/language/emitter.py",
        'self.op("logical_and", self.op("logical_not", condition), orelse)',
        'self.op("logical_and", condition, orelse)',
        "gl",
        ("language/",),
    ),
)
