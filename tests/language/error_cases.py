"""Every error of kernel text: what provokes it, where its caret stands, what it says.

In kernel text ``«…»`` marks what the caret must point at.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from passgraph.graph.calls import fragment, vertex

HEAD = "def k(c: Image, n: int, v: vec3, m: mat3) -> float:\n    x = c[0, 0].x\n    "
STRUCT = "class S:\n    a: float\n    b: vec3\n\n"
HELPER = "def f(a: float, b: float = 1.0) -> float: return a + b\n\n"

#: Lines of a pixel kernel and words of the message.
BODIES: list[tuple[str, str]] = [
    # names and values
    ("return «y»", "name 'y' is not defined here; a kernel sees its parameters"),
    ("return «dot»", "dot is a function; call it"),
    ("return «vec3»", "vec3 is not a value"),
    ("return «'a'»", "numbers and bools, not str"),
    ("return x + «c»", "a value is expected here, got Image"),
    ("return «lambda: 1.0»", "no lambda; write a @pg.function"),
    ("return x if «v» else x", "a condition must be bool, got vec3; use any(...) or all(...)"),
    ("return x if «n» else x", "compare it with something"),
    ("return «x.y»", "float has no attribute 'y'"),
    ("return «c.width»", "an Image has .size, .levels and .slices, and is read by image[dx, dy], image.texel(ivec2), "),
    ("t = (x, x)\n    return «t.x»", "a tuple has no attributes; unpack it first"),
    ("return «v.w»", "vec3 has no component 'w'"),
    ("return «v.q1»", "swizzles use xyzw, rgba or stpq"),
    ("return «v.xxxxx».x", "a swizzle has at most 4 letters"),
    ("return x + «4294967296»", "does not fit 32 bits"),
    ("return x + «4294967295»", "write it as a float (4294967295.0), or, where its bits are meant, as 0xffffffff"),
    ("return x + «-0xFFFFFFFF»", "does not fit 32 bits"),
    ("return x + «1e39»", "does not fit float32"),
    ("return x + «1j»", "numbers and bools, not complex"),
    # operators
    ("return («m**2»)[0].x", "** does not take mat3"),
    ("return 1.0 if «x is x» else x", "no 'is' and no 'in'"),
    ("return «x @ x»", "@ multiplies matrices, got float @ float"),
    ("return («m % 2.0»)[0].x", "% does not take matrices"),
    ("return («m + mat2(1.0)»)[0].x", "+ mixes mat3 and mat2"),
    ("return («m + v»)[0].x", "+ does not take mat3 and vec3"),
    ("return («m * vec2(x)»).x", "cannot multiply mat3 by vec2"),
    ("return («m * mat2x3(x) * mat2x3(x)»)[0].x", "cannot multiply mat2x3 by mat2x3; mat2x3 has 2 columns"),
    ("return («vec2(x) * m»).x", "mat3 has 3 rows and takes a vec3 before it"),
    ("return («mat2x3(x) + mat3x2(x)»)[0].x", "+ mixes mat2x3 and mat3x2"),
    ("return «determinant(mat2x3(x))»", "determinant() takes a square matrix, got mat2x3"),
    ("return «mat2x3(x)[2]».x", "index 2 is outside mat2x3 (0 to 1)"),
    ("return («v + vec2(x)»).x", "+ mixes vectors of 3 and 2 components"),
    ("return «x + (x > 1.0)»", "+ takes numbers, got bool"),
    ("return float(«x & 1»)", "an argument of & must be int, got float"),
    ("return «sin(m)»[0].x", "sin() does not take mat3"),
    ("return «outer(x, x)»[0].x", "outer() takes vectors, got float"),
    ("return «dot(x, v)»", "dot() takes vectors, got float"),
    ("return «dot(m, m)»", "dot() does not take mat3"),
    ("return float(«uint(1) + n»)", "must be uint, got int; int and uint do not mix by themselves: write uint(...)"),
    ("return float(uint(1) + «-1»)", "must be uint, from 0 to 4294967295, got -1; write uint(-1) for its bits"),
    ("return «cross(vec2(x), vec2(x))».x", "cross() is for vec3, got vec2"),
    ("return «inverse(x)»", "inverse() takes a matrix, got float"),
    ("return «refract(v, v, v)».x", "takes a scalar float here, got vec3"),
    ("return «sin(x, x)»", "sin() takes 1 argument, got 2 (sine, radians"),
    ("return «sin([x, x])»", "sin() does not take Array[float, 2]"),
    # calls
    ("return «x(1)»", "x is a value here, not a function"),
    ("return «pi(1)»", "pi is not a function of the kernel language"),
    ("return «sin(x)(x)»", "only named functions can be called"),
    ("return «v.dot(v)»", "values have no methods; got .dot()"),
    ("return «sin(x=x)»", "sin takes no keyword arguments"),
    ("return «c.sample()».x", "an Image is read by .sample(position: vec2, lod: float); lod may be left out"),
    ("return «c.sample(v.xy, 1, 2)».x", "an Image is read by .sample(position: vec2, lod: float)"),
    ("return «c.sample(v.xy, position=v.xy)».x", "an Image is read by .sample(position: vec2, lod: float)"),
    ("return «c.nearest(v.xy, lod=1)».x", "an Image is read by .nearest(position: vec2)"),
    ("return «c._filtered(v.xy, c[0, 0], c[0, 0])».x", "image.size_of(int); it has no ._filtered()"),
    ("return «c.gather(v.xy)».x", "an Image is read by .gather(position: vec2, channel: int)"),
    ("return «c.gather(v.xy, 0.5)».x", "the channel of gather() must be int, got float"),
    ("return «c.sample3(v.xy)».x", "the position of sample3() must be vec3, got vec2"),
    ("return «c.texel(v.xy, **n)».x", "the kernel language has no ** arguments"),
    ("return «c.fetch(v)».x", "image.sample3(vec3), image.size_of(int); it has no .fetch()"),
    ("return float(«range(3)»)", "range() belongs in a for statement"),
    ("return «discard()»", "discard() is a statement"),
    ("return sin(«*v»)", "no * arguments"),
    ("return f(«*v»)", "the kernel language has no * arguments"),
    ("return f(**«v»)", "no ** arguments"),
    ("return float(«len(x)»)", "len() takes one array or vector"),
    ("return «dfdx()»", "dfdx() takes 1 argument, got 0"),
    ("return «fwidth(x, x)»", "fwidth() takes 1 argument, got 2"),
    ("return float(«dfdx(x > 0.5)»)", "dfdx() takes a float or a float vector, got bool"),
    ("return «dfdy([x, x])»[0]", "dfdy() takes a float or a float vector, got Array[float, 2]"),
    ("return «fwidth(m)»[0].x", "fwidth() takes a float or a float vector, got mat3"),
    ("return «select(True, x)»", "select() takes a condition"),
    ("return «select(True, [x], [x])»[0]", "select() takes scalars, vectors and matrices"),
    ("return «select(x, x, x)»", "select() takes bool or a bvec first, got float"),
    ("return «select(less(v, v), x, x)»", "select() takes 3 components on each side, got float"),
    ("return «clamp(x, 2.0, 1.0)»", "bounds the wrong way round: 2.0 > 1.0"),
    ("return «pixel(1)».x", "pixel() takes no arguments"),
    ("return «fragment_depth()»", "exists in fragment kernels, not in a pixel kernel"),
    ("return «f(x, x, x)»", "f takes 2 arguments, got 3"),
    ("return «f(x, z=x)»", "f has no parameter 'z'; it has a, b"),
    ("return «f(x, a=x)»", "f gets 'a' twice"),
    ("return «f()»", "f needs a"),
    ("return «f(v)»", "f(a) must be float, got vec3"),
    ("return «f(c)»", "f(a) must be float, got Image"),
    ("return «g(x)».x", "must be an Image, got float"),
    ("return «h(x)»", "must be S, got float"),
    # constructors, arrays, structs
    ("return «float(v)»", "float() takes one scalar"),
    ("return «vec3([x])».x", "vec3() does not take Array[float, 1]"),
    ("return «vec3(x, x)».x", "vec3() takes 3 components, got 2"),
    ("return «mat2x3(x, x)»[0].x", "mat2x3() takes 6 components (columns first), got 2"),
    ("return «mat2(x, x)»[0].x", "mat2() takes 4 components (columns first), got 2"),
    ("return «x[0]»", "float cannot be indexed"),
    ("return «v[3]»", "index 3 is outside vec3 (0 to 2)"),
    ("return «v[0:2]».x", "no slices; use a swizzle"),
    ("return «v[1.5]»", "an index must be int, got float"),
    ("return «c[0]».x", "an image takes two offsets in texels"),
    ("return c[«0.5», 0].x", "a texel offset must be int, got float; narrowing is never silent: write int(...)"),
    ("return «(x, x)[2]»", "a tuple of 2 takes a constant index in range"),
    ("a = «[]»\n    return x", "an array needs at least one element"),
    ("a = «[" + ", ".join(["x"] * 1025) + "]»\n    return x", "an array has at most 1024 elements, got 1025"),
    ("a = «[(x, x)]»\n    return x", "array elements are values, arrays, structs or images by name, got a tuple"),
    ("a = «[[x], x]»\n    return x", "the elements of an array must have one type, got Array[float, 1] and float"),
    ("a = «[S(x, v), x]»\n    return x", "the elements of an array must have one type, got S and float"),
    ("a = «[[x] * 200] * 6»\n    return x", "an array has at most 1024 elements, got 1200"),
    ("a = [[x, x], [x, x]]\n    return «a[2]»[0]", "index 2 is outside Array[Array[float, 2], 2] (0 to 1)"),
    ("a = [[x, x], [x, x]]\n    «a[2]»[0] = x\n    return x", "index 2 is outside Array[Array[float, 2], 2] (0 to 1)"),
    ("a = [[x, x], [x, x]]\n    «a[0] = [x]»\n    return x", "a[0] must be Array[float, 2], got Array[float, 1]"),
    ("a = [S(x, v)]\n    «a[n] = x»\n    return x", "a[n] must be S, got float"),
    ("a = [S(x, v)]\n    «a[n].c = x»\n    return x", "a[n].c cannot be assigned to"),
    ("a = [S(x, v)]\n    return x + «a»", "a value is expected here, got Array[S, 1]"),
    ("return «len([c, c][n])»", "len() takes one array or vector"),
    ("«a = [c, c]»\n    return x", "an Image cannot be given another name"),
    ("«return [c, c][n].size»", "the result of k must be float, got ivec2"),
    ("return («[c, c] if x > 1.0 else [c, c]»)[0].size.x", "cannot choose between values of type Array[Image, 2]"),
    ("a = «[x] * n»\n    return x", "[value] * n needs a whole constant n >= 1"),
    ("a = «[x] * 2000»\n    return x", "an array has at most 1024 elements, got 2000"),
    ("return «[x, v]»[0]", "the elements of an array must have one type, got float and vec3"),
    ("s = S(x, v)\n    return «s.c»", "S has no field 'c'; it has a, b"),
    ("s = S(x, v)\n    return «s[0]»", "S is read by field, not by index"),
    ("s = «S(x, v, x)»\n    return x", "S has 2 fields, got 3 values"),
    ("s = «S(x, v, a=x)»\n    return x", "S has no field 'a' left to set"),
    ("s = «S(x)»\n    return x", "S needs a value for field 'b'"),
    (
        "return («S(x, v) if x > 1.0 else x»).a",
        "both sides of a conditional must have one type, got S and float",
    ),
    ("return («[x] if x > 1.0 else [x]»)[0]", "cannot choose between values of type Array[float, 1]"),
    ("return «v if x > 1.0 else x»", "both sides of a conditional must have one type, got vec3 and float"),
    # assignments
    ("«d = c»\n    return x", "an Image cannot be given another name"),
    ("«a = b = x»\n    return x", "one assignment a line"),
    ("«a: Image = c»\n    return x", "a variable is a scalar, vector, matrix, array or struct"),
    ("«a: float»\n    return x", "a typed variable is written name: type = value"),
    ("«a, b = x»\n    return x", "cannot unpack float into 2 names"),
    ("«a, *b = x, x»\n    return x", "this cannot be assigned to"),
    ("t = (x, x)\n    «t[0] = x»\n    return x", "a kernel writes to its result, not to tuple"),
    ("«x = v»\n    return x", "'x' must be float, got vec3"),
    ("for i in range(3):\n        «i = 2»\n    return x", "'i' is a loop index and cannot be assigned to"),
    ("a = v\n    «a.xx = v.xy»\n    return x", ".xx names a component twice"),
    ("a = x\n    «a.y = x»\n    return x", "float has no attribute 'y'"),
    ("a = v\n    «a.x = S(x, v)»\n    return x", "cannot assign S to a part of a value"),
    ("s = S(x, v)\n    «s.c = x»\n    return x", "s.c cannot be assigned to"),
    ("«sin(v).x = x»\n    return x", "only variables can be assigned to"),
    ("«V.x = x»\n    return x", "'V' is not a variable of this kernel"),
    # statements
    ("return «a»\n    a = x", "'a' may not have a value here"),
    ("if x > 1.0:\n        a = x\n    return «a»", "'a' may not have a value here; give it one before the branch"),
    ("for i in range(2):\n        x = x + 1.0\n    else:\n        «x = 1.0»\n    return x", "no for ... else"),
    ("for «i, j» in range(2): x = x + 1.0\n    return x", "a for loop has one index"),
    ("for i in range(2):\n        for «i» in range(2): x = x + 1.0\n    return x", "is the index of a loop around"),
    ("a = x\n    for «a» in range(2): x = x + 1.0\n    return x", "'a' is float already"),
    ("for i in «v»: x = x + 1.0\n    return x", "a for loop runs over range(...)"),
    ("for i in «range()»: x = x + 1.0\n    return x", "range() takes 1 to 3 whole numbers"),
    ("for i in range(«x»): x = x + 1.0\n    return x", "a bound of range() must be int, got float"),
    ("«return»", "k must return float"),
    ("«break»\n    return x", "break and continue belong inside a for loop"),
    ("«discard(x)»\n    return x", "discard() takes no arguments"),
    ("«sin(x)»\n    return x", "this value is not used; a kernel has no side effects"),
    (
        "«while x > 1.0: x = x - 1.0»\n    return x",
        "no while; write a loop with a bound: for i in",
    ),
    (
        "«while x > " + " + ".join(["1.0"] * 20) + ": x = x - 1.0»\n    return x",
        "range(1000): and below it if not (...): break",
    ),
    ("«while x > 2.0: x = x - 1.0»\n    return x", "if not (x > 2.0): break"),
    ("«del x»\n    return 1.0", "the kernel language has no del"),
    ("match «x»:\n        case 0: x = 1.0\n    return x", "match takes an int, got float; write if and elif"),
    ("match n:\n        case «n»: x = 1.0\n    return x", "case n: gives a value a name, as in Python"),
    ("match n:\n        case 0 | «1.5»: x = 1.0\n    return x", "a case is a whole number, several with |"),
    ("match n:\n        case «True»: x = 1.0\n    return x", "a case is a whole number, several with |"),
    ("match n:\n        case «[0, 1]»: x = 1.0\n    return x", "a case is a whole number, several with |"),
    ("match n:\n        case «0 as m»: x = 1.0\n    return x", "case m: gives a value a name, as in Python"),
    ("match n:\n        case «9999999999»: x = 1.0\n    return x", "does not fit 32 bits"),
    ("match n:\n        case «_»: x = 1.0\n        case 1: x = 2.0\n    return x", "matches everything; put it last"),
    ("match «n»:\n" + "".join(f"        case {i}: x = {i}.0\n" for i in range(101)) + "    return x", "has 101 cases"),
    # found when the graph is compiled
    ("for i in «range(0, 9, 0)»: x = x + 1.0\n    return x", "the step of range() is 0"),
    ("for i in «range(100000)»: x = x + 1.0\n    return x", "this loop makes 100000 trips; at most 65536"),
    ("for i in range(300):\n        for j in «range(300)»: x = x + 1.0\n    return x", "trips inside loops of 300"),
    ("for i in «range(n)»: x = x + 1.0\n    return x", "this loop may make any number of iterations"),
    (
        "for i in «range(0, max(n, 0))»: x = x + 1.0\n    return x",
        "its stop has no upper limit, as min(stop, 64)",
    ),
    (
        "for i in «range(min(n, 9), 70)»: x = x + 1.0\n    return x",
        "its start has no lower limit, as max(start, 0)",
    ),
    ("for i in «range(n, n * 2)»: x = x + 1.0\n    return x", "max(start, 0) has and its stop has no upper limit"),
    ("for i in «range(64, n, -1)»: x = x + 1.0\n    return x", "its stop has no lower limit, as max(stop, 0)"),
    (
        "for i in «range(n, -64, -1)»: x = x + 1.0\n    return x",
        "its start has no upper limit, as min(start, 64)",
    ),
    ("for i in «range(clamp(n, 0, 70000))»: x = x + 1.0\n    return x", "may make 70000 trips; at most 65536"),
    ("for i in «range(-9, n, 99999)»: x = x + 1.0\n    return x", "may be more than 2147483647 apart; limit"),
    ("return «c[n, 0]».x", "a texel offset must be a constant or bounded by a loop"),
]
_DEEP = "1.0 + (" * 45 + "{}" + ")" * 45
#: Whole texts, the kernel last.
TEXTS: list[tuple[str, str]] = [
    ("def k(«c») -> float: return 1.0", "parameter 'c' needs a type, for example c: float"),
    ("«def k(c: Image): return 1.0»", "k needs a return type, for example -> vec4"),
    ("«def k(*c: Image) -> float: return 1.0»", "k takes *args or **kwargs"),
    ("def k(c: Image) -> «None»: return 1.0", "a kernel must return something"),
    ("def k(c: Image) -> «Image»: return c", "k cannot return an Image"),
    ("def k(c: Image) -> «Const[float]»: return 1.0", "k cannot return Const"),
    ("def k(c: Image) -> «tuple[Image, float]»: return c, 1.0", "a tuple cannot hold an Image"),
    ("def k(c: «sin») -> float: return 1.0", "sin is not a type of the kernel language; it has bool"),
    ("def k(c: «'1 +'») -> float: return 1.0", "annotation '1 +' is not a type"),
    ("def k(c: «int[3]») -> float: return 1.0", "only Const[T], Array[T, n] and tuple[...] take brackets"),
    ("def k(c: «Array[float]») -> float: return 1.0", "an array is written Array[element, length]"),
    ("def k(c: «Array[tuple[float, float], 3]») -> float: return 1.0", "an array cannot hold tuples"),
    (
        "def k(c: «Array[Array[float, 4096], 4097]») -> float: return 1.0",
        "has 16781312 elements, those of arrays in it counted",
    ),
    ("def k(c: «Array[Image, 1025]») -> float: return 1.0", "has 1025 elements, those of arrays in it counted"),
    ("«def k(c: Array[Image, 129]) -> float: return 1.0»", "k takes 129 images, those in structs and arrays too"),
    ("def k(c: Array[Image, 2]) -> «Array[Image, 2]»: return c", "k cannot return an Image"),
    (
        "class S:\n    a: Image\ndef f(s: S) -> float:\n    s.a = s.a\n    return 1.0\n"
        "def k(c: Image) -> float: return «f(S(c))»",
        "parameter 's' holds an Image and cannot be assigned to",
    ),
    (
        "def k(c: «Array[float, Literal[0]]») -> float: return 1.0",
        "array length must be a whole number from 1 to 16777216, got 0",
    ),
    (
        "def k(c: «Array[float, 0]») -> float: return 1.0",
        "array length must be a whole number from 1 to 16777216, got 0",
    ),
    ("def k(«c: Array[mat4, 16777216]») -> float: return 1.0", "takes 1024 MiB; an array may take 256 MiB"),
    (
        "def k(c: int) -> «Array[float, 1025]»: return c",
        "the result of k would hold Array[float, 1025]; arrays of more than 1024",
    ),
    (
        "def k(c: Array[float, 1025]) -> float:\n    «d = c»\n    return d[0]",
        "c has 1025 entries, which are read by index",
    ),
    (
        "def k(«c: Array[float, 1025]») -> float:\n    c[0] = 1.0\n    return c[0]",
        "c has 1025 entries, which are read by index",
    ),
    (
        "def f(a: Array[float, 1025]) -> float:\n    a[0] = 1.0\n    return a[0]\n"
        "def k(c: Array[float, 1025]) -> float: return «f(c)»",
        "c has 1025 entries, which are read by index",
    ),
    (
        "class S:\n    a: Array[float, 1025]\ndef k(c: S) -> float:\n    «d = c»\n    return d.a[0]",
        "c.a has 1025 entries, which are read by index",
    ),
    (
        "def k(c: Array[Array[float, 1025], 2], n: int) -> float:\n    «d = c[n]»\n    return d[0]",
        "a variable would hold Array[float, 1025]; arrays of more than 1024",
    ),
    ("def k(c: Array[float, 1025]) -> float: return «c[1025]»", "index 1025 is outside Array[float, 1025] (0 to 1024)"),
    (
        "def k(n: Annotated[int, Range(1, 64)] = «0») -> float: return 1.0",
        "default of n must be 1 to 64, got 0",
    ),
    (
        "def k(n: Annotated[vec3, Range(0, 1)] = «(0, 1, 2)») -> float: return 1.0",
        "default of n must be 0 to 1, got 2",
    ),
    (
        "def k(n: Annotated[int, «Range(64, 1)»]) -> float: return 1.0",
        "low must be below high, got 64 and 1",
    ),
    (
        "def k(«n: Annotated[int, Range(0.2, 0.8)]») -> float: return 1.0",
        "is int, of which no number is 0.2 to 0.8",
    ),
    (
        "def k(«n: Annotated[bool, Range(0, 1)]») -> float: return 1.0",
        "is bool; a range is of numbers",
    ),
    (
        "def k(«n: Annotated[Image, Range(0, 1)]») -> float: return 1.0",
        "is Image; a range is of numbers",
    ),
    (
        "def k(«n: Annotated[Array[float, 2000], Range(0, 1)]») -> float: return 1.0",
        "are not checked one by one",
    ),
    (
        "def k(n: Annotated[int, «int»]) -> float: return 1.0",
        "a pg.Range(low, high), and nothing else",
    ),
    (
        "def k(n: Annotated[int, Range(1, «n»)]) -> float: return 1.0",
        "a range takes literal numbers and text",
    ),
    (
        "def k(n: Annotated[int, Range(«*n»)]) -> float: return 1.0",
        "a range takes literal numbers and text",
    ),
    (
        "def k(n: Annotated[int, «Range(1, 2, low=3)»]) -> float: return 1.0",
        "pg.Range takes low, high, unit, above, odd, each once",
    ),
    (
        "def k(n: «Annotated[int]») -> float: return 1.0",
        "a range is written Annotated[type, pg.Range(low, high)]",
    ),
    (
        "def k(n: Array[«Annotated[int, Range(1, 2)]», 3]) -> float: return 1.0",
        "a range is of a kernel's parameter as a whole",
    ),
    (
        "def f(«n: Annotated[int, Range(1, 2)]») -> int: return n\ndef k(n: int) -> float: return float(f(n))",
        "f is no kernel; what its parameters may be is not looked at",
    ),
    ("def k(c: «1 + 2») -> float: return 1.0", "a name is expected here"),
    ("def k(«c: tuple[float, float]») -> float: return 1.0", "a parameter cannot be a tuple"),
    ("def k(«c: Const[mat2]») -> float: return 1.0", "Const parameters are scalars or vectors, got mat2"),
    ("def k(c: Image = «1») -> float: return 1.0", "of type Image cannot have a default"),
    ("def k(a: float = «abs») -> float: return 1.0", "a constant is expected here"),
    ("def k(a: float = «1 / 0») -> float: return 1.0", "division by zero in a constant"),
    ("def k(a: float = «float(1, 2)») -> float: return 1.0", "float takes one number"),
    ("def k(a: int = «int(1e999)») -> float: return 1.0", "int takes a number, got inf"),
    ("def k(a: uint = «uint(-1)») -> float: return 1.0", "a uint is a whole number from 0 to 4294967295, got -1"),
    ("def k(a: uvec2 = «(1, -1)») -> float: return 1.0", "default of a must be uint, from 0 to 4294967295, got -1"),
    ("def k(a: vec3 = «vec3(1, 2)») -> float: return 1.0", "vec3 takes 3 numbers, got 2"),
    ("def k(a: vec3 = «(1, 2)») -> float: return 1.0", "default of a must be vec3 (3 numbers), got (1, 2)"),
    ("def k(a: vec3 = «((1, 2), 3)») -> float: return 1.0", "default of a must be vec3 (3 numbers)"),
    ("def k(a: int = «1.5») -> float: return 1.0", "default of a must be int, got floats; convert them first"),
    ("def k(a: int = «'a'») -> float: return 1.0", "a str is not a number of the kernel language"),
    ("«class S:»\n    pass\ndef k(s: S) -> float: return 1.0", "struct S has no fields"),
    ("«class S(T):»\n    a: float\ndef k(s: S) -> float: return 1.0", "struct S has a base class"),
    ("class S:\n    «a = 1»\ndef k(s: S) -> float: return 1.0", "struct S holds typed fields only"),
    ("class S:\n    «a: tuple[float, float]»\ndef k(s: S) -> float: return 1.0", "a struct field cannot be tuple"),
    ("def k(c: Image, a: int, «a: float») -> float: return 1.0", "k has two parameters 'a'; rename one of them"),
    (
        "class S:\n"
        + "".join(f"    a{n}: float\n" for n in range(256))
        + "def k(\n"
        + "".join(f"    {'«' if n == 128 else ''}s{n}: S{'»' if n == 128 else ''},\n" for n in range(200))
        + ") -> float: return 1.0",
        "the parameters of k have 33024 fields or more, nested ones too; at most 32768",
    ),
    (
        "A = (" + "1.0, " * 1000 + ")\nB = (A, A, A, A, «A», A)\ndef k(c: Image) -> float: return 1.0",
        "with this, a constant has more than 4096 numbers, those of tables in it counted",
    ),
    ("class S:\n    a: int\n    «a: float»\ndef k(s: S) -> float: return 1.0", "struct S has two fields 'a'"),
    (
        "class S:\n" + "".join(f"    a{n}: float\n" for n in range(256)) + "«class T:»\n    a: S\n    b: S\n"
        "def k(s: T) -> float: return 1.0",
        "struct T has 512 fields, nested ones too; at most 256",
    ),
    (
        "class S0:\n    v: float\n"
        + "".join(f"{'«' if n == 31 else ''}class S{n + 1}:{'»' if n == 31 else ''}\n    a: S{n}\n" for n in range(40))
        + "def k(s: S40) -> float: return 1.0",
        "struct S32 holds structs 33 deep; at most 32",
    ),
    (
        "def k(c: Image) -> float:\n    x = c[0, 0].x\n"
        + "".join(f"    if {'«' if n == 100 else ''}x > {n}.0{'»' if n == 100 else ''}: return x\n" for n in range(200))
        + "    return x",
        "branches and loops nest deeper than 100, functions inlined",
    ),
    ("«import os»\ndef k(c: Image) -> float: return 1.0", "kernel text cannot import os"),
    ("«from os import path»\ndef k(c: Image) -> float: return 1.0", "kernel text cannot import os"),
    ("«print(1)»\ndef k(c: Image) -> float: return 1.0", "kernel text holds functions, structs and named numbers only"),
    ("import passgraph as pg\ndef k(c: Image) -> float: return «pg.os»", "module passgraph has no 'os'"),
    ("import passgraph as pg\ndef k(c: Image) -> float: return «pg.__dict__»", "is a dict, which kernels cannot use"),
    ("W = ((1, 2), (3,))\ndef k(c: Image) -> float: return «W»[0]", "W must hold numbers of one type"),
    (
        "W = (" + "(1, 2, 3, 4, 5), " * 205 + ")\ndef k(c: Image) -> float: return float(«W»[0][0])",
        "W has 1025 entries; kernels capture at most",
    ),
    (
        "W = (" + "1, " * 1025 + ")\ndef k(c: Image) -> float: return «W»[0]",
        "W has 1025 entries; kernels capture at most",
    ),
    ("«def k(c: Image) -> float:»\n    if c[0, 0].x > 1.0: return 1.0", "k may end without returning float"),
    ("«def k(c: Image) -> int: return 1»", "the result of k must be float or a float vector, as targets hold; got int"),
    ("«def k(c: Image) -> tuple[float, int]: return 1.0, 1»", "result 1 of k must be float or a float vector"),
    ("def k(c: Image) -> vec4:\n    «return 1.0»", "the result of k must be vec4, got float"),
    ("def k(c: Image) -> tuple[float, float]:\n    «return 1.0»", "must be tuple[float, float], got float"),
    (
        "def f(c: Image) -> float:\n    c = 1.0\n    return c\ndef k(c: Image) -> float: return «f(c)»",
        "parameter 'c' is an Image and cannot be assigned to",
    ),
    ("def f(a: float) -> float: return «f(a)»\ndef k(c: Image) -> float: return f(1.0)", "f calls itself"),
    (
        "def f0(a: float) -> float: return a\n"
        + "".join(
            f"def f{n + 1}(a: float) -> float: return {'«' if n == 9 else ''}f{n}(a){'»' if n == 9 else ''}\n"
            for n in range(40)
        )
        + "def k(c: Image) -> float: return f40(1.0)",
        "calls nest deeper than 32",
    ),
    (
        "def f0(a: float) -> float: return a\n"
        + "".join(f"def f{n + 1}(a: float) -> float: return {_DEEP.format(f'f{n}(a)')}\n" for n in range(30))
        + "«def k(c: Image) -> float: return f30(1.0)»",
        "k nests too deeply (calls, branches and expressions together)",
    ),
    (
        "def k(«v: Vertex») -> float: return 1.0",
        "a pixel kernel has no vertex; only @pg.vertex kernels take one",
    ),
    (
        "def k(«n: Const[int]») -> float:\n    x = 1.0\n    for i in range(n): x = x + 1.0\n    return x",
        "Const parameter 'n' of k has no value",
    ),
    ("def k(c: Image) -> float: return 1.0 +«»", "this is not Python"),
    (
        "def k(c: Image) -> float: return " + "«1.0»" + " + 1.0" * 300,
        "this nests deeper than 200; give parts of it names",
    ),
]

DISCARDS = "def f(a: float) -> float:\n    if a > 0.5: discard()\n    return a\n"
VARYING = "class P:\n    position: vec4\n    normal: vec3\n\n"
#: Stage, whole text, words.
STAGES: list[tuple[Callable[..., Any], str, str]] = [
    (
        vertex,
        "«def k(v: Vertex) -> vec4: return vec4(1.0)»",
        "a vertex kernel returns a @pg.struct whose field position",
    ),
    (
        vertex,
        "class P:\n    position: vec4\n    i: int\n\n«def k(v: Vertex) -> P: return P(vec4(1.0), 1)»",
        "varyings are floats and float vectors; i of P is not",
    ),
    (
        vertex,
        VARYING + "def k(v: Vertex, c: Image) -> P: return P(«c[0, 0]», v.normal)",
        "in a vertex kernel use .texel()",
    ),
    (
        fragment,
        VARYING + "def k(p: P, «q: P») -> vec4: return p.position",
        "the varyings are a fragment kernel's first parameter",
    ),
    (fragment, VARYING + "def k(p: P, c: Image) -> vec4: return «c[0, 0]»", "in a fragment kernel use .texel()"),
    (
        fragment,
        VARYING + DISCARDS + "def k(p: P) -> float: return «1.0 if p.normal.x > 0.0 else f(1.0)»",
        "a function that calls discard() is called where Python may leave it out",
    ),
    (
        vertex,
        VARYING + "def k(v: Vertex, c: Image) -> P: return P(vec4(«c.lod(v.uv)»), v.normal)",
        "image.lod() takes derivatives, which a vertex kernel has not",
    ),
    (
        vertex,
        VARYING + "def k(v: Vertex) -> P: return P(vec4(«dfdx(v.uv.x)»), v.normal)",
        "dfdx() exists in pixel and fragment kernels, not in a vertex kernel: a vertex has no neighboring pixels",
    ),
    (
        vertex,
        VARYING + "def k(v: Vertex) -> P:\n    «discard()»\n    return P(vec4(1.0), v.normal)",
        "not in a vertex kernel",
    ),
]
