"""
Blur the shadows, not the shadow map
====================================

The shadows alone, four ways. A larger map sharpens the edges of shadows. A map that is blurred before the comparison
moves the edges and softens nothing. Shadows that are blurred after the comparison are soft.
"""

import passgraph as pg
from passgraph.effects import soft_shadow_passes, supersampled

options = {
    "map of 512 texels": {"map_size": 512, "softness": 0.0},
    "map of 4096 texels": {"map_size": 4096, "softness": 0.0},
    "map of 512 texels, blurred": {"map_size": 512, "softness": 0.0, "map_blur_px": 8},
    "map of 512 texels, shadows blurred": {"map_size": 512, "softness": 0.15},
}

for name, option in options.items():
    shadows = soft_shadow_passes(pg.Scene.shipped(), **option).shadows_blurred
    with pg.compile(supersampled(shadows), size=(1280, 720)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 4
