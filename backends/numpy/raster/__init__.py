"""Draws: vertices, clipping, tiles, fragments."""
