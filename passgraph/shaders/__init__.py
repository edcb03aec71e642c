"""Shaders as people publish them: text in, kernels of the typed representation out."""
