"""First passes of effects on scenes: surfaces, textures, views and shadow maps."""
