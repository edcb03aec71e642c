"""Darken a picture by the ambient occlusion of its depth."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.ambient.ambient_occlusion import Method, Slices, Steps, occlusion
from passgraph.effects.checked import effect
from passgraph.effects.quantities import FieldOfView, NotNegative, Reach, Share
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.temporal.accumulate import MostFrames
from passgraph.language import Image, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD


@pg.kernel
def dim(color: Image, occlusion: Image) -> vec4:
    """Darken all light of a picture, as its parts are unknown."""
    here = color[0, 0]
    return vec4(here.rgb * occlusion[0, 0].r, here.a)


@effect("occluded", "picture+depth")
def occluded(
    color: pg.Target,
    depth: pg.Target,
    *,
    radius: Reach | pg.Value = 0.5,
    method: Method = "gtao",
    slices: Slices = 2,
    steps: Steps = 8,
    thickness: Share = 0.0,
    power: NotNegative | pg.Value = 1.0,
    half_resolution: bool = False,
    most_frames: MostFrames = 1,
    camera: pg.Camera | pg.Value | None = None,
    previous_camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "occluded",
) -> pg.Target:
    """Darken a picture by the ambient occlusion of its depth.

    Parameters
    ----------
    color : any picture, linear light
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    radius : reach of occluders
    method : horizons, or points of a hemisphere. See `passgraph.effects.ambient.ambient_occlusion.ambient_occlusion`
    slices : for gtao: planes through the line of sight
    steps : for gtao: taps to each side of a slice
    thickness : for gtao: by how much a horizon sinks again toward each lower tap behind it
    power : exponent of the visibility: 1 is physical, more is darker
    half_resolution : search at half the width and height, then upsample along surfaces
    most_frames : from 2 on, average over frames, with other noise in each; 1 slice suffices then
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's, or its run value. Default: one
        with ``vertical_fov_rad``
    previous_camera : with ``most_frames``, the camera of the frame before; default: it does not move
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the last pass and target

    Normals are computed from the depth.  All light is dimmed, since ambient light cannot be separated from the rest.
    `passgraph.effects.ambient.ambient_occlusion.occlusion` returns the visibility itself.

    Examples
    --------
    >>> import numpy as np
    >>> made = occluded(pg.Input("frame"), pg.Input("depth"), radius=1.0)
    >>> with pg.compile(made, backend="reference", size=(8, 8)) as program:
    ...     flat = program(frame=np.ones((8, 8, 4)), depth=np.full((8, 8, 1), 3.0))["occluded"]
    >>> bool((flat == 1.0).all())
    True
    """
    seen_by = camera_of(camera, vertical_fov_rad)
    found = occlusion(
        depth, depth_normals(depth, seen_by, f"{name} normals"), seen_by, prefix=f"{name} ", radius=radius,
        method=method, slices=slices, steps=steps, thickness=thickness, power=power,
        half_resolution=half_resolution, most_frames=most_frames, previous_camera=previous_camera,
    )  # fmt: skip
    dimmed: pg.Target = dim(color, found.visibility, into=into or pg.target(name, "rgba32f"), name=name)
    return dimmed
