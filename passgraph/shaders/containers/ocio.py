"""OpenColorIO processors as pixel kernels: GLSL is parsed, LUTs become inputs, dynamic properties uniforms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.errors import InputError
from passgraph.glsl import parse
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Target, TargetSpec
from passgraph.shaders.containers.shader_images import brought

if TYPE_CHECKING:
    import PyOpenColorIO as ocio

#: Most numbers in the LUTs of a processor: a 129³ LUT has 6.4 million.
MAX_LUT_NUMBERS = 1 << 25
#: Width at which OpenColorIO folds a long 1-D LUT; every device supports textures of that width.
MAX_LUT_WIDTH = 4096
#: The frame is the first picture: a target without a size has that of its pass's first input.
_FRAME = "uniform sampler2D frame;\n"
_MAIN = """
void main() { gl_FragColor = pg_transform(pg_here(frame)); }
"""


@dataclass(frozen=True, eq=False)
class ProcessorKernel:
    """A pixel kernel that applies an OpenColorIO processor.

    Attributes
    ----------
    kernel : reads ``frame`` at its own pixel; red, green, blue and alpha, alpha not associated
    luts : inputs with the LUTs, by the name of their parameter
    uniforms : values of the processor's uniforms, by name
    """

    kernel: PixelKernel[Target]
    luts: Mapping[str, Target]
    uniforms: Mapping[str, Any]

    def __call__(self, frame: Target, into: TargetSpec, uniforms: Mapping[str, Any]) -> Target:
        """Add the pass; ``uniforms`` replace the processor's own values."""
        return self.kernel.called({"frame": frame, **self.luts, **self.uniforms, **uniforms}, into)


def read_processor(processor: ocio.Processor, name: str) -> ProcessorKernel:
    """Translate a processor's GLSL; nothing is optimized that would change its results.

    Raises
    ------
    InputError
        For LUTs of more than ``MAX_LUT_NUMBERS`` numbers.
    """
    import PyOpenColorIO as ocio

    shader = ocio.GpuShaderDesc.CreateShaderDesc(
        language=ocio.GPU_LANGUAGE_GLSL_4_0, functionName="pg_transform", resourcePrefix="ocio_"
    )
    shader.setAllowTexture1D(False)
    shader.setTextureMaxWidth(MAX_LUT_WIDTH)
    processor.getOptimizedGPUProcessor(ocio.OPTIMIZATION_LOSSLESS).extractGpuShaderInfo(shader)
    flat, cubes = list(shader.getTextures()), list(shader.get3DTextures())
    numbers = sum(lut.width * lut.height * 3 for lut in flat) + sum(lut.edgeLen**3 * 3 for lut in cubes)
    if numbers > MAX_LUT_NUMBERS:
        raise InputError(f"{name}: its LUTs hold {numbers} numbers; at most {MAX_LUT_NUMBERS} are read")
    luts: dict[str, Target] = {}
    for lut in flat:
        channels = 1 if lut.channel == ocio.GpuShaderCreator.TEXTURE_RED_CHANNEL else 3
        luts[lut.samplerName] = _input(name, lut, (lut.height, lut.width, channels))
    for lut in cubes:
        side = lut.edgeLen
        luts[lut.samplerName] = _input(name, lut, (side * side, side, 3)).slices(side)
    uniforms = {key: _value(data) for key, data in shader.getUniforms()}
    return ProcessorKernel(_kernel(name, shader.getShaderText()), luts, uniforms)


@lru_cache(maxsize=32)
def _kernel(name: str, text: str) -> PixelKernel[Target]:
    """Parse a processor's GLSL, which takes nine tenths of the time of building its pass."""
    # Rows count from the top as in OpenColorIO's arrays, so LUTs are not flipped.
    shader = parse(_FRAME + text + _MAIN, name=name, file=f"<OpenColorIO: {name}>", rows_up=False)
    return PixelKernel[Target].of_shader(shader)


def _input(transform: str, lut: Any, shape: tuple[int, int, int]) -> Target:
    import PyOpenColorIO as ocio

    numbers = np.array(lut.getValues(), np.float32).reshape(shape)
    texture = brought(f"{transform}.{lut.samplerName}", "r32f" if shape[2] == 1 else "rgb32f", numbers)
    return texture.filter("nearest" if lut.interpolation == ocio.INTERP_NEAREST else "linear").border("clamp")


def _value(data: Any) -> Any:
    """Return the value of a uniform for kernels."""
    import PyOpenColorIO as ocio

    read = {
        ocio.UNIFORM_DOUBLE: "getDouble",
        ocio.UNIFORM_BOOL: "getBool",
        ocio.UNIFORM_FLOAT3: "getFloat3",
        ocio.UNIFORM_VECTOR_INT: "getVectorInt",
        ocio.UNIFORM_VECTOR_FLOAT: "getVectorFloat",
    }
    value = getattr(data, read[data.type])()
    return value if isinstance(value, (bool, float)) else tuple(value)
