"""Shadows of lights: maps, filters, and effects that use them."""
