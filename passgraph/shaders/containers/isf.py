"""ISF files: shaders with a JSON header that names inputs, passes and persistent buffers (isf.video, version 2)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Computed, Relative, Target, TargetSpec, previous, target
from passgraph.language.kernel import kernel_from_text
from passgraph.shaders.containers.clock import PRELUDE, clock_parameters, clock_uniforms
from passgraph.shaders.containers.effect import ShaderEffect, name_of, notes_of
from passgraph.shaders.containers.isf_header import IsfHeader, read_header
from passgraph.shaders.containers.isf_vertex import vertex_prelude
from passgraph.shaders.containers.pictures import handle_or_black, imported, shown_with_kept
from passgraph.shaders.containers.text import shader_text
from passgraph.shaders.glsl import parse

_BEFORE = f"""{PRELUDE}
#define TIME pg_seconds
#define TIMEDELTA pg_step
#define FRAMEINDEX pg_frame
#define DATE pg_date
#define RENDERSIZE pg_output_size
#define IMG_SIZE(image) vec2(textureSize(image, 0))
#define IMG_NORM_PIXEL(image, at) texture2D(image, at)
#define IMG_PIXEL(image, at) texture2D(image, (at) / IMG_SIZE(image))
#define IMG_THIS_NORM_PIXEL(image) texture2D(image, isf_FragNormCoord)
#define IMG_THIS_PIXEL(image) texture2D(image, isf_FragNormCoord)
"""
_WHERE = "".join(
    f"#ifndef {name}_FragNormCoord\n#define {name}_FragNormCoord pg_position\n#endif\n" for name in ("isf", "vv")
)


def read_isf(text: str, path: Path) -> ShaderEffect:
    """The effect of an ISF file; a vertex shader of the same name beside it is read too.

    Raises
    ------
    InputError
        For a header that is wrong.
    KernelError
        For a shader that is refused, with file, line and caret.
    """
    file = str(path)
    header = read_header(text, file)
    prelude, postlude, entry = _BEFORE + _declared(header), "", "main"
    vertex = path.with_suffix(".vs")
    if vertex.is_file():
        before, postlude = vertex_prelude(shader_text(vertex, "a vertex shader"), str(vertex))
        prelude, entry = prelude + before, "pg_main"
    shaders = [
        parse(
            text, name=f"{name_of(path)}{number or ''}", file=file, entry=entry, prelude=prelude + _WHERE,
            postlude=postlude, defines={"PASSINDEX": str(number), "__VERSION__": "120"},
        )
        for number in range(len(header.passes))
    ]  # fmt: skip
    kernels = [PixelKernel[Target].of_shader(shader) for shader in shaders]
    used = {parameter.name for kernel in kernels for parameter in kernel.parameters}
    parameters = clock_parameters(used, header.parameters) | dict(header.parameters)
    graph = _Graph(header, kernels, path)
    summary = header.description.strip().partition("\n")[0] or f"{path.stem}: an ISF shader"
    return ShaderEffect(
        name_of(path), "ISF", summary, header.credit, header.images, parameters, notes_of(shaders), file, graph.built,
        frozenset(re.findall(r"\$(\w+)", " ".join(side for one in header.passes for side in one.size))),
    )  # fmt: skip


def _declared(header: IsfHeader) -> str:
    """Uniforms for what the header names."""
    names = [*header.images, *header.imported, *(one.target for one in header.passes if one.target)]
    lines = [f"uniform sampler2D {name};" for name in dict.fromkeys(names)]
    lines += [f"#define _{name}_imgRect vec4(0.0, 0.0, IMG_SIZE({name}))" for name in dict.fromkeys(names)]
    lines += [f"#define _{name}_imgSize IMG_SIZE({name})" for name in dict.fromkeys(names)]
    lines += [f"uniform {one.type} {one.name};" for one in header.parameters.values()]
    return "\n".join(lines) + "\n"


@cache
def _showing(scaled: bool) -> PixelKernel[Target]:
    """What shows a buffer that has a size of its own, or is as large as the output."""
    read = ".sample(uv())" if scaled else "[0, 0]"
    return PixelKernel[Target](kernel_from_text(f"def shown(buffer: Image) -> vec4: return buffer{read}"))


class _Graph:
    """The passes of a file, ready to be called."""

    def __init__(self, header: IsfHeader, kernels: list[PixelKernel[Target]], path: Path) -> None:
        self.header, self.kernels, self.path = header, kernels, path
        self.imported = {name: imported(name, at, path.parent, str(path)) for name, at in header.imported.items()}

    def built(self, pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        specs = self._specs(values, into)

        def draw(shown: TargetSpec) -> list[Target]:
            if specs[-1] is into:
                return self._drawn(pictures, values, [*specs[:-1], shown])
            drawn = self._drawn(pictures, values, specs)
            return [*drawn, _showing(isinstance(specs[-1].size, Computed))(buffer=drawn[-1], into=shown)]

        return shown_with_kept(draw, f"{into.name}.shown", into)

    def _drawn(
        self, pictures: Mapping[str, Target], values: Mapping[str, Any], specs: list[TargetSpec]
    ) -> list[Target]:
        """What each pass draws."""
        last = {one.target: spec for one, spec in zip(self.header.passes, specs, strict=True) if one.target}
        persistent = {one.target for one in self.header.passes if one.target and one.persistent}
        uniforms = dict(values) | clock_uniforms(values, self.header.parameters)
        held: dict[str, Target] = {}
        drawn: list[Target] = []
        for one, spec, kernel in zip(self.header.passes, specs, self.kernels, strict=True):
            given: dict[str, Any] = {}
            for parameter in kernel.parameters:
                name = parameter.name
                if name in uniforms:
                    given[name] = uniforms[name]
                elif name in held:
                    given[name] = held[name]
                elif name in persistent:
                    given[name] = previous(last[name])
                else:
                    given[name] = handle_or_black(pictures.get(name) or self.imported.get(name))
            drawn.append(kernel.called(given, spec))
            if one.target:
                held[one.target] = drawn[-1]
        return drawn

    def _specs(self, values: Mapping[str, Any], into: TargetSpec) -> list[TargetSpec]:
        """A target for each pass; the last one's is the caller's, unless it draws into a buffer that is kept."""
        specs: list[TargetSpec] = []
        for number, one in enumerate(self.header.passes):
            # What frames bring on is of the format and size that the file says, whatever is asked for.
            if number == len(self.header.passes) - 1 and not (one.target and (one.persistent or any(one.size))):
                specs.append(into)
                break
            formulas = one.formulas(values, f"{self.path}: PASSES[{number}]")
            size = Relative(1.0) if formulas is None else Computed(*formulas)
            made = target(f"{into.name}.{one.target or 'pass'}.{number}", "rgba32f" if one.is_float else "rgba8")
            specs.append(replace(made, size=size))
        return specs
