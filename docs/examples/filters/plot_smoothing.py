"""
Smoothing that keeps edges
==========================

The bilateral filter averages pixels of similar color. The median takes out single wrong pixels. Non-local means
(``denoise``) average pixels whose surroundings look alike, and keep repeated textures.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import bilateral, denoise, median

clean = data.astronaut()[:225, 60:460] / 255.0
noisy = np.clip(clean + np.random.default_rng(3).normal(0.0, 0.06, clean.shape), 0.0, 1.0)
pg.save("with noise.png", noisy)

photo = pg.Input("photo")
shown = {
    "bilateral": bilateral(photo, radius_px=5, sigma_px=3.0, sigma_color=0.25),
    "median": median(photo, size_px=5),
    "non-local means": denoise(photo, strength=0.08, noise=0.06),
}
for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=noisy).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 4
