"""Makes docs/images/cryptomatte.png: a picture, the objects of its Cryptomatte, and a matte. Needs the package OpenEXR.

python docs/cryptomatte_picture.py
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.cryptomatte import hash_of

PICTURE = Path(__file__).parent / "images" / "cryptomatte.png"
WIDTH, HEIGHT = 320, 180
#: Discs from front to back: name, center, radius and color; then what is behind them.
DISCS = (
    ("ball_red", (110, 100), 44, (0.85, 0.25, 0.15)),
    ("ball_blue", (190, 80), 52, (0.15, 0.35, 0.8)),
    ("lamp", (265, 60), 24, (0.95, 0.85, 0.4)),
)
BEHIND = ("wall", (0.35, 0.36, 0.38))


def write_shot(file: Path) -> None:
    """Write a picture with a Cryptomatte of two layers: each disc covers edge pixels in part."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32) + 0.5
    left, covers = np.ones((HEIGHT, WIDTH), np.float32), []
    for _, (cx, cy), radius, _ in DISCS:
        covers.append(left * np.clip(radius - np.hypot(x - cx, y - cy) + 0.5, 0, 1))
        left = left - covers[-1]
    covers.append(left)
    colors = [*(color for *_, color in DISCS), BEHIND[1]]
    names = [*(name for name, *_ in DISCS), BEHIND[0]]
    picture = sum(cover[..., None] * np.float32(color) for cover, color in zip(covers, colors, strict=True))
    numbers = np.array([hash_of(name) for name in names], np.uint32).view(np.float32)
    order = np.argsort(-np.stack(covers), axis=0, kind="stable")
    ranked = np.take_along_axis(np.stack(covers), order, axis=0)
    found = np.where(ranked > 0, numbers[order], np.float32(0))
    channels = {letter: picture[..., i] for i, letter in enumerate("RGB")}
    for layer in range(2):
        for i, (number, cover) in enumerate(("RG", "BA")):
            channels[f"crypto_object{layer:02}.{number}"] = found[2 * layer + i]
            channels[f"crypto_object{layer:02}.{cover}"] = ranked[2 * layer + i]
    key = f"cryptomatte/{hash_of('crypto_object'):08x}"[:-1]
    manifest = json.dumps({name: f"{hash_of(name):08x}" for name in names})
    header = {f"{key}/name": "crypto_object", f"{key}/manifest": manifest}
    header |= {f"{key}/hash": "MurmurHash3_32", f"{key}/conversion": "uint32_to_float32"}
    OpenEXR.File(header, {name: np.ascontiguousarray(one) for name, one in channels.items()}).write(str(file))


def shown() -> None:
    with tempfile.TemporaryDirectory() as folder:
        shot, matte = Path(folder) / "shot.exr", Path(folder) / "matte.exr"
        write_shot(shot)
        assert run(["apply", "cryptomatte", str(shot), "--name", "ball*", "-o", str(matte)]) == 0
        ids = pg.load(shot, layer="crypto_object00", raw=True)[..., 0].view(np.uint32)
        # As Nuke's node shows them: bits of the number as a color.
        preview = np.stack([ids >> shift & 255 for shift in (16, 8, 0)], axis=-1) / np.float32(255)
        gap = np.ones((HEIGHT, 6, 3), np.float32)
        columns = [pg.load(shot)[..., :3], gap, preview, gap, pg.load(matte)[..., :3]]
        pg.save(PICTURE, np.concatenate(columns, axis=1))


if __name__ == "__main__":
    shown()
