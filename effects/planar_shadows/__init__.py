"""Shadows and reflections in planes, with the stencil."""
