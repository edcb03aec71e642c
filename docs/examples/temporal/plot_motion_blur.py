"""
Motion blur
===========

A shutter that is open for half of a frame, computed from one picture, its depth, and the cameras of this frame and the
one before.
"""

from dataclasses import replace

import passgraph as pg
from passgraph.effects import fxaa, motion_blur, soft_shadow_passes, tone_map

scene = pg.Scene.shipped()
now = scene.camera
seen = soft_shadow_passes(scene, display=False)
before = {
    "the camera moves aside": replace(now, eye=(2.4, 6.6, 10.8)),
    "the camera moves forward": replace(now, eye=(3.7, 7.6, 12.2)),
}

for name, camera in before.items():
    blurred = motion_blur(seen.picture, seen.depth, camera=now, previous_camera=camera)
    with pg.compile(fxaa(tone_map(blurred, curve="linear")), size=(640, 360)) as program:
        program().save(f"{name}.png")
