"""Scalar functions of the kernel language, written in the kernel language.

The text of this file is parsed like kernels and never runs as Python.  Each function uses primitives only, so every
backend computes the same polynomial, and loops over pixels vectorize (unlike with calls of a C library).  Reductions
and coefficients follow the single-precision Cephes library (S. L. Moshier, 1984-2000, netlib.org/cephes) unless a
comment says otherwise.
"""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from passgraph.language.primitives import bits_from_float, float_from_bits, floor, sqrt


def sign(x: float) -> float:
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


def sign_int(x: int) -> int:
    return 1 if x > 0 else (-1 if x < 0 else 0)


def clamp(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


def clamp_int(x: int, low: int, high: int) -> int:
    return min(max(x, low), high)


def saturate(x: float) -> float:
    return min(max(x, 0.0), 1.0)


def fract(x: float) -> float:
    # For a tiny negative x the subtraction rounds up to 1; the cap is the largest float32 below 1.
    return min(x - floor(x), 0.999999940395355224609375)


def mod(x: float, y: float) -> float:
    """x - y * floor(x / y), on magnitudes first: their remainder is exact for quotients below 2**20, as its products
    are."""
    size = abs(y)
    magnitude = abs(x)
    # A quotient too small to be normal may come out below 0, and max() of it and 0 may be either.
    q = floor(abs(magnitude / size))
    q_high = upper_bits(q)
    q_low = q - q_high
    high = upper_bits(size)
    low = size - high
    rest = (((magnitude - q_high * high) - q_low * high) - q_high * low) - q_low * low
    # The quotient may have been rounded to the next integer, or away from one.
    raised = rest + size if rest < 0.0 else rest
    lowered = raised - size if raised >= size else raised
    # Larger quotients leave any remainder, and for a tiny one the difference is y itself, which no result may reach.
    below = float_from_bits(bits_from_float(size) - 1)
    inside = min(max(lowered, 0.0), below)
    other_sign = (x < 0.0) != (y < 0.0) and inside != 0.0
    result = min(size - inside, below) if other_sign else inside
    return -result if y < 0.0 else result


def fma(a: float, b: float, c: float) -> float:
    return a * b + c


def isfinite(x: float) -> bool:
    return abs(x) <= 3.4028234663852886e38


def float_floor_divide(a: float, b: float) -> float:
    return floor(a / b)


def inversesqrt(x: float) -> float:
    return 1.0 / sqrt(x)


def step(edge: float, x: float) -> float:
    return 0.0 if x < edge else 1.0


def smoothstep(low: float, high: float, x: float) -> float:
    # Halved, so that edges at both ends of float32 have a finite difference.
    start = 0.5 * low
    width = 0.5 * high - start
    inside = (0.5 * x - start) / (1.0 if width == 0.0 else width)
    t = min(max((0.0 if x < low else 1.0) if width == 0.0 else inside, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


def mix(x: float, y: float, a: float) -> float:
    return x * (1.0 - a) + y * a


def radians(x: float) -> float:
    return x * 0.017453292519943295


def degrees(x: float) -> float:
    return x * 57.29577951308232


def scale_by_power(m: float, n: int) -> float:
    """m * 2**n in two steps, so that results below 2**-126 and above 2**127 are correct."""
    half = n >> 1
    return m * float_from_bits((half + 127) << 23) * float_from_bits((n - half + 127) << 23)


def ldexp(x: float, n: int) -> float:
    # Beyond, every number becomes 0 or infinite.  Three steps, none of which alone leaves the range of exponents.
    exponent = min(max(n, -300), 300)
    third = exponent // 3
    step = float_from_bits((third + 127) << 23)
    return x * step * step * float_from_bits((exponent - 2 * third + 127) << 23)


def exp2(x: float) -> float:
    # Below -150 the result is 0, without a product that underflows: CPUs take a hundred times as long for one.
    is_zero = x < -150.0
    # Above 160 it is infinity anyway; the clamp keeps the exponent's bits in range.
    y = min(0.0 if is_zero else x, 160.0)
    exponent = round(y)
    f = y - exponent
    p = 1.535336188319500e-4
    p = p * f + 1.339887440266574e-3
    p = p * f + 9.618437357674640e-3
    p = p * f + 5.550332471162809e-2
    p = p * f + 2.402264791363012e-1
    p = p * f + 6.931472028550421e-1
    result = scale_by_power(p * f + 1.0, int(exponent))
    return x if x != x else (0.0 if is_zero else result)


def exp(x: float) -> float:
    # As in exp2; exp(-104) is below half of the smallest number.
    is_zero = x < -104.0
    y = min(0.0 if is_zero else x, 110.0)
    exponent = round(y * 1.44269504088896341)
    # ln 2 in two parts, the first with few bits, so that the product is exact (Cody and Waite).
    f = (y - exponent * 0.693359375) - exponent * -2.12194440e-4
    p = 1.9875691500e-4
    p = p * f + 1.3981999507e-3
    p = p * f + 8.3334519073e-3
    p = p * f + 4.1665795894e-2
    p = p * f + 1.6666665459e-1
    p = p * f + 5.0000001201e-1
    result = scale_by_power(p * f * f + f + 1.0, int(exponent))
    return x if x != x else (0.0 if is_zero else result)


def log_exponent(x: float) -> float:
    """Return the exponent e of x = m * 2**e with m in [2/3, 4/3)."""
    tiny = x < 1.17549435e-38
    bits = bits_from_float(x * 8388608.0 if tiny else x)
    # Subtracting the bits of 2/3 moves the boundary between exponents there.
    e = (bits - 0x3F2AAAAB) >> 23
    return float(e) - (23.0 if tiny else 0.0)


def log_mantissa(x: float) -> float:
    tiny = x < 1.17549435e-38
    bits = bits_from_float(x * 8388608.0 if tiny else x)
    e = (bits - 0x3F2AAAAB) >> 23
    return float_from_bits(bits - (e << 23))


def log_quartic(f: float) -> float:
    """log(1 + f) - f + f**2 / 2 - f**3 / 3 for f in [-1/3, 1/3]."""
    # Fitted for the least error relative to the logarithm: 2**-30.
    p = 0.1195845902
    p = p * f - 0.1283010989
    p = p * f + 0.1076955572
    p = p * f - 0.1219941825
    p = p * f + 0.1430271715
    p = p * f - 0.166792959
    p = p * f + 0.1999968141
    p = p * f - 0.2499982715
    square = f * f
    return p * square * square


def log_tail(f: float) -> float:
    """log(1 + f) - f for f in [-1/3, 1/3]."""
    return log_quartic(f) + f * f * (f * 0.3333333433 - 0.5)


def log_special(x: float, result: float) -> float:
    infinity = float_from_bits(0x7F800000)
    positive = infinity if x == infinity else result
    return positive if x > 0.0 else (-infinity if x == 0.0 else float_from_bits(0x7FC00000))


def log(x: float) -> float:
    e = log_exponent(x)
    f = log_mantissa(x) - 1.0
    result = (log_tail(f) + e * -2.12194440e-4) + f + e * 0.693359375
    return log_special(x, result)


def log2(x: float) -> float:
    e = log_exponent(x)
    f = log_mantissa(x) - 1.0
    tail = log_tail(f)
    # log2(e) = 1 + 0.44269...: adding the 1 separately keeps the low bits.
    result = tail * 0.44269504088896341 + f * 0.44269504088896341 + tail + f + e
    return log_special(x, result)


def log10(x: float) -> float:
    return log(x) * 0.43429448190325183


def upper_bits(x: float) -> float:
    """Return the 12 leading bits of x: products of two such numbers are exact."""
    return float_from_bits(bits_from_float(x) & -4096)


def pow(x: float, y: float) -> float:
    """Return 2**(y * log2 |x|), with the logarithm and the product in two floats each (T. J. Dekker, 1971).

    A negative x has powers for integer y, negative ones for odd y.  For a known y that is no integer, this code folds
    away.
    """
    whole_exponent = floor(y) == y
    half_exponent = y * 0.5
    odd_exponent = whole_exponent and floor(half_exponent) != half_exponent
    size = abs(x) if whole_exponent else x
    # For 0, whose power is chosen below, no product underflows (see exp2).
    base = size if size > 0.0 else 1.0
    e = log_exponent(base)
    f = log_mantissa(base) - 1.0
    # log(1 + f) as high + low.  The square's leading part is exact, so little is lost.
    f_high = upper_bits(f)
    f_low = f - f_high
    square = f_high * f_high
    rest_of_square = (f_high + 0.5 * f_low) * f_low
    cubic = square * f * 0.3333333433 + f * rest_of_square * 0.6666666667
    small = (cubic + log_quartic(f)) - rest_of_square
    high = upper_bits(f - 0.5 * square + small)
    low = ((f - high) - 0.5 * square) + small
    # Times log2(e), itself in two parts, and split again.
    exact = high * 1.4423828125
    rest = high * 0.00031222839606925845 + low * 1.44269504088896341
    log_high = upper_bits(exact + rest)
    log_low = (exact - log_high) + rest
    # Beyond 2**33 any base but 1 overflows or underflows; the clamp keeps products finite.
    z = min(max(y, -8589934592.0), 8589934592.0)
    z_high = upper_bits(z)
    z_low = z - z_high
    # z * (e + log_high + log_low), with the integer part removed from each exact product before they are added.
    a = z_high * e
    b = z_high * log_high
    c = (a - round(a)) + (b - round(b)) + (z_low * e + (z_low * log_high + z * log_low))
    exponent = min(max(round(a) + round(b) + round(c), -300.0), 300.0)
    in_range = exp2_kernel(c - round(c), int(exponent))
    infinity = float_from_bits(0x7F800000)
    at_zero = 0.0 if y > 0.0 else infinity
    at_infinity = infinity if y > 0.0 else 0.0
    positive = at_infinity if size == infinity else in_range
    defined = positive if size > 0.0 else (at_zero if size == 0.0 else float_from_bits(0x7FC00000))
    signed = -defined if odd_exponent and x < 0.0 else defined
    with_nan = y if y != y else signed
    return 1.0 if y == 0.0 else with_nan


def exp2_kernel(f: float, n: int) -> float:
    """Return 2**(f + n) for f in [-1/2, 1/2] and n in [-300, 300]."""
    p = 1.535336188319500e-4
    p = p * f + 1.339887440266574e-3
    p = p * f + 9.618437357674640e-3
    p = p * f + 5.550332471162809e-2
    p = p * f + 2.402264791363012e-1
    p = p * f + 6.931472028550421e-1
    # Beyond +-160 nothing changes: infinity or zero.
    return scale_by_power(p * f + 1.0, min(max(n, -160), 160))


def sine_polynomial(r: float) -> float:
    z = r * r
    p = -1.9515295891e-4
    p = p * z + 8.3321608736e-3
    p = p * z - 1.6666654611e-1
    return p * z * r + r


def cosine_polynomial(r: float) -> float:
    z = r * r
    p = 2.443315711809948e-5
    p = p * z - 1.388731625493765e-3
    p = p * z + 4.166664568298827e-2
    return p * z * z - 0.5 * z + 1.0


def reduce_angle(x: float, quarter: float) -> float:
    # pi / 2 in four parts, three of 11 bits: their products with an integer below 2**13 are exact.
    near = (x - quarter * 1.5703125) - quarter * 4.837512969970703125e-4
    r = (near - quarter * 7.549533620476723e-08) - quarter * 2.5633440682570896e-12
    # Up to 8192 it is below pi / 4 and a little; the polynomials must not get larger values from rounding.
    return min(max(r, -0.8), 0.8)


def sin(x: float) -> float:
    quarter = round(x * 0.63661977236758134)
    r = reduce_angle(x, quarter)
    k = int(quarter)
    value = cosine_polynomial(r) if (k & 1) == 1 else sine_polynomial(r)
    return -value if (k & 2) == 2 else value


def cos(x: float) -> float:
    quarter = round(x * 0.63661977236758134)
    r = reduce_angle(x, quarter)
    k = int(quarter)
    value = sine_polynomial(r) if (k & 1) == 1 else cosine_polynomial(r)
    return -value if ((k + 1) & 2) == 2 else value


def tan(x: float) -> float:
    quarter = round(x * 0.63661977236758134)
    r = reduce_angle(x, quarter)
    s = sine_polynomial(r)
    c = cosine_polynomial(r)
    return -c / s if (int(quarter) & 1) == 1 else s / c


def arcsine_polynomial(z: float) -> float:
    p = 4.2163199048e-2
    p = p * z + 2.4181311049e-2
    p = p * z + 4.5470025998e-2
    p = p * z + 7.4953002686e-2
    p = p * z + 1.6666752422e-1
    return p * z


def asin(x: float) -> float:
    a = abs(x)
    large = a > 0.5
    z = 0.5 * (1.0 - a) if large else x * x
    s = sqrt(z) if large else a
    p = arcsine_polynomial(z) * s + s
    result = 1.5707963267948966 - (p + p) if large else p
    return -result if x < 0.0 else result


def acos(x: float) -> float:
    a = abs(x)
    large = a > 0.5
    z = 0.5 * (1.0 - a) if large else x * x
    s = sqrt(z) if large else x
    p = arcsine_polynomial(z) * s + s
    outer = 3.14159265358979323846 - (p + p) if x < 0.0 else p + p
    return outer if large else 1.5707963267948966 - p


def atan(x: float) -> float:
    a = abs(x)
    big = a > 2.414213562373095
    middle = a > 0.4142135623730950
    base = 1.5707963267948966 if big else (0.7853981633974483 if middle else 0.0)
    numerator = -1.0 if big else (a - 1.0 if middle else a)
    denominator = a if big else (a + 1.0 if middle else 1.0)
    r = numerator / denominator
    z = r * r
    p = 8.05374449538e-2
    p = p * z - 1.38776856032e-1
    p = p * z + 1.99777106478e-1
    p = p * z - 3.33329491539e-1
    result = base + (p * z * r + r)
    return -result if x < 0.0 else result


def atan2(y: float, x: float) -> float:
    infinity = float_from_bits(0x7F800000)
    # Two infinities are on a diagonal; atan itself handles an infinite quotient.
    both = abs(x) == infinity and abs(y) == infinity
    yy = (1.0 if y > 0.0 else -1.0) if both else y
    xx = (1.0 if x > 0.0 else -1.0) if both else x
    angle = atan(yy / (1.0 if xx == 0.0 else xx))
    turned = angle + (3.14159265358979323846 if y >= 0.0 else -3.14159265358979323846)
    off_axis = angle if xx > 0.0 else turned
    on_axis = 1.5707963267948966 if y > 0.0 else (-1.5707963267948966 if y < 0.0 else 0.0)
    result = on_axis if xx == 0.0 else off_axis
    return x + y if x != x or y != y else result


def sinh(x: float) -> float:
    a = abs(x)
    z = x * x
    p = 2.03721912945e-4
    p = p * z + 8.33028376239e-3
    p = p * z + 1.66667160211e-1
    small = p * z * x + x
    # exp(a) overflows before sinh(a) does: halve the exponent's argument and multiply twice.
    half = exp(0.5 * a)
    large = 0.5 * half * half - 0.5 / (half * half)
    return small if a < 1.0 else (-large if x < 0.0 else large)


def cosh(x: float) -> float:
    half = exp(0.5 * abs(x))
    return 0.5 * half * half + 0.5 / (half * half)


def tanh(x: float) -> float:
    a = abs(x)
    z = x * x
    p = -5.70498872745e-3
    p = p * z + 2.06390887954e-2
    p = p * z - 5.37397155531e-2
    p = p * z + 1.33314422036e-1
    p = p * z - 3.33332819422e-1
    small = p * z * x + x
    large = 1.0 - 2.0 / (exp(2.0 * a) + 1.0)
    return small if a < 0.625 else (-large if x < 0.0 else large)


def asinh(x: float) -> float:
    a = abs(x)
    z = x * x
    p = 2.0122003309e-2
    p = p * z - 4.2699340972e-2
    p = p * z + 7.4847586088e-2
    p = p * z - 1.6666288134e-1
    small = p * z * x + x
    # From 1500 on the 1 below the root is lost anyway, and squares of larger numbers would overflow.
    large = log(a) + 0.6931471805599453 if a > 1500.0 else log(a + sqrt(z + 1.0))
    return small if a < 0.5 else (-large if x < 0.0 else large)


def acosh(x: float) -> float:
    z = x - 1.0
    p = 1.7596881071e-3
    p = p * z - 7.5272886713e-3
    p = p * z + 2.6454905019e-2
    p = p * z - 1.1784741703e-1
    p = p * z + 1.4142135263
    near = p * sqrt(z)
    large = log(x) + 0.6931471805599453 if x > 1500.0 else log(x + sqrt(z * (x + 1.0)))
    return near if z < 0.5 else large


def atanh(x: float) -> float:
    a = abs(x)
    z = x * x
    p = 1.81740078349e-1
    p = p * z + 8.24370301058e-2
    p = p * z + 1.46691431730e-1
    p = p * z + 1.99782164500e-1
    p = p * z + 3.33337300303e-1
    small = p * z * x + x
    large = 0.5 * log((1.0 + a) / (1.0 - a))
    return small if a < 0.5 else (-large if x < 0.0 else large)


# Quantization.  A value is quantized before it is stored, so that storing is exact everywhere. max(0, x) in this order
# turns NaN into 0.


def quantize(x: float, steps: float) -> float:
    """Round to the nearest fraction of steps from 0 to 1, halves to even."""
    return round(min(max(0.0, x), 1.0) * steps) / steps


def quantize_half(x: float) -> float:
    """Round to the nearest binary16, halves to even; 65520 and above become infinite."""
    bits = bits_from_float(x)
    size = bits & 0x7FFFFFFF
    # Normal halves keep 10 of 23 mantissa bits: add half a unit less one, plus the last kept bit.
    normal = (size + 0xFFF + ((size >> 13) & 1)) & -8192
    # Below 2**-14 halves are multiples of 2**-24.
    tiny = bits_from_float(round(float_from_bits(size) * 16777216.0) * 5.9604644775390625e-8)
    rounded = tiny if size < 0x38800000 else normal
    # 0x477FF000 is 65520: the first that rounds to infinity; numbers above 0x7F800000 are NaN.
    finite = 0x7F800000 if size >= 0x477FF000 else rounded
    result = size if size > 0x7F800000 else finite
    return float_from_bits(result | (bits & -2147483648))


def encode_srgb(x: float) -> float:
    """Convert linear to sRGB (IEC 61966-2-1), for x in [0, 1]."""
    c = min(max(0.0, x), 1.0)
    return 12.92 * c if c <= 0.0031308 else 1.055 * pow(c, 0.4166666666666667) - 0.055


def decode_srgb(x: float) -> float:
    """Convert sRGB to linear (IEC 61966-2-1), for x in [0, 1]."""
    return x / 12.92 if x <= 0.04045 else pow((x + 0.055) / 1.055, 2.4)
