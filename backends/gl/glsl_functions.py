"""What GLSL 3.30 calls each primitive operation, and functions for those that it lacks."""

from __future__ import annotations

from passgraph.backends.c_like import FLOOR_DIVIDE, INT_MOD, spelled

#: Type of the arguments → operation → its expression.
SPELLED = spelled({
    "float": {
        "abs": "abs({0})", "round": "roundEven({0})", "bits_from_float": "floatBitsToInt({0})",
    },
    "int": {
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "neg": "(-{0})", "abs": "abs({0})",
        "shift_left": "({0} << ({1} & 31))", "to_float": "float({0})", "float_from_bits": "intBitsToFloat({0})",
    },
    "bool": {"to_float": "({0} ? 1.0 : 0.0)"},
})  # fmt: skip

#: Name → definition.  A later one may call an earlier one.
FUNCTIONS = {
    "pg_isnan": "bool pg_isnan(float x) { return (floatBitsToInt(x) & 0x7fffffff) > 0x7f800000; }",
    "pg_isinf": "bool pg_isinf(float x) { return (floatBitsToInt(x) & 0x7fffffff) == 0x7f800000; }",
    # Nobody sets the uniform, so it is 0; but no compiler knows that.
    "pg_hidden": """
uniform int pg_nil;
float pg_hidden(float x) { return intBitsToFloat(floatBitsToInt(x) | pg_nil); }
""",
    "pg_to_int": """
int pg_to_int(float x)
{
    int i = int(max(x, -2147483648.0));
    i = x < 2147483648.0 ? i : 2147483647;
    return pg_isnan(x) ? 0 : i;
}
""",
    "pg_floor_divide": FLOOR_DIVIDE,
    "pg_int_mod": INT_MOD,
    # Of border rules, which have a size for b: devices divide ints one by one, and floats side by side.
    "pg_nearer": """
int pg_nearer(int a, int b)
{
    return a - int(float(a) * (1.0 / float(b))) * b;
}
""",
    "pg_near_mod": """
int pg_near_mod(int a, int b)
{
    int r = pg_nearer(a, b);
    r = r < 0 ? r + b : r;
    return r < b ? r : r - b;
}
""",
}
