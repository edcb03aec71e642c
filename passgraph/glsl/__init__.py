"""GLSL fragment shaders as kernels.

In the order of processing: :mod:`.tokens` and :mod:`.preprocess`; :mod:`.expression_parser` and :mod:`.glsl_parser`
into the tree of :mod:`.syntax`, which :mod:`.declaration_rules` checks; :mod:`.shader` and :mod:`.glsl_body` into the
typed representation, with :mod:`.host_declarations`, :mod:`.glsl_statements`, :mod:`.loops`, :mod:`.glsl_expressions`,
:mod:`.operators`, :mod:`.function_calls`, :mod:`.places`, :mod:`.builtins`, :mod:`.stage_values` and
:mod:`.image_functions`; :mod:`.name_rules` and :mod:`.uncalled` check what does not run.
"""

from passgraph.glsl.shader import Shader, ShaderText, parse, parse_shader
from passgraph.glsl.unit import Note, Uniform, Unit

__all__ = ["Note", "Shader", "ShaderText", "Uniform", "Unit", "parse", "parse_shader"]
