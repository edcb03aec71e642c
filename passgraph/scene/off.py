"""Read OFF files: polygons, with normals and colors of vertices, and colors of polygons.

trimesh (5.2) knows the keywords OFF and COFF, and drops all colors.

Source: Geomview, "OFF Files", The Geometry Center. A vertex or a polygon is one line here.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from passgraph.scene.polygons import Polygons

_KEYWORD = re.compile(rb"(ST)?(C)?(N)?OFF\b")


def read_off(data: bytes) -> Polygons:
    """Return the surface of an OFF file in text; raise ValueError if it is damaged.

    >>> surface = read_off(b"OFF\\n3 1 0\\n0 0 0\\n1 0 0\\n0 1 0\\n3 0 1 2  255 0 0\\n")
    >>> surface.corners.tolist(), surface.polygon_colors.tolist()
    ([0, 1, 2], [[255, 0, 0]])
    """
    text = re.sub(rb"#[^\r\n]*", b"", data).strip()
    keyword = _KEYWORD.match(text)
    if keyword is None:
        word = text.split(None, 1)[0][:16].decode("latin-1") if text else ""
        raise ValueError(f"it begins with {word!r}; expected OFF, COFF, NOFF, STOFF or a mix of them")
    textured, colored, with_normals = (group is not None for group in keyword.groups())
    lines = [words for line in text[keyword.end() :].splitlines() if (words := line.split())]
    vertices, faces = (int(word) for word in lines[0][:2]) if lines and len(lines[0]) > 1 else (0, 0)
    if not 0 <= vertices + faces < len(lines):
        raise ValueError(f"it is truncated: {vertices} vertices and {faces} polygons take more than its lines")
    table = np.array(lines[1 : vertices + 1], np.float64).reshape(vertices, -1)
    polygons = lines[vertices + 1 : vertices + 1 + faces]
    lengths = np.array([int(line[0]) for line in polygons], np.int64)
    if any(not 0 <= length < len(line) for line, length in zip(polygons, lengths.tolist(), strict=True)):
        raise ValueError("it is truncated: a polygon's line has fewer corners than its first number says")
    rest = table[:, 3:]
    normals, rest = (rest[:, :3], rest[:, 3:]) if with_normals else (None, rest)
    uvs, rest = (rest[:, -2:], rest[:, :-2]) if textured else (None, rest)
    return Polygons(
        table[:, :3],
        np.array([int(w) for n, line in zip(lengths, polygons, strict=True) for w in line[1 : n + 1]], np.int64),
        lengths,
        normals,
        _stored(rest) if colored else None,
        _colors([line[length + 1 :] for length, line in zip(lengths, polygons, strict=True)]),
        uvs,
    )


def _colors(words: list[list[bytes]]) -> NDArray[np.generic] | None:
    """Return the colors of polygons that all have three or four numbers; a single one names an entry of a palette."""
    widths = {len(line) for line in words}
    if len(widths) != 1 or not widths <= {3, 4}:
        return None
    return _stored(np.array(words, np.float64))


def _stored(numbers: NDArray[np.float64]) -> NDArray[np.generic] | None:
    """Return colors as bytes if they are: whole numbers, any of them above 1."""
    if numbers.shape[1] not in (3, 4):
        return None
    is_bytes = bool((numbers == np.rint(numbers)).all()) and float(numbers.max(initial=0.0)) > 1.0
    return np.clip(numbers, 0, 255).astype(np.uint8) if is_bytes else numbers
