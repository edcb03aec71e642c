"""GLSL fragment shaders as kernels.

In the order in which text goes through it: :mod:`.tokens`, :mod:`.macros` and :mod:`.preprocess`; :mod:`.parse` into
the tree of :mod:`.syntax`; :mod:`.shader` and :mod:`.body` into the typed representation, with :mod:`.statements`,
:mod:`.loops`, :mod:`.expressions`, :mod:`.calls`, :mod:`.places`, :mod:`.builtins` and :mod:`.images`.
"""

from passgraph.glsl.shader import Shader, parse
from passgraph.glsl.unit import Native, NativeValue, Note, Uniform, Unit

__all__ = ["Native", "NativeValue", "Note", "Shader", "Uniform", "Unit", "parse"]
