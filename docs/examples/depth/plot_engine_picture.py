"""
Effects on an engine's picture and depth
========================================

An engine hands over its color picture, in linear light and without shadows, and its depth buffer. The effects need to
know the camera and the light besides. Each effect takes the result of any other.

Here passgraph plays the engine: it renders the scene with a reversed depth buffer.
"""

import passgraph as pg
from passgraph.effects import contact_shadow, fog, fxaa, occluded, shadowed, soft_shadow_passes, tone_map
from passgraph.effects.surfaces.engine_depth import distances

scene = pg.Scene.shipped()
camera, light = scene.camera, scene.lights[0]
passes = soft_shadow_passes(scene, display=False)
with pg.compile([passes.unshadowed, passes.depth], size=(640, 360)) as engine:
    color, distance = engine().values()
buffer = camera.hardware_depth(reversed_z=True)
inputs = {"color": color, "depth": buffer.depth(distance)}

frame = pg.Input("color")
depth = distances(pg.Input("depth"), buffer)
ambient = occluded(frame, depth, radius=1.5, camera=camera)
shadows = shadowed(ambient, depth, scene, map_size=2048, camera=camera)
shown = {
    "the engine's picture": frame,
    "occluded": ambient,
    "contact_shadow": contact_shadow(frame, depth, light=light, reach=1.2, thickness=1.0, camera=camera),
    "shadowed": shadowed(frame, depth, scene, map_size=2048, camera=camera),
    "fog": fog(frame, depth, density=0.12, falloff=0.8, camera=camera),
    "occluded, shadowed, fog": fog(shadows, depth, density=0.12, falloff=0.8, camera=camera),
}

for name, target in shown.items():
    with pg.compile(fxaa(tone_map(target, curve="linear"))) as program:
        program(**{key: inputs[key] for key in program.inputs}).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 6
