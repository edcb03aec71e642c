"""Ambient occlusion in Ogre, for which there is no adapter: its listener, and what all adapters share.

    xvfb-run -a python docs/engines/ogre.py        # the Python that ogre-python is made for

writes docs/images/engines/ogre-python.png.
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
from passgraph.engines.attachment import Attachment, Seen

SHAPES = ("PT_SPHERE", "PT_CUBE")


class Scene:
    """Spheres and cubes on a floor, drawn into a texture, seen by a camera that goes round them."""

    engine = "ogre-python"
    hook = "`postRenderTargetUpdate`"
    needs_display = True
    shown = partial(occluded, radius=30.0)

    def __init__(self, size: tuple[int, int]) -> None:
        os.environ.setdefault("OGRE_MIN_LOGLEVEL", "4")
        import Ogre
        import Ogre.Bites
        import Ogre.RTShader

        class Application(Ogre.Bites.ApplicationContext):
            def oneTimeConfig(self) -> bool:
                chosen = next(s for s in self.getRoot().getAvailableRenderers() if "3+" in s.getName())
                self.getRoot().setRenderSystem(chosen)
                return True

        class Listener(Ogre.RenderTargetListener):
            calls: list[Callable[[], object]] = []  # noqa: RUF012 (one scene a process)

            def postRenderTargetUpdate(self, event: object) -> None:
                for call in list(self.calls):
                    call()

        self.ogre, self.listener = Ogre, Listener()
        self.application = Application("passgraph")
        self.application.initApp()
        self.root = self.application.getRoot()
        scene = self.root.createSceneManager()
        Ogre.RTShader.ShaderGenerator.getSingleton().addSceneManager(scene)
        scene.setAmbientLight(Ogre.ColourValue(0.4, 0.4, 0.45))
        light = scene.createLight("sun")
        light.setType(Ogre.Light.LT_DIRECTIONAL)
        light.setDiffuseColour(0.5, 0.48, 0.42)
        towards = scene.getRootSceneNode().createChildSceneNode()
        towards.setDirection(Ogre.Vector3(-1, -2, -1))
        towards.attachObject(light)
        for number in range(16):
            entity = scene.createEntity(getattr(Ogre.SceneManager, SHAPES[number % 3 % 2]))
            node = scene.getRootSceneNode().createChildSceneNode()
            node.setPosition(Ogre.Vector3(85 * (number % 4) - 130, 20 + 8 * (number % 3), 85 * (number // 4) - 130))
            node.setScale(Ogre.Vector3(0.75, 0.75, 0.75))
            node.attachObject(entity)
        floor = scene.getRootSceneNode().createChildSceneNode()
        floor.setPosition(Ogre.Vector3(0, -18, 0))
        floor.setScale(Ogre.Vector3(6, 0.05, 6))
        floor.attachObject(scene.createEntity(Ogre.SceneManager.PT_CUBE))
        self.camera = scene.createCamera("camera")
        self.camera.setNearClipDistance(100)
        self.camera.setFarClipDistance(1000)
        self.node = scene.getRootSceneNode().createChildSceneNode()
        self.node.attachObject(self.camera)
        self.angle, self.number = 0.3, 0
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        ogre, self.number = self.ogre, self.number + 1
        self.texture = ogre.TextureManager.getSingleton().createManual(
            f"frame {self.number}", "General", ogre.TEX_TYPE_2D, *size, 0, ogre.PF_BYTE_RGBA, ogre.TU_RENDERTARGET
        )
        self.target = self.texture.getBuffer().getRenderTarget()
        self.target.setAutoUpdated(False)
        view = self.target.addViewport(self.camera)
        view.setBackgroundColour(ogre.ColourValue(0.6, 0.68, 0.78))
        self.camera.setAspectRatio(size[0] / size[1])
        self.target.addListener(self.listener)

    def draw(self) -> None:
        self.angle += 0.05
        ogre = self.ogre
        self.node.setPosition(ogre.Vector3(380 * np.sin(self.angle), 260, 380 * np.cos(self.angle)))
        self.node.lookAt(ogre.Vector3(0, 0, 0), ogre.Node.TS_WORLD)
        self.target.update()

    def picture(self) -> Picture:
        from Ogre.Numpy import view

        image = self.ogre.Image()
        self.texture.convertToImage(image)
        return np.array(view(image.getPixelBox()))[..., :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        isolation, camera = values.pop("isolation", "auto"), values.pop("camera", None)
        seen = Seen()
        made = Attachment(
            "ogre", effect, values, camera=camera, isolation=isolation,
            # Ogre draws textures upside down, so that their first row is the highest.
            frame=lambda host: host.framebuffer(origin="top"),
            engine_camera=lambda: seen.by(
                _numbers(self.camera.getViewMatrix()), _numbers(self.camera.getProjectionMatrix())
            ),
        )  # fmt: skip
        made.on_close(self.hook_in(made.draw))
        return made

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        self.listener.calls.append(call)
        return lambda: self.listener.calls.remove(call)

    def close(self) -> None:
        self.target.removeListener(self.listener)


def _numbers(matrix: Any) -> Any:
    """A matrix of Ogre's by what it makes of unit vectors, for it has no way to its numbers."""
    import Ogre

    columns = [matrix * Ogre.Vector4(*unit) for unit in np.eye(4).tolist()]
    return np.array([[each.x, each.y, each.z, each.w] for each in columns], np.float64).T


if __name__ == "__main__":
    show(Scene)
