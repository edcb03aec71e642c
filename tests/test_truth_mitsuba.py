"""The truth itself against another renderer, Mitsuba 3, where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball
from passgraph.truth import first_surfaces, visible_share
from tests.effects.scenes import cube, floor

SIZE = (48, 32)
SAMPLES = 64
LIGHT = pg.Light.spot((0.4, 4.0, 0.6), (0, -1, 0), intensity=1.0, radius=0.5, cone_outer_rad=1.2)
CAMERA = pg.Camera((2.4, 2.6, 3.4), (0.3, 0.2, 0), vertical_fov_rad=0.6, near=0.1, far=50.0)


def scene() -> pg.Scene:
    nodes = (floor(6.0), cube((-0.5, 0, -0.3), 0.8), pg.Node(ball(0.4, 48), transform=translation((0.8, 0.7, 0.2))))
    return pg.Scene(nodes, CAMERA, (LIGHT,))


def shape_of(mi: Any, node: pg.Node, number: int) -> Any:
    """The node's triangles as a white diffuse mesh without normals."""
    linear = node.transform[:3, :3]
    places = node.mesh.positions.astype(np.float64) @ linear.T + node.transform[:3, 3]
    made = mi.Mesh(f"node{number}", len(places), len(node.mesh.triangles), props=_properties(mi))
    values = mi.traverse(made)
    values["vertex_positions"] = places.astype(np.float32).ravel()
    values["faces"] = node.mesh.triangles.astype(np.uint32).ravel()
    values.update()
    return made


def _properties(mi: Any) -> Any:
    made = mi.Properties()
    made["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 1.0}})
    return made


def rendered(nodes: tuple[pg.Node, ...], mi: Any) -> np.ndarray[Any, Any]:
    """Direct light of a disc on these nodes, (h, w), unfiltered pixels."""
    turn = mi.ScalarTransform4f
    made: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": SAMPLES, "bsdf_samples": 0, "hide_emitters": True},
        "sensor": {
            "type": "perspective", "fov": float(np.degrees(CAMERA.vertical_fov_rad)), "fov_axis": "y",
            "to_world": turn().look_at(origin=list(CAMERA.eye), target=list(CAMERA.target), up=[0, 1, 0]),
            # one ray through the middle of a pixel
            "sampler": {"type": "independent", "sample_count": 1},
            "film": {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"}},
        },
        "lamp": {
            "type": "disk",
            "to_world": turn().look_at(
                origin=list(LIGHT.position), target=[LIGHT.position[0], 0, LIGHT.position[2]], up=[1, 0, 0]
            ).scale(LIGHT.radius),
            "emitter": {"type": "area", "radiance": 1.0},
        },
    }  # fmt: skip
    for number, node in enumerate(nodes):
        made[f"node{number}"] = shape_of(mi, node, number)
    return np.asarray(mi.render(mi.load_dict(made), spp=64))[:, :, 0]


def test_shares_of_a_disc_are_those_of_mitsuba() -> None:
    """The ratio of direct light with and without casters, where the floor alone is seen in both."""
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    with_casters, without = rendered(scene().nodes, mi), rendered(scene().nodes[:1], mi)
    truth, seen = visible_share(scene(), SIZE, samples=1024), first_surfaces(scene(), SIZE)
    on_floor = seen.node == 0
    for axis in (0, 1):  # pixels that are floor all over: Mitsuba's rays spread over the pixel
        for step in (1, -1):
            on_floor &= np.roll(seen.node == 0, step, axis)
    ratio = with_casters[on_floor] / np.maximum(without[on_floor], 1e-9)
    off = ratio - truth.share[on_floor]
    assert on_floor.sum() > 500
    assert ((truth.share > 0.05) & (truth.share < 0.95) & on_floor).sum() > 30
    # Mitsuba weighs the light by its cosines, which change by a few percent over this disc, and averages over pixels
    assert abs(off.mean()) < 0.005
    assert np.sqrt(np.mean(off**2)) < 0.015
