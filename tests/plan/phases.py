"""Kernels, inputs and plans that tests of phases share."""

from __future__ import annotations

import passgraph as pg
from passgraph import Const, Image, vec4
from passgraph.graph.targets import Target
from passgraph.plan.build import build
from passgraph.plan.data import Options, Plan

copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
join = pg.kernel(source="def join(a: Image, b: Image) -> vec4: return a.sample(uv()) + b.sample(uv())")
left = pg.kernel(source="def left(color: Image) -> vec4: return color[-1, 0]")
zoom = pg.kernel(source="def zoom(color: Image) -> vec4: return color.sample(uv())")
sized = pg.kernel(source="def sized(color: Image) -> vec4: return color[0, 0] * float(color.size.x)")
frame = pg.Input("frame", "rgba32f", (8, 4))
still = pg.Input("still", "rgba32f", (8, 4), static=True)


@pg.kernel
def pair(color: Image) -> tuple[vec4, vec4]:
    return color[0, 0], color[0, 0] * 2.0


@pg.kernel
def either(a: Image, b: Image, use_b: Const[bool]) -> vec4:
    result = a[0, 0]
    if use_b:
        result = b[0, 0]
    return result


def plan(*outputs: Target, **options: bool) -> Plan:
    return build({target.name: target for target in outputs}, options=Options(**options))


def named(kernel: object, *images: Target, name: str, format: str = "rgba32f", **settings: object) -> Target:
    made: Target = kernel(*images, into=pg.target(name, format, **settings))  # type: ignore[operator]
    return made


def steps(made: Plan) -> list[str]:
    return [step.name for step in made.steps]
