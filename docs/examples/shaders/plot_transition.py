"""
A gl-transition
===============

Transitions in the format of gl-transitions.com take two pictures and a progress. This one burns the first along cells
of noise. ``passgraph apply dissolve.glsl a.png --to b.png --progress 0..1 --frames 50 -o fade.mp4`` makes a video.

Download :download:`dissolve.glsl </shaders/dissolve.glsl>` next to the script.
"""

from skimage import data

import passgraph as pg

dissolve = pg.load_shader("dissolve.glsl")

for progress in (0.3, 0.5, 0.7):
    with pg.compile(dissolve(pg.Input("first"), pg.Input("second"), progress=progress)) as program:
        result = program(first=data.coffee()[60:314, 75:526], second=data.chelsea()[20:274])
        result.save(f"progress {progress}.png")

# sphinx_gallery_thumbnail_number = 2
