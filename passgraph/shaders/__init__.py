"""Shaders as people publish them: text in, kernels of the typed representation out."""

#: Endings of files that shaders have; exports of Shadertoy are JSON, as scenes are too, and go by `load_shader` alone.
SUFFIXES = (".fs", ".glsl", ".frag", ".fsh", ".hook", ".glslp")
