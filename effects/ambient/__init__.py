"""Ambient occlusion and contact shadows."""
