"""Formats around GLSL: what each says of parameters, pictures and passes."""
