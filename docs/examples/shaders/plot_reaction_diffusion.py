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
shown = {
    "frame 150": (reaction(photo), 150),
    "frame 600": (reaction(photo), 600),
    "feed 0.03, kill 0.062": (reaction(photo, feed=0.03, kill=0.062), 600),
    "guided by the photograph": (reaction(photo, guided=1.0), 600),
}

for name, (target, frames) in shown.items():
    with pg.compile(target) as program:
        for _ in range(frames - 1):
            program.run(photo=data.astronaut()[20:200, 80:400])
        program(photo=data.astronaut()[20:200, 80:400]).save(f"{name}.png")
