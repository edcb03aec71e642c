"""Ambient occlusion on solids in VTK, from its depth buffer and camera.

    python docs/engines/vtk.py

writes docs/images/engines/vtk.png.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines import vtk as adapter
from passgraph.engines.attachment import Attachment


class Scene:
    """Superquadrics that stand close on a floor, seen by a camera that goes round them."""

    engine = "vtk"
    hook = 'renderer, `"EndEvent"`'
    shown = partial(occluded, radius=0.6)

    def __init__(self, size: tuple[int, int], samples: int = 0) -> None:
        import vtk

        self.renderer, self.window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
        self.window.OffScreenRenderingOn()
        self.window.SetMultiSamples(samples)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.renderer)
        self.renderer.SetBackground(0.82, 0.85, 0.9)
        for x in range(4):
            for y in range(4):
                solid = vtk.vtkSuperquadricSource()
                solid.SetPhiRoundness(0.2 + 0.6 * x)
                solid.SetThetaRoundness(0.2 + 0.6 * y)
                solid.SetSize(0.55)
                solid.SetPhiResolution(48)
                solid.SetThetaResolution(48)
                self._add(solid, (1.05 * x - 1.6, 1.05 * y - 1.6, 0.5), (0.75, 0.45 + 0.1 * x, 0.35 + 0.1 * y))
        floor = vtk.vtkPlaneSource()
        floor.SetOrigin(-3, -3, 0)
        floor.SetPoint1(3, -3, 0)
        floor.SetPoint2(-3, 3, 0)
        self._add(floor, (0.0, 0.0, 0.0), (0.85, 0.83, 0.8))
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(4.5, -6.0, 5.0)
        camera.SetFocalPoint(0, 0, 0.2)
        camera.SetViewUp(0, 0, 1)
        self.renderer.ResetCameraClippingRange()

    def _add(self, source: Any, at: tuple[float, float, float], color: tuple[float, float, float]) -> None:
        import vtk

        mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        mapper.SetInputConnection(source.GetOutputPort())
        actor.SetMapper(mapper)
        actor.SetPosition(*at)
        actor.GetProperty().SetColor(*color)
        actor.GetProperty().SetSpecular(0.2)
        self.renderer.AddActor(actor)

    def draw(self) -> None:
        self.renderer.GetActiveCamera().Azimuth(3.0)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()

    def picture(self) -> Picture:
        import vtk
        from vtk.util.numpy_support import vtk_to_numpy

        reader = vtk.vtkWindowToImageFilter()
        reader.SetInput(self.window)
        reader.ShouldRerenderOff()
        reader.Update()
        image = reader.GetOutput()
        width, height, _ = image.GetDimensions()
        return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, 3)[::-1].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.renderer, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        tag = self.renderer.AddObserver("EndEvent", lambda *_: call())
        return lambda: self.renderer.RemoveObserver(tag)

    def resize(self, size: tuple[int, int]) -> None:
        self.window.SetSize(*size)

    def close(self) -> None:
        self.window.Finalize()


if __name__ == "__main__":
    show(Scene)
