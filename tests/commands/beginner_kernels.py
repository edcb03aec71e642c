"""Kernels that people write in their first hour: `passgraph check` must not fail or be undecided on any of them."""

import passgraph as pg
from passgraph import (
    Image,
    clamp,
    cos,
    dot,
    exp,
    exp2,
    floor,
    length,
    log2,
    mix,
    pixel,
    sin,
    smoothstep,
    sqrt,
    step,
    uv,
    vec2,
    vec3,
    vec4,
)


@pg.kernel
def unpremultiply(c: Image) -> vec4:
    return vec4(c[0, 0].rgb / max(c[0, 0].a, 1e-4), c[0, 0].a)


@pg.kernel
def log_curve(c: Image) -> vec4:
    return vec4(log2(max(c[0, 0].rgb, 1e-5)) / 20.0, 1.0)


@pg.kernel
def contrast(c: Image) -> vec4:
    return (c[0, 0] - 0.5) * 1.4 + 0.5


@pg.kernel
def saturation(c: Image) -> vec4:
    luma = dot(c[0, 0].rgb, vec3(0.2126, 0.7152, 0.0722))
    return vec4(mix(vec3(luma), c[0, 0].rgb, 1.5), c[0, 0].a)


@pg.kernel
def vignette(c: Image) -> vec4:
    away = length(uv() - 0.5)
    return vec4(c[0, 0].rgb * (1.0 - smoothstep(0.3, 0.8, away)), c[0, 0].a)


@pg.kernel
def posterize(c: Image) -> vec4:
    return floor(clamp(c[0, 0], 0.0, 1.0) * 5.0) / 5.0


@pg.kernel
def invert(c: Image) -> vec4:
    return vec4(1.0 - c[0, 0].rgb, c[0, 0].a)


@pg.kernel
def sepia(c: Image) -> vec4:
    p = c[0, 0].rgb
    return vec4(
        dot(p, vec3(0.393, 0.769, 0.189)), dot(p, vec3(0.349, 0.686, 0.168)), dot(p, vec3(0.272, 0.534, 0.131)), 1.0
    )


@pg.kernel
def sobel(c: Image) -> vec4:
    gx = c[1, -1].r + 2.0 * c[1, 0].r + c[1, 1].r - c[-1, -1].r - 2.0 * c[-1, 0].r - c[-1, 1].r
    gy = c[-1, 1].r + 2.0 * c[0, 1].r + c[1, 1].r - c[-1, -1].r - 2.0 * c[0, -1].r - c[1, -1].r
    return vec4(vec3(sqrt(gx * gx + gy * gy)), 1.0)


@pg.kernel
def chromatic(c: Image) -> vec4:
    away = (uv() - 0.5) * 0.02
    return vec4(c.sample(uv() + away).r, c.sample(uv()).g, c.sample(uv() - away).b, 1.0)


@pg.kernel
def pixelate(c: Image) -> vec4:
    return c.texel(pixel() // 8 * 8)


@pg.kernel
def checker(c: Image) -> vec4:
    return c[0, 0] * float((pixel().x // 8 + pixel().y // 8) % 2)


@pg.kernel
def swirl(c: Image) -> vec4:
    p = uv() - 0.5
    a = 3.0 * (0.5 - min(length(p), 0.5))
    return c.sample(vec2(p.x * cos(a) - p.y * sin(a), p.x * sin(a) + p.y * cos(a)) + 0.5)


@pg.kernel
def gauss(c: Image) -> vec4:
    total = vec4(0.0)
    weights = 0.0
    for y in range(-3, 4):
        for x in range(-3, 4):
            w = exp(-float(x * x + y * y) / 8.0)
            total += c[x, y] * w
            weights += w
    return total / weights


@pg.kernel
def soft_light(c: Image) -> vec4:
    p = clamp(c[0, 0], 0.0, 1.0)
    return (1.0 - 2.0 * 0.3) * p * p + 2.0 * 0.3 * p


@pg.kernel
def srgb(c: Image) -> vec4:
    p = max(c[0, 0].rgb, 0.0)
    return vec4(mix(12.92 * p, 1.055 * pow(p, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), p)), c[0, 0].a)


@pg.kernel
def exposure(c: Image) -> vec4:
    return vec4(c[0, 0].rgb * exp2(1.5), c[0, 0].a)


@pg.kernel
def filmic(c: Image) -> vec4:
    x = max(c[0, 0].rgb - 0.004, 0.0)
    return vec4((x * (6.2 * x + 0.5)) / (x * (6.2 * x + 1.7) + 0.06), 1.0)


@pg.kernel
def hue(c: Image) -> vec4:
    p = c[0, 0].rgb
    high = max(p.r, max(p.g, p.b))
    low = min(p.r, min(p.g, p.b))
    return vec4((p - low) / max(high - low, 1e-6), 1.0)


@pg.kernel
def emboss(c: Image) -> vec4:
    return vec4(0.5 + (c[1, 1].rgb - c[-1, -1].rgb) * 0.5, 1.0)


@pg.kernel
def dilate(c: Image) -> vec4:
    high = c[0, 0]
    for y in range(-1, 2):
        for x in range(-1, 2):
            high = max(high, c[x, y])
    return high
