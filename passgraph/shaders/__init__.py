"""Shaders as people publish them: text in, kernels of the typed representation out."""

#: Endings of files that shaders have.
SUFFIXES = (".fs", ".glsl", ".frag", ".fsh", ".hook", ".glslp")
#: Of Shadertoy's exports, and of flat worlds too: a shader where an effect is asked for.
EXPORT_SUFFIX = ".json"
