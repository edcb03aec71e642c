"""
Penumbrae of a flat world
=========================

Light maps of a level of nine walls and three lamps: the exact share of each lamp that is seen; no penumbra; shadows
drawn twelve times, rotated about the lamp or moved with it; and blurs, constant or chosen by the distance behind the
wall.
"""

import passgraph as pg
from passgraph.effects import tone_map
from passgraph.effects.light2d import Light2D, Wall, Window, light_map, smoothed

view = Window(8.0, 0.0, 40.0, 18.0)
lamps = (
    Light2D((15.0, 11.5), (1.0, 0.78, 0.45), 13.0, 0.9),
    Light2D((31.5, 6.0), (0.45, 0.65, 1.0), 13.0, 0.9),
    Light2D((24.5, 15.5), (0.9, 0.35, 0.25), 7.0, 0.6),
)
boxes = (
    (8, 0, 9, 18), (39, 0, 40, 18), (19, 9, 20, 18), (19, 0, 20, 4), (27.5, 11, 39, 12), (12, 6, 14.5, 7),
    (25, 4.5, 26.2, 5.7), (34.5, 2.5, 35.5, 3.5), (10.5, 14, 11.5, 15),
)  # fmt: skip
walls = [Wall.box(*box) for box in boxes]

shown = {
    kind: light_map(view, lamps, walls, (640, 360), penumbra=kind, draws=12)
    for kind in ("exact", "none", "rotate", "move", "mixed")
}
shown["even blur"] = smoothed(light_map(view, lamps, walls, (640, 360), penumbra="none"), levels=4)

for name, target in shown.items():
    with pg.compile(tone_map(target, curve="linear")) as program:
        program().save(f"{name}.png")
