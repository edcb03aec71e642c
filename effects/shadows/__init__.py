"""Shadows of lights: maps, filters, and the effects made of them."""
