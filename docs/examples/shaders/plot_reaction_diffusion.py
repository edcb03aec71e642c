"""
Reaction and diffusion
======================

An ISF shader with a persistent buffer of floats: two chemicals of Gray and Scott's model react and diffuse from frame
to frame, fed where the photograph is bright.

Download :download:`reaction-diffusion.fs </shaders/reaction-diffusion.fs>` next to the script.
"""

from skimage import data

import passgraph as pg

reaction, photo = pg.load_shader("reaction-diffusion.fs"), pg.Input("photo")
picture = data.astronaut()[20:164, 112:368]
shown = {
    "default": reaction(photo),
    "feed 0.03, kill 0.062": reaction(photo, feed=0.03, kill=0.062),
    "guided by the photograph": reaction(photo, guided=1.0),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        for frame in range(1, 351):
            program.run(photo=picture)
            if frame == 350 or (frame == 100 and name == "default"):
                pg.save(f"{name}, frame {frame}.png", program.read()[target.name])

# sphinx_gallery_thumbnail_number = 2
