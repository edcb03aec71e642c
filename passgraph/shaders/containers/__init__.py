"""Shader formats around GLSL, with their declarations of parameters, pictures and passes."""
