// Cases of tests/shaders/test_glsl_meaning.py: a title behind ////, functions, and behind // main what it does to vec4 o,
// with vec2 p = gl_FragCoord.xy and int n = int(p.x).

//// fragment coordinates count from the bottom left
// main
o = vec4(gl_FragCoord.xy, gl_FragCoord.zw);

//// post-increment gives the value before
// main
int a = n;
int b = a++ * 10 + 1;
int c = a--;
o = vec4(a, b, c, a);

//// pre-decrement gives the value after
// main
int a = n;
int b = --a * 10 + a;
o = vec4(a, b, 0, 0);

//// out parameters are written at the end
void f(out float a, inout float b) {
    a = 5.0;
    b += a;
}
// main
float x = p.x, y = p.y;
f(x, y);
o = vec4(x, y, 0, 0);

//// inout parameters copy in and out
float g(inout float a, float b) {
    a = b + 1.0;
    return a + b;
}
// main
float x = p.x;
float y = g(x, x);
o = vec4(x, y, 0, 0);

//// a swizzle can be an out parameter
void f(inout vec2 a) {
    a = a.yx + 1.0;
}
// main
vec4 v = vec4(p, 7, 9);
f(v.wx);
o = v;

//// overloads by exact type
float f(float x) {
    return 1.0;
}
float f(vec2 x) {
    return 2.0;
}
float f(int x) {
    return 3.0;
}
// main
o = vec4(f(p.x), f(p), f(n), f(1));

//// overloads by conversion
float f(vec2 x) {
    return 2.0;
}
float f(float x) {
    return x;
}
// main
o = vec4(f(3), f(ivec2(1)), 0, 0);

//// a right side that is not needed is not computed
int count = 0;
bool tick() {
    count++;
    return true;
}
// main
bool a = p.x < 2.0 && tick();
bool b = p.y > 1.0 || tick();
o = vec4(count, a, b, 0);

//// one side of a choice is computed
int count = 0;
float tick(int i) {
    count += i;
    return float(i);
}
// main
float a = p.x < 2.0 ? tick(1) : tick(10);
o = vec4(count, a, 0, 0);

//// exclusive or
// main
o = vec4((p.x < 2.0) ^^ (p.y < 2.0), 0, 0, 0);

//// commas
// main
float a;
float b = (a = p.x, a * 2.0);
o = vec4(a, b, 0, 0);

//// an assignment has a value
// main
float a, b;
a = b = p.x;
o.xy = vec2(a, b);
o.z = (a += 2.0) * 2.0;
o.w = a;

//// ints divide toward zero
// main
int a = n - 2;
o = vec4(a / 2, a * 7 / -3, -7 / 2, 7 / -2);

//// swizzles are assigned
// main
vec4 v = vec4(1, 2, 3, 4);
v.zx = p;
v.w *= 2.0;
v.xy += v.yx;
o = v;

//// elements are assigned
// main
vec4 v = vec4(0);
v[n % 4] = 5.0;
mat2 m = mat2(1);
m[1][0] = p.x;
m[0] += p;
o = v + vec4(m[0], m[1]);

//// an index is computed once
// main
int i = 0;
float a[3] = float[3](1.0, 2.0, 3.0);
a[i++] += 5.0;
o = vec4(a[0], a[1], a[2], i);

//// arrays are values
float[2] twice(float a[2]) {
    a[0] *= 2.0;
    return a;
}
// main
float a[2] = float[](p.x, p.y);
float b[2] = twice(a);
o = vec4(a[0], b[0], b.length(), a == b);

//// structs
struct S {
    vec2 a;
    float b[2];
}
;
struct T {
    S s;
    int i;
}
;
T make(vec2 v) {
    return T(S(v, float[](1., 2.)), 3);
}
// main
T t = make(p);
t.s.a.y += 10.0;
t.s.b[1] = 7.0;
T u = t;
u.i++;
o = vec4(t.s.a, u.s.b[1], t == u ? 1. : u.i);

//// globals keep what functions write
float state = 2.0;
void grow() {
    state *= 2.0;
}
const float K = 3.0 * 2.0;
// main
grow();
grow();
o = vec4(state, K, 0, 0);

//// a local name hides a global one
float a = 1.0;
float f() {
    return a;
}
// main
float a = 2.0;
{
    float a = 3.0;
    o.x = a;
}
o.yz = vec2(a, f());

//// loops with continue, break and a counter that is read after
// main
int i;
float s = 0.0;
for (i = 0; i < 10; i++) {
    if (i == 2) continue;
    if (i > n + 3) break;
    s += float(i);
}
o = vec4(s, i, 0, 0);

//// loops count floats
// main
float s = 0.;
for (float t = -1.0; t <= 1.0; t += 0.25) s += t * t + p.x;
o = vec4(s);

//// loops change their own counter
// main
int s = 0;
for (int i = 0; i < 9; ++i) {
    s += i;
    i += n % 2;
}
o = vec4(s);

//// while
// main
float a = p.x;
int k = 0;
while (a < 20.0) {
    a *= 2.0;
    k++;
}
o = vec4(a, k, 0, 0);

//// do while goes on to its condition
// main
int k = 0, s = 0;
do {
    k++;
    if (k == 2) continue;
    s += k;
}
while (k < n + 2);
o = vec4(k, s, 0, 0);

//// returns from loops within loops
float f(int n) {
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            if (i * j > n) return float(i * 10 + j);
        }
        if (i == 3) return -1.0;
    }
    return -2.0;
}
// main
o = vec4(f(n), f(100), f(4), f(0));

//// early returns of void functions
void f(inout float a) {
    if (a > 2.0) return;
    a += 10.0;
    if (a > 11.0) {
        a += 100.0;
        return;
    }
    a = -a;
}
// main
float a = p.x, b = p.y;
f(a);
f(b);
o = vec4(a, b, 0, 0);

//// switches fall through
// main
float a = 0.0;
switch (n) {
    case 0: a += 1.0;
    case 1: a += 10.0;
    break;
    default: a += 100.0;
    case 3: a += 1000.0;
}
o = vec4(a);

//// continue within a switch
// main
int s = 0;
for (int i = 0; i < 5; i++) {
    switch (i) {
        case 1: continue;
        case 3: s += 100;
        break;
        default: s += 1;
    }
    s += 10;
}
o = vec4(s);

//// return within a switch within a loop
float f(int n) {
    for (int i = 0; i < 5; i++) {
        switch (i + n) {
            case 4: return float(i);
            case 6: break;
        }
    }
    return 9.;
}
// main
o = vec4(f(n), f(n + 4), 0, 0);

//// constructors convert and trim
// main
vec4 v = vec4(p, 3, 4);
o = vec4(vec2(v), int(p.x + 0.9), float(bool(n)) + ivec2(v.zw).y) + vec4(vec3(v), 1).xyzw;

//// matrices of columns
// main
mat3 m = mat3(1, 2, 3, 4, 5, 6, 7, 8, 10);
vec3 v = vec3(p, 1);
mat2 k = mat2(m);
o = vec4((m * v).x, (v * m).y, (k * k)[1][0], determinant(m)) + inverse(m)[1][2] + transpose(m)[0][2];

//// matrices by component
// main
mat2 m = mat2(1, 2, 3, 4), k = matrixCompMult(m, m);
m += 1.0;
m /= 2.0;
k = -k;
o = vec4(m[0], k[1]) + (m == k ? 1. : 0.);

//// vectors are compared whole
// main
ivec2 a = ivec2(n, 1);
o = vec4(a == ivec2(1), a != ivec2(1), bvec2(true) == bvec2(1, n), 0);

//// vectors are compared by component
// main
vec2 h = vec2(2.0);
o = vec4(vec2(lessThan(p, h)), 0, 0) * 2. + vec4(0, 0, vec2(notEqual(bvec2(n, 1), bvec2(1)))) + vec4(any(equal(p, h - .5)), vec2(not(bvec2(n))), 1);

//// built-in functions
// main
vec3 v = vec3(p, 2.5) - 2.0;
o = vec4(length(v), dot(v, v.zyx), mod(v.x, 0.7), fract(-v.y)) + vec4(normalize(v), sign(v.x)) + vec4(cross(v, vec3(1, 2, 3)), smoothstep(0., 3., p.x)) + vec4(mix(v, v.yxz, 0.3), step(v.x, 0.)) + clamp(p.xyxy, 1., 2.);

//// functions of scalars
// main
o = vec4(length(-p.x), distance(p.x, 3.0), dot(p.x, 2.0), normalize(-p.y));

//// mix by bools
// main
o = mix(vec4(1), vec4(2, 3, 4, 5), bvec4(n, 1, 0, n));

//// modf
// main
float w;
float f = modf(p.x * 1.7, w);
vec2 k;
o = vec4(f, w, modf(p * 0.3, k)) + vec4(0, 0, k);

//// ints become floats
// main
float a = n;
vec2 v = ivec2(n, 2);
o = vec4(a + 1, v * 2, max(1, p.x));

//// macros
#define TWICE(x) ((x) * 2.0)
#define JOIN(a, b) a ## b
#define NAME JOIN(va, lue)
#define MANY(a) a, a
// main
float value = TWICE(p.x + 1.0);
o = vec4(NAME, TWICE(TWICE(1.0)), MANY(p.y));

//// conditions
#define A 3
#if defined(A) && A > 2
#define B 1.0
#elif 1
#define B 2.0
#else
#error no
#endif
#ifndef B
#error B
#endif
// main
o = vec4(B
#if A == 4
 + nonsense
#endif
, 0, 0, 0);

//// hexadecimal and octal
// main
o = vec4(0x1F, 017, 0xFFFFFFFF, 1e2);

//// shifts and bits
// main
o = vec4(n << 2, -8 >> 1, (n | 4) & 6, ~n ^ 5);

//// words that became qualifiers later are names
float patch(vec2 shared) {
    return shared.x;
}
// main
vec2 sample = p;
sample.x += 1.0;
float precise = patch(sample), buffer;
buffer = precise * 2.0;
o = vec4(sample, buffer, 0);

//// conditions that count
// main
int i = 0, s = 0;
while (i++ < 4)
    s += i * 10;
int j = 3;
do {
    s += j;
} while (--j > 0);
int k = 5;
for (; k-- > n; )
    s += 100;
o = vec4(s, i, j, k);

//// loops of two counters
// main
float s = 0.0;
for (int i = 0, j = 10; i < j; i++, j -= 2)
    s += float(i * j);
o = vec4(s);

//// loops of data within one another
// main
int s = 0;
for (int i = 0; i <= n + 20; i++)
    for (int j = i; j >= 0; j -= n + 1)
        s += j;
o = vec4(s);

//// uints wrap, shift in zeros and mix with written numbers
uint f(uint a) {
    return a * 2654435761u;
}
// main
uint a = uint(n) - 2u, b = 7u;
uvec3 v = uvec3(n, 1, 2) * 3u;
b += a >> 28;
b++;
v.yz ^= uvec2(5u);
o = vec4(float(a / 65536u), b % 5u, f(v.x) >> 16u, v.y + v.z) + float(a > 5u) + vec4(ivec3(v) - 4, int(a));

//// uints are taken where ints are written, and by switches
uint g(uint x) {
    switch (x & 3u) {
        case 0u:
            return 10u;
        case 1u:
            x += 5u;
        default:
            x += 0xFFFFFFFFu;
    }
    return x;
}
// main
uint m = max(uint(n), 2u);
o = vec4(g(uint(n)), g(m), m == 2u, clamp(uint(n), 1u, 2u));

//// hashes of ints are the same everywhere
uvec3 pcg(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    return v;
}
// main
o = vec4(vec3(pcg(uvec3(p, 7)) >> 8u) / 16777216.0, floatBitsToInt(p.x) >> 20);

//// bits and packs, 4.30
// main
int i = n * 77 - 100;
uint u = uint(i);
o = vec4(bitCount(i), findMSB(i), findLSB(i), findMSB(u));
o += vec4(bitfieldExtract(i, 2, 5), bitfieldExtract(u, 2, 5), bitfieldInsert(i, 5, 3, 4), bitfieldReverse(n) >> 24);
o += vec4(packUnorm4x8(p.xyxy / 5.0) >> 8, packHalf2x16(p) >> 8, 0, 0) + unpackUnorm4x8(u) + unpackSnorm2x16(u).xyxy;
int e;
float m = frexp(p.x * 3.0, e);
uint c;
uint s = uaddCarry(u, 0xFFFFFFF0u, c);
o += vec4(m, e, c, ldexp(p.y, n)) + vec4(uintBitsToFloat(floatBitsToUint(p.x)), fma(p.x, 2.0, 1.0), 0, 0);

//// ints become uints, 4.30
uint twice(uint x) {
    return x + x;
}
// main
uint a = n;
o = vec4(twice(n), a + n, n > 2 ? a : 5, max(a, n));

//// counters that are read behind their loops
// main
int i, s = 0;
for (i = 0; i < 4; i++)
    s += i;
float t;
for (t = 1.0; t < 50.0; t *= 3.0)
    s++;
o = vec4(i, s, t, 0);

//// macros that name themselves or one another
#define a (a + 1.0)
#define b c + 10.0
#define c b * 2.0
// main
float aa = p.x;
#undef a
float a = aa;
#define a (a + 1.0)
#undef b
float bb = a;
o = vec4(a, bb, 0, 0);

//// constants are rounded as variables are
const float third = 1.0 / 3.0;
const bool same = 0.1 + 0.2 == 0.3;
// main
o = vec4(third, same, 0, 0);

//// constructors leave out what the last argument has too many
// main
vec4 v = vec4(p, 3, 4);
o = vec4(vec3(1, v.yzw).xyz, vec2(v.x, v).y);

//// an exact overload goes before a conversion wherever it stands
int f(int x) {
    return 1;
}
int f(float x) {
    return 2;
}
int g(float x) {
    return 3;
}
int g(vec2 x) {
    return 4;
}
// main
o = vec4(f(n), f(p.x), g(n), g(ivec2(n)));

//// matrices that are not square, 4.30
// main
mat2x3 m = mat2x3(1, 2, 3, 4, 5, 6);
mat3x2 k = transpose(m);
m[1].z = p.x;
o = vec4(m * p, (k * vec3(p, 1)).y) + vec4(outerProduct(p, vec3(1, 2, 3))[2], (m * k)[2][1], m.length());

//// arrays of structs
struct Light {
    vec2 at;
    float power[2];
};
float sum(Light lights[3]) {
    float s = 0.0;
    for (int i = 0; i < lights.length(); i++)
        s += lights[i].at.y * lights[i].power[1];
    return s;
}
// main
Light lights[3];
for (int i = 0; i < 3; i++) {
    lights[i].at = p + float(i);
    lights[i].power = float[2](1.0, float(i));
}
lights[n % 3].at.y *= 10.0;
lights[1].power[n % 2] += 5.0;
Light one = lights[2];
lights[0] = one;
o = vec4(sum(lights), one.at, lights[0] == one);

//// arrays of arrays, 4.30
// main
float a[2][3] = float[2][3](float[3](1.0, 2.0, 3.0), float[3](4.0, 5.0, p.x));
a[n % 2][1] += 10.0;
float b[3] = a[1];
a[0] = b;
o = vec4(a[0][1], b[2], a[1][n % 3], a.length() + a[0].length());

//// a condition keeps an argument from being an index that is outside
ivec3 whole(vec3 c) { return ivec3(c); }
float chosen(vec3 c, int k) { ivec3 d = whole(c); return float(k == 3 ? 40 : d[k]); }
float linked(vec3 c, int k) { bool far = k > 2 || c[k] > 2.5; return k < 3 && c[k] > 1.5 || far ? 1.0 : 0.0; }
float either(vec3 c, int k) { if (c.x > 3.0 || k == 3) return c.y; return c[k]; }
float switched(vec3 c, int k) {
    switch (k) {
        case 3: return 7.0;
        default: return c[k];
    }
}
float named(vec3 c, int k) { bool inside = k >= 0 && k < 3; return inside ? c[k] + c[2 - k] : c.z; }
// main
vec3 c = vec3(p, 0.25);
o.x = chosen(c, 3) + 100.0 * chosen(c, 1);
o.y = linked(c, 3) + 2.0 * linked(c, 1) + 4.0 * linked(c, 0);
o.z = either(c, 3) + 10.0 * switched(c, 3) + 100.0 * switched(c, 2);
o.w = named(c, 3) + named(c, -1) + 10.0 * named(c, 0);

//// a condition keeps an argument from being written outside
struct Both { vec3 v; float a[3]; mat2 m; };
Both put(Both b, int k, float x) {
    bool inside = k >= 0 && k < 3;
    if (inside) {
        b.v[k] = x;
        b.v.zyx[0] += 1.0;
        b.a[k] += x;
    }
    if (inside && k < 2) b.m[k][1 - k] = x;
    return b;
}
// main
Both b = Both(vec3(p, 1), float[3](p.y, 2.0, p.x), mat2(p, 3, 4));
b = put(put(put(put(b, 3, 5.0), -1, 6.0), 1, 7.0), 2, p.x);
o = vec4(b.v + vec3(b.a[0], b.a[1], b.a[2]) * 100.0, b.m[0][1] + 10.0 * b.m[1][0]);

//// loops count by components of a vector
// main
vec3 r;
vec4 s = vec4(0);
for (r.z = 0.0; r.z < 2.0; r.z++)
    for (r.x = -3.0; r.x <= 3.0; r.x++)
        for (r.y = -3.0; r.y <= 3.0; r.y += 1.5)
            for (s.z = 2.0; s.z > 0.0; --s.z)
                s.xyw += vec3(r.x * p.x, r.y * r.y, r.z);
o = s + vec4(0, 0, r.x, r.y);

//// loops have bounds that counters around them make
#define SKIP(z, c) ((z.c += 1.0), (z.c += float(z == vec3(0))))
// main
vec3 r = vec3(0), q;
for (r.x = -3.0; r.x <= 3.0; r.x++)
    for (r.y = -abs(abs(r.x) - 3.0); r.y <= abs(abs(r.x) - 3.0); SKIP(r, y))
        for (q.y = -2.0; q.y <= 0.0; q.y++)
            for (q.x = -abs(abs(q.y) - 2.0); q.x <= abs(abs(q.y) - 2.0) * float(q.y != 0.0); q.x++)
                o += vec4(1.0, r.y * p.x, r.x * q.x, q.y);

//// loops have bounds of ints that counters around them make
// main
for (int i = 0; i < 7; i++)
    for (int j = i; j >= 0 && j > i - n; j -= 2)
        for (int k = max(i, j) - 3; k < min(i + j, 5); k++)
            o += vec4(1, i, j, k);

//// counters that bodies, conditions and steps of other parts change
struct Counters {
    int x, r;
};
// main
ivec2 c;
for (c.x = 0; c.x < 6; c.x++) {
    o.x += 1.0;
    if (c.x == n) c.rg += ivec2(2, 1);
}
for (int i = 0; i-- < 5 && o.y < 9.0; i += 2) o.y++;
for (int i = 0, j = 9; i < j; i++, j--) o.z++;
Counters b = Counters(0, 0);
for (b.x = 0; b.x < 4; b.x++) {
    b.r++;
    o.w += float(b.r);
}

//// swizzles and entries are out parameters, whose indices are computed once
int count = 0;
int next() {
    return count++;
}
void f(out vec2 a, inout float b) {
    a = vec2(b, 2.0 * b);
    b += 1.0;
}
void grow(inout float a) {
    a += 10.0;
}
// main
vec4 v = vec4(1, 2, 3, 4);
f(v.zx, v.w);
float a[4] = float[4](1.0, 2.0, 3.0, 4.0);
grow(a[next()]);
a[next()] *= 5.0;
--a[next() + n % 2];
o = v + vec4(a[0], a[1] + float(count), a[2], a[3]);

//// arrays of arrays are read and written 4.30
// main
float a[2][3];
for (int i = 0; i < 2; i++)
    for (int j = 0; j < 3; j++)
        a[i][j] = float(i * 3 + j) * p.x;
float b[3] = a[1];
a[n % 2][n % 3] += 5.0;
vec2 c[2][2] = vec2[2][2](vec2[2](p, p.yx), vec2[2](p * 2.0, p * 3.0));
c[n % 2][1].y = 7.0;
o = vec4(a[0][1], b[1] + c[1][1].y, c[0][1].x, float(a.length() * 10 + a[0].length()));

//// a switch in a loop continues and falls through
// main
for (int i = 0; i < 10; i++) {
    if (i == n)
        continue;
    switch (i) {
        case 3:
            continue;
        default:
            o.z += 1.0;
        case 5:
            break;
        case 7:
            o.y += 1.0;
    }
    if (i > 7)
        break;
    o.x += float(i);
}

//// ints wrap, and shifts and quotients of negative ones
// main
int a = 2147483647;
a += n;
int b = -5 - n;
uint u = 4294967295u + uint(n);
o = vec4(a >> 16, (b >> 1) + (b << 2), b / 2 + 7 / b, float(u / 7u) + float((uint(n) - 5u) >> 20));
