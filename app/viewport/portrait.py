"""Portrait: a small picture of a form that is not on screen, as the viewport would show it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtGui import QImage
from vtkmodules.vtkRenderingCore import vtkRenderer

from app.viewport.picture import as_image, rendered
from app.viewport.scene import Scene

if TYPE_CHECKING:
    from app.viewport.canvas import Canvas
    from engine.mesh import Mesh


def portrait(canvas: Canvas, mesh: Mesh, size: tuple[int, int]) -> QImage:
    """Return a picture of `size` device pixels of a mesh, from where one looks now.

    It has a renderer of its own in the canvas' window, for as long as it takes; what is on screen
    is not touched.
    """
    window, shown = canvas.render_window, canvas.renderer
    renderer = vtkRenderer()
    scene = Scene(renderer, canvas.scene.theme)
    scene.set_mesh(mesh)
    renderer.GetActiveCamera().DeepCopy(shown.GetActiveCamera())
    renderer.ResetCameraClippingRange()
    window.AddRenderer(renderer)
    shown.DrawOff()
    try:
        return as_image(rendered(window, renderer, size, transparent=False), transparent=False)
    finally:
        shown.DrawOn()
        scene.clear()
        window.RemoveRenderer(renderer)
        canvas.update()
