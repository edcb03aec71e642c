"""Shaders as people publish them: text in, kernels of the typed representation out."""

#: Endings of files that shaders have.
SUFFIXES = (".fs", ".glsl", ".frag", ".fsh", ".hook", ".json")
