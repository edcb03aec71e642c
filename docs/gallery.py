"""The gallery: each effect in one picture from real inputs, with its call and its time on each backend.

    python docs/gallery.py [--pictures] [WORD ...]

writes docs/gallery.md and docs/images/gallery/.  With words, only entries whose title has one of them are
rendered again; the others' sections stay as they are in the page.  With --pictures nothing is timed: pictures are made
by the last backend alone, and the page keeps its text and its figures.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

root = Path(__file__).resolve().parent.parent
if str(root) not in sys.path:
    sys.path.insert(0, str(root))

import passgraph as pg
from docs.gallery_filters import FILTERS
from docs.gallery_inputs import (
    CELL,
    LAMPS,
    LEVEL,
    MOVERS,
    VIEW,
    WALLS,
    detail,
    dirt,
    engine_pictures,
    hills,
    lamps_at_dusk,
    monastery,
    photograph,
    plain_floor,
    ramps,
    receding,
    standing,
    street,
    street_depth,
    top_view,
)
from docs.gallery_light import LIGHT
from docs.gallery_looks import LOOKS
from docs.gallery_page import (
    BACKENDS,
    FOLDER,
    Entry,
    InputMissing,
    Panel,
    machine,
    open_backends,
    rendered,
    section,
    with_picture,
)
from docs.gallery_shaders import SHADERS
from passgraph.effects import (
    black_and_white,
    bloom,
    contact,
    contact_passes,
    contact_shadow,
    depth_aware_blur,
    five_pass,
    five_pass_targets,
    fog,
    gaussian_blur,
    occluded,
    planar,
    shadowed,
    soft_shadow,
    soft_shadow_passes,
    tone_map,
)
from passgraph.effects.ambient.ambient_occlusion import ambient_occlusion, ambient_occlusion_passes
from passgraph.effects.color.tone_map import CURVES
from passgraph.effects.lens.lens import dirty_lens_bright
from passgraph.effects.light2d import (
    Wall,
    World2D,
    distance_grid,
    light_map,
    lit,
    moving_shadows,
    occlusion,
    smoothed,
)
from passgraph.effects.light2d.distance_grid import reach
from passgraph.effects.light2d.lens_spots import dirty_lens_map, dirty_lens_spots, light_spots
from passgraph.effects.light2d.light_map import PENUMBRAS
from passgraph.effects.light2d.picture import light2d
from passgraph.effects.shadows.shadow_choice import SHADOW_FILTERS, Blur, BlurWidth
from passgraph.effects.surfaces.engine_depth import distances
from tests.benchmarks.memory import table
from tests.effects.planar_comparison import planar_comparison

FRAME, DEPTH, SCENE = pg.Input("frame"), pg.Input("depth"), pg.Input("scene")
DIRT = pg.Input("dirt", static=True)


def gray() -> list[Panel]:
    scene = soft_shadow_passes(pg.Scene.shipped()).picture
    return [
        Panel("a photograph", black_and_white(FRAME), {"frame": street()}),
        Panel("a scene, rendered to a texture", black_and_white(scene)),
    ]


def tone_curves() -> list[Panel]:
    frame = photograph("coffee", stops=2.0)
    return [Panel(curve, tone_map(FRAME, curve=curve), {"frame": frame}) for curve in CURVES]


def tone_ramps() -> list[Panel]:
    return [Panel(curve, tone_map(FRAME, curve=curve), {"frame": ramps()}) for curve in CURVES]


def glow() -> list[Panel]:
    frame = lamps_at_dusk()
    plain = tone_map(FRAME, curve="pbr-neutral")
    bright = tone_map(bloom(FRAME, threshold=3.0, intensity=0.5, levels=5), curve="pbr-neutral")
    return [Panel("without", plain, {"frame": frame}), Panel("bloom", bright, {"frame": frame})]


def blurs() -> list[Panel]:
    near = {"frame": detail(street())}
    unchanged = pg.kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")
    depth = np.nan_to_num(detail(street_depth()), posinf=0.0)
    along = depth_aware_blur(FRAME, DEPTH, radius_px=9, tolerance=0.02)
    return [
        Panel("as it is", unchanged(FRAME), near),
        Panel("gaussian blur", gaussian_blur(FRAME, sigma_px=4.5, radius_px=9), near),
        Panel("depth-aware blur", along, {**near, "depth": depth}),
    ]


def shadows() -> list[Panel]:
    return [Panel("", soft_shadow(monastery(), map_size=2048))]


def chain() -> list[Panel]:
    passes = soft_shadow_passes(pg.Scene.shipped(), filter=Blur())
    assert passes.shadows is not None
    assert passes.shadows_blurred is not None
    return [
        Panel("RTT1: the scene without shadows", tone_map(passes.unshadowed, curve="linear")),
        Panel("RTT2: shadows alone", passes.shadows),
        Panel("RTT3: RTT2 blurred along surfaces", passes.shadows_blurred),
        Panel("RTT4: RTT1 x RTT3", passes.picture),
    ]


def filters() -> list[Panel]:
    scene = standing()
    return [
        Panel(name, soft_shadow(scene, filter=kind(), softness=0.03), size=(840, 400), middle=0.6)
        for name, kind in SHADOW_FILTERS.items()
    ]


def before_and_after() -> list[Panel]:
    def mask(**options: object) -> pg.Target:
        made = soft_shadow_passes(standing(), **options).shadows_blurred  # type: ignore[arg-type]
        assert made is not None
        return made

    return [
        Panel("map of 512", mask(softness=0.0, map_size=512)),
        Panel("map of 4096", mask(softness=0.0, map_size=4096)),
        Panel("map of 512, blurred", mask(softness=0.0, map_size=512, map_blur_px=8)),
        Panel("map of 512, mask blurred", mask(softness=0.05, map_size=512)),
    ]


def dolly() -> list[Panel]:
    def mask(times: float, blur: BlurWidth) -> pg.Target:
        scene = receding(standing(), times)
        made = soft_shadow_passes(scene, softness=0.04, filter=Blur(blur, radius_px=12)).shadows_blurred
        assert made is not None
        return made

    return [
        Panel(f"{blur}, {times:g} x as far", mask(times, blur), middle=1.0 / times)
        for blur in ("world", "constant")
        for times in (1.0, 2.0, 4.0)
    ]


def ambient() -> list[Panel]:
    scene = standing()

    def seen(**options: object) -> pg.Target:
        return ambient_occlusion_passes(scene, radius=0.3, **options).occlusion.visibility  # type: ignore[arg-type]

    return [
        Panel("contact", contact_passes(scene, threshold=0.3, darkness=0.8).share),
        Panel("gtao", seen(method="gtao")),
        Panel("ssao", seen(method="ssao", taps=32)),
        Panel("ssao, no range check", seen(method="ssao", taps=32, range_check=False)),
        Panel("contact, the picture", contact(scene, threshold=0.3, darkness=0.8)),
        Panel("gtao, the picture", ambient_occlusion(scene, method="gtao", radius=0.3, ambient=0.25)),
    ]


def engine() -> list[Panel]:
    seen = engine_pictures()
    scene, given = seen.scene, {"frame": seen.color, "depth": seen.depth}
    camera, light, depth = scene.camera, scene.lights[0], distances(DEPTH, seen.holds)
    made = {
        "the engine's picture": FRAME,
        "occluded": occluded(FRAME, depth, radius=0.2, camera=camera),
        "contact shadow": contact_shadow(FRAME, depth, light=light, reach=0.1, thickness=0.15, camera=camera),
        "shadowed, by the meshes' shadow map": shadowed(FRAME, depth, scene, map_size=2048),
        "fog": fog(FRAME, depth, density=0.8, falloff=3.0, sky=True, camera=camera),
        "all of them": everything(FRAME, depth, scene),
    }
    plain = {"frame": seen.color}
    return [
        Panel(label, tone_map(target, curve="linear"), plain if target is FRAME else given)
        for label, target in made.items()
    ]


def everything(color: pg.Target, depth: pg.Target, scene: pg.Scene) -> pg.Target:
    """Each effect takes the one before."""
    shaded = shadowed(occluded(color, depth, radius=0.2, camera=scene.camera), depth, scene, map_size=2048)
    return fog(shaded, depth, density=0.8, falloff=3.0, sky=True, camera=scene.camera)


def floors() -> list[Panel]:
    scene = plain_floor(standing())
    made = planar_comparison(scene, threshold=0.3, darkness=0.8)
    return [
        Panel("projected", made.projected_share),
        Panel("contact", made.contact_share),
        Panel("projected, the picture", made.projected),
        Panel("contact, the picture", made.contact),
    ]


def field() -> list[Panel]:
    made = contact_passes(hills(), floor="hills", threshold=0.2, darkness=0.9)
    return [
        Panel("without", soft_shadow(hills())),
        Panel("contact", made.picture),
        Panel("share of the light that is left", made.share),
        Panel("the same from above", made.map),
    ]


def mirror() -> list[Panel]:
    return [Panel("", planar(pg.Scene.shipped(), top_opacity=0.75, fog="linear", fog_start=9.0, fog_end=26.0))]


def five() -> list[Panel]:
    camera, nodes = pg.Scene.shipped().camera, pg.Scene.shipped().nodes
    lamp = pg.Light.spot((-6.0, 8.0, 2.5), (6.0, -7.2, -2.5), intensity=90.0, cone_outer_rad=0.42)
    scene = pg.Scene(nodes, camera, (lamp,))
    return [
        Panel("normalised", five_pass(scene, kernel="normalised", ambient=0.06)),
        Panel("faithful", five_pass(scene, kernel="faithful", ambient=0.06)),
        Panel("normalised, mask", five_pass_targets(scene, kernel="normalised").mask_blurred),
        Panel("faithful, mask", five_pass_targets(scene, kernel="faithful").mask_blurred),
    ]


def penumbrae() -> list[Panel]:
    size = (636, 358)
    made = {name: light_map(VIEW, LAMPS, WALLS, size, penumbra=name, draws=12) for name in PENUMBRAS}
    made["even mix"] = smoothed(light_map(VIEW, LAMPS, WALLS, size, penumbra="none"), levels=4)
    return [Panel(name, tone_map(light, curve="linear")) for name, light in made.items()]


def game() -> list[Panel]:
    grid = distance_grid(VIEW, WALLS, CELL)
    rims = occlusion(SCENE, grid, threshold=1.0, darkness=0.6, name="rims")
    static = lit(rims, light_map(VIEW, LAMPS, WALLS, (960, 540), ambient=(0.02, 0.02, 0.03)))
    moving = moving_shadows(
        static, VIEW, LAMPS, pg.Value("movers"), 8, reach=lambda place: reach(grid, VIEW, place, CELL, 1.0)
    )
    given = {"scene": top_view()}
    return [
        Panel("as drawn", tone_map(SCENE, curve="linear"), given),
        Panel("occlusion along walls", tone_map(rims, curve="linear"), given),
        Panel("static light", tone_map(static, curve="linear"), given),
        Panel("and what moves", tone_map(moving, curve="linear"), {**given, "movers": MOVERS}),
    ]


def moving() -> list[Panel]:
    world, size = World2D.shipped(), (960, 540)
    solid = replace(world, walls=(*world.walls, *(Wall(mover.corners) for mover in world.movers)), movers=())
    made = {
        "exact, computed anew in each frame": light2d(solid, size, rims=0.0),
        "sprites, fading near lamps": light2d(world, size, rims=0.0, near="fade"),
        "sprites, a fan of them near lamps": light2d(world, size, rims=0.0, near="fan"),
        "sprites and rims along walls": light2d(world, size, near="fan"),
    }
    return [Panel(label, target, size=size) for label, target in made.items()]


def lenses() -> list[Panel]:
    scene = lit(SCENE, light_map(VIEW, LAMPS, WALLS, (960, 540), ambient=(0.02, 0.02, 0.03)))
    spots = light_spots(VIEW, LAMPS, (960, 540))
    level = light_spots(LEVEL, LAMPS, (1440, 540))
    given = {"scene": top_view(), "dirt": dirt()}
    return [
        Panel("without", tone_map(scene, curve="linear"), {"scene": top_view()}),
        Panel("1: over what is bright", tone_map(dirty_lens_bright(scene, DIRT), curve="linear"), given),
        Panel("2: spots of this view", tone_map(dirty_lens_spots(scene, DIRT, spots), curve="linear"), given),
        Panel("3: a map of spots", tone_map(dirty_lens_map(scene, DIRT, level, LEVEL, VIEW), curve="linear"), given),
    ]


MOTORCYCLE = "the left picture of the stereo pair `skimage.data.stereo_motorcycle()`"
SHIPPED = "the scene that comes with passgraph"
TABLE = "`table/table.obj` and `duck.obj` of pybullet's data"
LEVEL_INPUT = "a level of nine walls and three lamps, textured with `skimage.data.gravel()` and `brick()`"

ENTRIES: tuple[Entry, ...] = (
    Entry(
        "Black and white", f"{MOTORCYCLE}; {SHIPPED}",
        "The warm-up: a picture, or a scene rendered to a texture, is read by a kernel that keeps its luma.", gray, 2,
    ),
    Entry(
        "Tone curves", "`skimage.data.coffee()` in linear light, two stops too bright",
        "Six ways from scene-linear light to a display. `agx` and `pbr-neutral` let bright colors turn white; the "
        "others press each channel alone and shift the hue.",
        tone_curves, 3, 1.5,
    ),
    Entry(
        "Tone curves on ramps", "gray, pure colors and a skin tone over sixteen stops",
        "The same curves where their differences are plain: how far blacks and whites reach, and what becomes of "
        "pure colours.",
        tone_ramps, 2, 640 / 144,
    ),
    Entry(
        "Bloom", "`skimage.data.rocket()` in linear light, its highlights stretched to 35 times white",
        "What is brighter than a threshold glows, over 64 pixels by five halvings.", glow, 2, 1.5,
    ),
    Entry(
        "Depth-aware blur", f"{MOTORCYCLE}, with its measured depth",
        "Both blurs reach nine pixels; the second stops where depth jumps by more than 2 %, and leaves as it is what "
        "has no measured depth.",
        blurs, 3, 1.25,
    ),
    Entry(
        "Soft shadow", "`samurai_monastry.obj` of pybullet's data, 124,000 triangles",
        "Shadows are a picture of their own, blurred along surfaces and multiplied onto the scene.", shadows,
    ),
    Entry(
        "The chain of soft shadows", SHIPPED,
        "The render targets in their order, in the names of the document that describes them.", chain, 2,
    ),
    Entry(
        "Shadow filters", TABLE,
        "All filters side by side: a blur of the mask on the screen, and those that filter where the map is compared "
        "or blur the map's moments.",
        filters, 2, 2.1,
    ),
    Entry(
        "Blur before and after the compare", TABLE,
        "A larger map sharpens edges; a blurred map moves them and softens nothing; a blurred mask is soft.",
        before_and_after, 2,
    ),
    Entry(
        "A receding camera", TABLE,
        "The middle of each picture, enlarged. Above, a blur that stays as wide in the world; below, one that stays as "
        "wide in pixels and dissolves the shadows.",
        dolly, 3,
    ),
    Entry(
        "Five passes", f"{SHIPPED}, under a spotlight",
        "The normalized kernel beside the one as printed, whose weights add up to 1.137 and which shifts the mask.",
        five, 2,
    ),
    Entry(
        "Planar shadows, reflection and fog", SHIPPED,
        "Drawn with a stencil: the plane, the mirrored scene in it, shadows that darken each pixel once, and fog.",
        mirror,
    ),
    Entry(
        "Shadows on a floor", TABLE,
        "Projected straight down, all that stands over the floor throws the same shadow, with hard edges; contact "
        "shadows are dark where things touch the floor and end at the threshold.",
        floors, 2,
    ),
    Entry(
        "Contact on a height field", "`heightmaps/wm_height_out.png` and `duck.obj` of pybullet's data",
        "The floor is drawn to a height map first, so that the threshold follows the hills.", field, 2,
    ),
    Entry(
        "Ambient occlusion and contact", TABLE,
        "The light that is left by what is seen from above, and by three searches on the screen; without a range check "
        "the search puts a halo around what stands before the floor.",
        ambient, 2,
    ),
    Entry(
        "From an engine's picture and depth",
        f"{TABLE}, as a color picture without shadows and a reversed depth buffer",
        "Nothing else is known of the scene, but where its camera and its light are; the shadow map is drawn of meshes "
        "that are known besides. Each effect takes any other's result.",
        engine, 2,
    ),
    Entry(
        "Penumbrae of a flat world", LEVEL_INPUT,
        "Light maps: the share of each lamp that is seen, exactly; no penumbra; shadows drawn twelve times, turned or "
        "moved; halvings chosen by the way behind the wall; and an even mix of halvings.",
        penumbrae, 2,
    ),
    Entry(
        "Light of a flat world", LEVEL_INPUT,
        "Static light is computed once; in each frame only the sprites of moving things are drawn.", game, 2,
    ),
    Entry(
        "Static beside dynamic light", "the flat world that comes with passgraph",
        "Moving things as walls of a light map, beside a static map with sprites over it.", moving, 2,
    ),
    Entry(
        "Dirty lenses", f"{LEVEL_INPUT}; dirt from a random generator",
        "Dirt on what is bright, lamp or not; on spots drawn for this view; on a map of spots made once.", lenses, 2,
    ),
    *LIGHT,
    *LOOKS,
    *FILTERS,
    *SHADERS,
)  # fmt: skip


def sections_of(page: str) -> dict[str, str]:
    """The page's sections by heading."""
    parts = page.partition("\n## Memory")[0].split("\n## ")[1:]
    return {part.partition("\n")[0]: "## " + part.strip() + "\n" for part in parts}


def main() -> None:
    words = [word.lower() for word in sys.argv[1:] if word != "--pictures"]
    timed = "--pictures" not in sys.argv[1:]
    file = FOLDER / "gallery.md"
    page = file.read_text(encoding="utf-8") if file.exists() else ""
    sections = sections_of(page)
    backends = open_backends(BACKENDS if timed else BACKENDS[-1:])
    chosen = [entry for entry in ENTRIES if not words or any(word in entry.title.lower() for word in words)]
    # figures of other entries were taken before
    opening = HEAD.format(machine=machine()) if timed and not words else page.partition("\n## ")[0]
    begin = time.perf_counter()
    for number, entry in enumerate(chosen, 1):
        print(f"[{time.perf_counter() - begin:5.0f} s] {number} of {len(chosen)}: {entry.title}", flush=True)
        try:
            rows = rendered(entry, backends, timed)
            sections[entry.title] = section(entry, rows) if timed else with_picture(sections[entry.title], entry)
        except InputMissing as missing:
            print(f"  SKIPPED {entry.title}: {missing}", flush=True)
        # written behind each entry, so that what is done is kept
        kept = [sections[entry.title] for entry in ENTRIES if entry.title in sections]
        memory = MEMORY.format(table=table()) if timed else "## Memory" + page.partition("\n## Memory")[2]
        file.write_text("\n".join([opening, *kept, memory]), encoding="utf-8")
    for backend in backends.values():
        if backend is not None:
            backend.close()
    print(f"[{time.perf_counter() - begin:5.0f} s] {file.name} is written")


HEAD = """# Gallery

Each effect in one picture, with the call that made it and its time. `python docs/gallery.py` renders this page. Models
and photographs come from optional packages and are not part of the repository.

- Panels are rendered at the size in the table, and scaled to fit.
- Times are milliseconds a frame: the median after warm-up, without reading the picture back. Static passes, such as a
  shadow map of a light that stands still, were computed before.
- "Differ" is the largest share of pixels at which two backends differ by more than two steps of 8 bits.

Machine: {machine}.
"""


MEMORY = """## Memory

MiB of all pictures of each effect with its defaults at 1920×1080, inputs and textures counted, from its plan
(`python tests/benchmarks/memory.py`): as written, a picture for each target; with pointwise passes fused; with pictures
that are never alive together sharing memory; with both, as programs run.

{table}
"""


if __name__ == "__main__":
    main()
