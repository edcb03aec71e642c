"""
Gaussian and depth-aware blur
=============================

Both blurs reach nine pixels. The depth-aware blur stops where the depth changes by more than 2 %, so that it does not
mix a surface with what is behind it. Without measured depth it leaves a pixel as it is.

The photograph is one of a stereo pair (Middlebury 2014, "Motorcycle"). Its depth follows from the disparity: the focal
length is 994.978 px, and the cameras are 193.001 mm and 31.086 px apart.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import depth_aware_blur, gaussian_blur

photo, _, disparity = data.stereo_motorcycle()
photo, disparity = photo[60:285, 300:700], disparity[60:285, 300:700]
depth = np.where(np.isfinite(disparity), 0.193001 * 994.978 / (disparity + 31.086), 0.0)
pg.save("the photograph.png", photo / 255.0)

with pg.compile(gaussian_blur(pg.Input("photo"), sigma_px=4.5, radius_px=9)) as program:
    program(photo=photo).save("Gaussian blur.png")

with pg.compile(depth_aware_blur(pg.Input("photo"), pg.Input("depth"), radius_px=9, tolerance=0.02)) as program:
    program(photo=photo, depth=depth[..., None]).save("depth-aware blur.png")

# sphinx_gallery_thumbnail_number = 3
