"""
ISF shaders
===========

ISF (Interactive Shader Format) is GLSL with a JSON header. ``film.fs`` lifts blacks, warms lights and adds grain.
``night-vision.fs`` amplifies the luma onto phosphor. ``glow.fs`` has four passes: it cuts out bright areas at a quarter
of the size, blurs them each way and adds them.

Download :download:`film.fs </shaders/film.fs>`, :download:`night-vision.fs </shaders/night-vision.fs>` and
:download:`glow.fs </shaders/glow.fs>` next to the script.
"""

from skimage import data

import passgraph as pg

photo = pg.Input("photo")
film, night, glow = (pg.load_shader(f"{name}.fs") for name in ("film", "night-vision", "glow"))
motorcycle, coffee = data.stereo_motorcycle()[0][60:440, 40:716], data.coffee()[20:358]
shown = {
    "film.fs": (film(photo), motorcycle),
    "film.fs at its strongest": (film(photo, fade=1.0, warmth=1.0, grain=1.0, edges=1.0), motorcycle),
    "night-vision.fs": (night(photo), motorcycle),
    "night-vision.fs, white phosphor": (night(photo, phosphor=1, gain=1.5, tube=False), motorcycle),
    "glow.fs": (glow(photo), coffee),
    "glow.fs, blue, from 0.3": (glow(photo, threshold=0.3, tint=(0.3, 0.6, 1.0, 1.0)), coffee),
}

for name, (target, picture) in shown.items():
    with pg.compile(target) as program:
        program(photo=picture).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 3
