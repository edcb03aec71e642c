"""Ambient occlusion on falling bodies in MuJoCo, whose depth is reversed.

    python docs/engines/mujoco.py

writes docs/images/engines/mujoco.png.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines import mujoco as adapter
from passgraph.engines.attachment import Attachment

KINDS = ("box", "sphere", "capsule", "ellipsoid")
BODIES = "".join(
    f'<body pos="{0.5 * (i % 4) - 0.75} {0.5 * (i // 4 % 4) - 0.75} {0.35 + 0.45 * (i // 16)}"><freejoint/>'
    f'<geom type="{KINDS[i % 4]}" size=".22 .17 .14" rgba=".{9 - i % 5} .{5 + i % 4} .4 1"/></body>'
    for i in range(32)
)
MODEL = f"""<mujoco>
  <visual>
    <global offwidth="1920" offheight="1080"/>
    <quality offsamples="{{samples}}" shadowsize="1024"/>
  </visual>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1=".7 .8 .9" rgb2=".4 .5 .6" width="64" height="64"/>
  </asset>
  <worldbody>
    <light pos="1 -2 5" dir="-.2 .4 -1" diffuse=".7 .7 .7"/>
    <geom type="plane" size="4 4 .1" rgba=".8 .78 .75 1"/>{BODIES}
  </worldbody>
</mujoco>"""


class Scene:
    """Bodies that fall on a floor; MuJoCo's own calls, as a loop of one's own has them."""

    engine = "mujoco"
    hook = "after `mjr_render`"
    shown = partial(occluded, radius=0.4)

    def __init__(self, size: tuple[int, int], samples: int = 0) -> None:
        os.environ.setdefault("MUJOCO_GL", "egl")
        import mujoco

        self.core = mujoco
        self.context = mujoco.GLContext(*size)
        self.context.make_current()
        self.model = mujoco.MjModel.from_xml_string(MODEL.format(samples=samples))
        self.data = mujoco.MjData(self.model)
        self.scene, self.option = mujoco.MjvScene(self.model, 200), mujoco.MjvOption()
        self.drawing = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self.drawing)
        self.camera = mujoco.MjvCamera()
        self.camera.lookat, self.camera.distance = (0, 0, 0.3), 3.6
        self.camera.azimuth, self.camera.elevation = 60, -28
        self.rect = mujoco.MjrRect(0, 0, *size)
        for _ in range(150):
            mujoco.mj_step(self.model, self.data)

    def draw(self) -> None:
        core = self.core
        for _ in range(5):
            core.mj_step(self.model, self.data)
        self.camera.azimuth += 1.0
        everything = core.mjtCatBit.mjCAT_ALL
        core.mjv_updateScene(self.model, self.data, self.option, None, self.camera, everything, self.scene)
        core.mjr_render(self.rect, self.scene, self.drawing)

    def picture(self) -> Picture:
        pixels = np.empty((self.rect.height, self.rect.width, 3), np.uint8)
        self.core.mjr_readPixels(pixels, None, self.rect, self.drawing)
        return pixels[::-1].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.scene, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        from passgraph.engines.hooks import hook

        return hook(self.core, "mjr_render", after=call)

    def resize(self, size: tuple[int, int]) -> None:
        self.rect = self.core.MjrRect(0, 0, *size)
        self.core.mjr_resizeOffscreen(*size, self.drawing)

    def close(self) -> None:
        self.drawing.free()
        self.context.free()


if __name__ == "__main__":
    show(Scene)
