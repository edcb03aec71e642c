"""Only what a scene needs: passes, textures and code that are left out."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import soft_shadow, soft_shadow_passes
from passgraph.effects.shadows.shadow_choice import Auto, Blur, Penumbra
from passgraph.plan.data import Plan
from tests.effects.scenes import cube, floor, from_above, render, sun

CAMERA = from_above(6.0)
NODES = (floor(), cube())


def plan_of(*targets: pg.Target) -> Plan:
    with pg.compile(targets, backend="null", size=(64, 36)) as program:
        return program.plan


def steps_of(scene: pg.Scene, **options: object) -> list[str]:
    return [step.name for step in plan_of(soft_shadow(scene, map_size=64, **options)).steps]  # type: ignore[arg-type]


#: The passes over the map that say how wide a search for casters has to be; they rest as long as the map does.
NEAREST = [*(f"nearest casters of light, {number}" for number in range(4)), "nearest casters of light"]


def test_the_chain_of_penumbrae_is_five_steps_beside_those_of_the_map() -> None:
    """One draw for the map, one for all surfaces, one pass in half the size, one for the light, one for the picture."""
    scene = pg.Scene(NODES, CAMERA, (sun(radius=0.1),))
    assert sorted(steps_of(scene, filter=Penumbra())) == [
        *sorted(NEAREST), "penumbrae of light", "picture", "shadow map of light", "soft_shadow", "surfaces: untextured",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "blurs"),
    [({}, False), ({"softness": 0.1}, True), ({"filter": Auto(blur=Blur("constant"))}, True)],
    ids=str,
)
def test_auto_blurs_where_a_width_is_asked_for(options: dict[str, object], blurs: bool) -> None:
    names = steps_of(pg.Scene(NODES, CAMERA, (sun(radius=0.1),)), **options)
    assert any("blur" in name for name in names) == blurs
    assert any("penumbrae" in name for name in names) != blurs


def test_the_plain_chain_is_five_steps() -> None:
    """One draw for the map, one for all surfaces, one pass for the light, two for the blur."""
    scene = pg.Scene(NODES, CAMERA, (sun(radius=0.1),))
    assert sorted(steps_of(scene, softness=0.1)) == [
        "picture", "shadow blur x", "shadow map of light", "surfaces: untextured", "unshadowed and shadows",
    ]  # fmt: skip


def test_without_softness_nothing_is_blurred() -> None:
    scene = pg.Scene(NODES, CAMERA, (sun(radius=0.1),))
    plan = plan_of(soft_shadow(scene, softness=0.0, map_size=64))
    assert len(plan.steps) == 3
    assert "no blur: the shadows' softness is 0" in plan.explain()


def test_lights_without_extent_are_not_blurred() -> None:
    assert not any("blur" in name for name in steps_of(pg.Scene(NODES, CAMERA, (sun(radius=0.0),))))


@pytest.mark.parametrize(
    ("scene", "note"),
    [
        (pg.Scene(NODES, CAMERA), "no shadows: the scene has no light"),
        (pg.Scene((floor(casts=False),), CAMERA, (sun(),)), "no shadows: nothing in the scene casts one"),
        (
            pg.Scene((floor(receives=False), cube(receives=False)), CAMERA, (sun(),)),
            "no shadows: nothing in the scene receives one",
        ),
    ],
)
def test_without_casters_receivers_or_lights_there_are_no_shadow_passes(scene: pg.Scene, note: str) -> None:
    plan = plan_of(soft_shadow(scene))
    assert not any("shadow" in step.name or "blur" in step.name for step in plan.steps)
    assert note in plan.explain()


def test_many_lights_share_one_blur() -> None:
    scene = pg.Scene(NODES, CAMERA, tuple(sun(45, 60 * i, radius=0.1) for i in range(4)))
    plan = plan_of(soft_shadow(scene, softness=0.1, map_size=64))
    names = [name for step in plan.steps for name in (step.name, *getattr(step, "fused", ()))]
    assert sum("blur" in name for name in names) == 2
    assert sum(name.startswith("shadow map") for name in names) == 4


def test_two_lights_are_computed_in_one_pass() -> None:
    scene = pg.Scene(NODES, CAMERA, (sun(45, 0, radius=0.1), sun(45, 90, radius=0.1)))
    plan = plan_of(soft_shadow(scene, softness=0.1, map_size=64))
    (light,) = [step for step in plan.steps if step.name == "unshadowed and shadows"]
    assert light.fused == ("ambient light", "light0", "light1")  # type: ignore[union-attr]


def test_shadow_maps_are_drawn_once_and_again_when_the_light_changes() -> None:
    plan = plan_of(soft_shadow(pg.Scene(NODES, CAMERA, (sun(radius=0.1),)), map_size=64))
    assert [step.name for step in plan.steps if step.static] == ["shadow map of light", *NEAREST]


def test_untextured_nodes_are_one_draw_without_texture_code() -> None:
    plan = plan_of(soft_shadow(pg.Scene((*NODES, cube((2, 0, 0))), CAMERA, (sun(),)), map_size=64))
    draws = [step for step in plan.steps if step.name.startswith("surfaces")]
    assert len(draws) == 1
    assert not draws[0].reads
    assert not plan.inputs


def _textured(**maps: pg.Texture) -> pg.Scene:
    node = NODES[0]
    mesh = pg.Mesh.make(node.mesh.positions, node.mesh.triangles, node.mesh.normals, [[0, 1], [1, 1], [1, 0], [0, 0]])
    return pg.Scene((pg.Node(mesh, pg.Material("tiles", (1, 1, 1, 1), **maps)), cube()), CAMERA, (sun(),))  # type: ignore[arg-type]


def _texture(value: tuple[int, int, int] = (128, 128, 255), space: str = "linear") -> pg.Texture:
    return pg.Texture.make(np.full((4, 4, 3), value, np.uint8), space, "t")  # type: ignore[arg-type]


def test_maps_that_are_not_there_are_not_read() -> None:
    everything = {
        "base_color_texture": _texture(space="srgb"),
        "normal_texture": _texture(),
        "height_texture": _texture(),
    }
    # heights alone move nothing that could be seen
    for key, count in (("base_color_texture", 2), ("normal_texture", 2), ("height_texture", 0)):
        plan = plan_of(soft_shadow(_textured(**{key: everything[key]}), map_size=64))
        assert len(plan.inputs) == count, key
    assert len(plan_of(soft_shadow(_textured(**everything), map_size=64)).inputs) == 5


def test_flat_normal_and_height_maps_change_nothing() -> None:
    flat = _textured(normal_texture=_texture((128, 128, 255)), height_texture=_texture((255, 255, 255)))
    plain = pg.Scene((pg.Node(NODES[0].mesh, pg.Material("tiles", (1, 1, 1, 1))), cube()), CAMERA, (sun(),))
    made = [render(soft_shadow(s, map_size=64, softness=0.0, display=False))["soft_shadow"] for s in (flat, plain)]
    # 128 / 255 is not exactly one half
    np.testing.assert_allclose(made[0], made[1], atol=6e-3)


@pytest.mark.parametrize("name", ["rgba16f", "rgb32f", "rgba32f"])
def test_the_hdr_format_is_the_chosen_one(name: str) -> None:
    passes = soft_shadow_passes(pg.Scene(NODES, CAMERA, (sun(),)), hdr_format=name, map_size=64)  # type: ignore[arg-type]
    made_as = passes.soft_shadow.spec.format
    assert made_as is not None
    assert made_as.name == name
    assert made_as.bytes_per_pixel * 8 == {"rgba16f": 64, "rgb32f": 96, "rgba32f": 128}[name]
    made = render(passes.soft_shadow, size=(16, 9))["soft_shadow"]
    assert made.shape[2] == (3 if name == "rgb32f" else 4)


def test_fused_and_unfused_plans_agree() -> None:
    scene = pg.Scene(NODES, CAMERA, (sun(45, 0, radius=0.1), sun(30, 90, radius=0.1)))
    picture = soft_shadow(scene, map_size=64)
    results = []
    for fuse in (True, False):
        with pg.compile(picture, backend="reference", size=(48, 27), options=pg.Options(fuse=fuse)) as program:
            results.append(program()["picture"])
    np.testing.assert_array_equal(results[0], results[1])
