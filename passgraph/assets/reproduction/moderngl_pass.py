"""Run one fragment shader on OpenGL and hold its result against what is allowed: python reproduce.py

Needs numpy and moderngl. Exit status 1: a value is outside of what is allowed.
"""

from __future__ import annotations

import sys

import moderngl
import numpy as np
from case import CASE, SIZE, image, parameters, source, verdict

#: NumPy's name of a channel's type → moderngl's.
TYPES = {"uint8": "f1", "uint16": "nu2", "float16": "f2", "float32": "f4"}


def main() -> int:
    backend = {"backend": "egl"} if sys.platform == "linux" else {}
    context = moderngl.create_context(standalone=True, **backend)
    program = context.program(vertex_shader=source("pass.vert"), fragment_shader=source("pass.frag"))

    def texture(description: tuple[int, int, str], size: tuple[int, int], data: bytes | None) -> moderngl.Texture:
        internal, channels, type_ = description
        made = context.texture(size, channels, data, alignment=1, dtype=TYPES[type_], internal_format=internal)
        made.filter = moderngl.NEAREST, moderngl.NEAREST
        made.repeat_x = made.repeat_y = False
        return made

    for number, description in enumerate(CASE["images"]):
        numbers = image(number, description[1])
        texture(description, (numbers.shape[1], numbers.shape[0]), numbers.tobytes()).use(number)
        if f"pg_image{number}" in program:
            program[f"pg_image{number}"] = number
    for name, file in (("pg_floats", "floats.bin"), ("pg_ints", "ints.bin")):
        if name in program:  # else the compiler has removed it
            uniform = program[name]
            length = 4 * uniform.array_length * uniform.dimension
            uniform.write(parameters(file)[:length].ljust(length, b"\0"))
    if "pg_output_size" in program:
        program["pg_output_size"] = SIZE
    targets = [texture(description, SIZE, None) for description in CASE["outputs"]]
    context.framebuffer(targets).use()
    context.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    results = [
        np.frombuffer(target.read(alignment=1), type_).reshape(SIZE[1], SIZE[0], channels)
        for target, (_, channels, type_) in zip(targets, CASE["outputs"], strict=True)
    ]
    return verdict("; ".join(context.info[f"GL_{name}"] for name in ("RENDERER", "VENDOR", "VERSION")), results)


if __name__ == "__main__":
    sys.exit(main())
