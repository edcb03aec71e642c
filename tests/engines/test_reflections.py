"""Reflections on the screen from an engine's own picture, depth and camera."""

from __future__ import annotations

import pytest

from tests.engines.harmless import need, said

pytestmark = pytest.mark.engines


@pytest.mark.parametrize("engine", ["moderngl-window", "pyglet", "vtk", "panda3d"])
def test_a_scene_of_an_engine_mirrors_itself(engine: str) -> None:
    """In many pixels of surfaces that stand beside one another, with colors that the picture has; the sky stays."""
    need(engine)
    assert said(f"""
        import numpy as np
        from docs.engines.{engine.replace("-", "_")} import Scene
        from passgraph.effects import ssr

        plain, mirrored = Scene((160, 100)), Scene((160, 100))
        plain.draw()
        before = plain.picture().astype(int)
        with mirrored.attach(ssr, reflectance=0.6, thickness=0.5) as attached:
            mirrored.draw()
            after = mirrored.picture().astype(int)
        changed = (np.abs(after - before) > 4).any(axis=2)
        sky = (before == before[0, 0]).all(axis=2)
        print(attached.error, 0.02 < changed.mean() < 0.8, changed[sky].mean() < 0.01, after.max() <= before.max() + 1)
    """).split("\n")[-2:] == ["None True True True", ""]
