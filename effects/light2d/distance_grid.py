"""The distance grid, and the dark rims along walls computed from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import arguments
from passgraph.effects.checked import checked
from passgraph.effects.light2d.world import Float64, Point, Wall, Window, all_edges, distance_to_edges
from passgraph.effects.pictures.stretched import WHOLE_CLIP, copied, drawn, full_quad, in_window, quads
from passgraph.effects.quantities import Share

#: Side of a cell of a grid.
Cell = Annotated[float, pg.Range(0, None, "world units", above=True)]
#: Blend black over the scene by the rims' opacity; alpha is the scene's.
DARKER = pg.Blend("source_alpha", "one_minus_source_alpha", source_alpha="zero", destination_alpha="one")


@checked
def distance_grid(window: Window, walls: Sequence[Wall], cell: Cell = 1.5) -> NDArray[np.float32]:
    """Return the distance of each cell's center to the nearest wall, world units; 0 inside closed walls, else infinity.

    Parameters
    ----------
    window : the part of the world; a last cell that extends beyond it counts
    walls : obstacles
    cell : side of a cell

    Returns
    -------
    (rows, columns), row 0 on top, as in pictures

    >>> distance_grid(Window(0, 0, 4, 2), [Wall.box(0, 0, 1, 2)], 1.0)
    array([[0. , 0.5, 1.5, 2.5],
           [0. , 0.5, 1.5, 2.5]], dtype=float32)
    """
    columns = max(round((window.right - window.left) / cell + 0.499), 1)
    rows = max(round((window.top - window.bottom) / cell + 0.499), 1)
    grid = np.full((rows, columns), np.inf, np.float32)
    edges = all_edges(walls)
    closed = [wall for wall in walls if wall.closed]
    low = np.array([np.min(wall.points, 0) for wall in closed]).reshape(-1, 2)
    high = np.array([np.max(wall.points, 0) for wall in closed]).reshape(-1, 2)
    for row in range(rows if len(edges) else 0):
        for column in range(columns):
            middle = window.left + (column + 0.5) * cell, window.top - (row + 0.5) * cell
            grid[row, column] = distance_to_edges(middle, edges).min()
            around = np.flatnonzero(((low <= middle) & (middle <= high)).all(1))
            if any(inside(closed[number], middle) for number in around):
                grid[row, column] = 0.0
    return grid


def inside(wall: Wall, place: Point) -> bool:
    """Return True if a place is in a closed wall: a ray to the right crosses its outline an odd number of times."""
    if not wall.closed or len(wall.points) < 3:
        return False
    x, y = place
    crossed = [
        (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax)
        for (ax, ay), (bx, by) in wall.edges
        if ay != by
    ]
    return sum(crossed) % 2 == 1


def reach(grid: NDArray[np.float32] | Float64, window: Window, place: Point, cell: float, thinnest: float) -> float:
    """Return the largest length of a moving object's shadow: the grid's distance at ``place`` plus the thinnest wall,
    world units."""
    column = int((place[0] - window.left) / cell)
    row = int((window.top - place[1]) / cell)
    height, width = grid.shape
    return float(grid[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]) + thinnest


@checked
def occlusion(
    scene: pg.Target,
    grid: NDArray[np.float32],
    threshold: Annotated[float, pg.Range(0, None, "world units")],
    darkness: Share = 0.5,
    into: pg.TargetSpec | None = None,
    name: str = "occlusion",
    over: tuple[Window, float] | None = None,
) -> pg.Target:
    """Darken a scene near walls: one texel per cell, black where a wall is near, stretched bilinearly over it.

    Parameters
    ----------
    scene : any picture of the window; without ``over``, the window must end with the grid's last cells
    grid : from `distance_grid`
    threshold : cells nearer to a wall are black
    darkness : opacity of black
    into : destination target; default: float16 of the scene's size named ``name``
    name : name of the passes and targets
    over : the grid's window and the side of its cells
    """
    cells = arguments.numbers(grid, f"{name}: grid", "be an array (rows, columns), from distance_grid", pg.GraphError)
    if cells.ndim != 2 or not cells.size:
        raise pg.GraphError(f"{name}: grid must be an array (rows, columns), got shape {cells.shape}")
    texels = np.zeros((*grid.shape, 4), np.float32)
    texels[:, :, 3] = np.where(grid < threshold, darkness, 0.0)
    rims = pg.Input(f"{name}_texels", "rgba8", (grid.shape[1], grid.shape[0]), static=True, default=texels)
    copy = drawn(scene, into or pg.target(name, "rgba16f", like=scene), f"{name}_scene")
    shape, clip = full_quad(), WHOLE_CLIP
    if over is not None:
        window, cell = over
        height, width = grid.shape
        covered = Window(window.left, window.top - height * cell, window.left + width * cell, window.top)
        shape, clip = quads([covered.corners]), window.clip
    occluded: pg.Target = pg.draw(
        shape, vertex=in_window, fragment=copied, into=copy, name=name, blend=DARKER,
        values={"clip": clip, "picture": rims},
    )  # fmt: skip
    return occluded
