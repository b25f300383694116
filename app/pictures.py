"""Pictures without a window: the viewport's scene, drawn off screen, with ink and words on top."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from app.form import Form
from app.look.colours import LIGHT, ROLE_COLOURS, Theme, rgb8
from engine.arrays import F64, I64
from engine.files.place import write_file
from engine.mesh import Mesh
from engine.view import View

if TYPE_CHECKING:
    from app.viewport.picking import Sight

SUPERSAMPLING = 2  # drawn so many times larger, then averaged: smooth edges on any driver
INK_WIDTH = 3.0


@dataclass(frozen=True, eq=False)
class Ink:
    """A line on the picture plane: path (p, 2) in logical pixels of the view, and its role."""

    path: F64
    role: str
    closed: bool = False


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve of anchors (p, 3) on the form, mesh units, and its role."""

    points: F64
    role: str


class Studio:
    """Takes pictures of one form and its variations; use it in a `with` statement.

    Parameters
    ----------
    mesh : the form; its faces are those of every picture.
    theme : the neutral colours.
    scale : picture pixels in one logical pixel of a view.
    """

    def __init__(self, mesh: Mesh, theme: Theme = LIGHT, scale: float = 1.0) -> None:
        if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
            # Else VTK first tries X and complains before it falls back to EGL by itself.
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (registers the OpenGL classes)
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

        from app.viewport.scene import Scene

        self.theme = theme
        self.scale = scale
        self._renderer = vtkRenderer()
        self._window = vtkRenderWindow()
        self._window.SetOffScreenRendering(True)
        self._window.SetMultiSamples(0)
        self._window.AddRenderer(self._renderer)
        self._scene = Scene(self._renderer, theme)
        self._scene.scale = scale * SUPERSAMPLING
        self._mesh = mesh
        self._scene.set_mesh(mesh)

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self._scene.clear()
        self._window.Finalize()

    def picture(
        self,
        view: View,
        vertices: F64 | None = None,
        region: I64 | None = None,
        curves: Sequence[Curve] = (),
        inks: Sequence[Ink] = (),
        colours: NDArray[np.uint8] | None = None,
    ) -> Image.Image:
        """Return the picture of the form seen through `view`.

        Parameters
        ----------
        vertices : (n, 3) positions, or None to leave them as they are.
        region : vertex ids to tint, with their rim, or None.
        curves, inks : what lies on the form and on the picture plane.
        colours : (n, 3) instead of the clay, or None.
        """
        width, height = (round(s * self.scale) for s in view.size)
        scene = self._scene
        if vertices is not None:
            scene.move(vertices, None)
        scene.set_region(region)
        scene.set_map(colours)
        rods = [actor for curve in curves for actor in self._rod(curve, view)]
        for actor in rods:
            self._renderer.AddActor(actor)
        self._window.SetSize(width * SUPERSAMPLING, height * SUPERSAMPLING)
        aim(self._renderer.GetActiveCamera(), view, scene.placement, scene.radius)
        self._window.Render()
        image = Image.fromarray(self._pixels())
        for actor in rods:
            self._renderer.RemoveActor(actor)
        draw_ink(image, inks, self.scale * SUPERSAMPLING, self.theme)
        return image.resize((width, height), Image.Resampling.LANCZOS)

    def _rod(self, curve: Curve, view: View) -> list[Any]:
        """Return actors of a round rod along a curve, with a bead at each anchor.

        They are real geometry, half sunk into the form, so that the form hides what lies behind it.
        """
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        from app.viewport.curves import smooth_curve

        points = self._scene.placement.to_scene(curve.points)
        pixel = self._scene.placement.scale * mesh_units_per_pixel(view, curve.points)
        colour = np.array(rgb8(ROLE_COLOURS[curve.role])) / 255
        shapes = [(tube(smooth_curve(points), 2.3 * pixel), colour)]
        shapes.append((beads(points, 3.3 * pixel), 0.5 + 0.5 * colour))
        shapes.append((beads(points[[0, -1]], 6.5 * pixel), colour))
        actors = []
        for shape, shade in shapes:
            mapper = vtkPolyDataMapper()
            mapper.SetInputConnection(shape.GetOutputPort())
            mapper.ScalarVisibilityOff()
            actor = vtkActor()
            actor.SetMapper(mapper)
            look = actor.GetProperty()
            look.SetColor(*shade)
            look.SetAmbient(0.35)
            look.SetDiffuse(0.75)
            actors.append(actor)
        return actors

    def sight(self, view: View) -> Sight:
        """Return which triangles are seen through `view`, one pixel of the view each."""
        from app.viewport.idimage import captured_by_selector
        from app.viewport.picking import Sight

        surface, placement = self._scene.surface, self._scene.placement
        assert surface is not None
        width, height = (round(s) for s in view.size)
        self._window.SetSize(width, height)
        aim(self._renderer.GetActiveCamera(), view, placement, self._scene.radius)
        self._window.Render()
        ids = captured_by_selector(self._window, self._renderer, surface.actor)[::-1]
        return Sight(
            ids=np.ascontiguousarray(ids),
            view=View(view.matrix, (width, height)),
            scale=1.0,
            form=Form(self._mesh, np.arange(surface.n), placement.to_mesh(surface.positions)),
            faces=surface.faces,
        )

    def move(self, vertices: F64) -> None:
        """Give the form other positions (n, 3)."""
        self._scene.move(vertices, None)

    def _pixels(self) -> NDArray[np.uint8]:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        width, height = self._window.GetSize()
        array = vtkUnsignedCharArray()
        self._window.GetPixelData(0, 0, width - 1, height - 1, 0, array, 0)
        pixels: NDArray[np.uint8] = vtk_to_numpy(array).reshape(height, width, 3)[::-1]
        return np.ascontiguousarray(pixels)


def aim(camera: Any, view: View, placement: Any, radius: float) -> None:
    """Put a vtkCamera where a view was taken from.

    A view holds a matrix only. For a symmetric frustum the eye is where x, y and w of the clip
    coordinates vanish, w grows along the line of sight, and the row of y gives up and the angle.

    Parameters
    ----------
    placement : the scene's map from mesh to scene units.
    radius : of the ball about the scene's origin that holds everything drawn, scene units.
    """
    # View is given in mesh units; the scene's camera sees scene units.
    x, y, _, w = view.matrix @ np.linalg.inv(placement.matrix)
    if np.linalg.norm(w[:3]) > 1e-12 * np.linalg.norm(y[:3]):
        size = np.linalg.norm(w[:3])
        forward = w[:3] / size
        eye = np.linalg.solve(np.stack([x[:3], y[:3], w[:3]]), -np.array([x[3], y[3], w[3]]))
        steep = np.linalg.norm(y[:3] / size)
        camera.SetParallelProjection(False)
        camera.SetViewAngle(np.degrees(2 * np.arctan(1 / steep)))
    else:
        # The inverse transpose turns the rows of a (right, up) frame into its third axis.
        forward = np.cross(y[:3], x[:3])
        forward /= np.linalg.norm(forward)
        rows = np.stack([x[:3], y[:3], forward])
        middle = np.linalg.solve(rows, -np.array([x[3], y[3], 0.0]))
        eye = middle - 4 * radius * forward
        camera.SetParallelProjection(True)
        camera.SetParallelScale(w[3] / np.linalg.norm(y[:3]))
    along = float(-eye @ forward)
    camera.SetPosition(*eye)
    camera.SetFocalPoint(*(eye + max(along, 1e-3 * radius) * forward))
    camera.SetViewUp(*(y[:3] / np.linalg.norm(y[:3])))
    far = along + radius
    camera.SetClippingRange(max(along - radius, far / 5000), far)


def mesh_units_per_pixel(view: View, points: F64) -> float:
    """Return the length that one pixel spans at the middle of `points` (p, 3)."""
    depth = float(view.depth(points.mean(axis=0)[None])[0])
    return 2 * depth / (view.size[1] * float(np.linalg.norm(view.matrix[1, :3])))


def tube(points: F64, radius: float) -> Any:
    """Return a VTK source of a round tube along a polyline (p, 3)."""
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkTubeFilter

    places = vtkPoints()
    cells = vtkCellArray()
    cells.InsertNextCell(len(points))
    for x in points:
        cells.InsertCellPoint(places.InsertNextPoint(*x))
    line = vtkPolyData()
    line.SetPoints(places)
    line.SetLines(cells)
    round_line = vtkTubeFilter()
    round_line.SetInputData(line)
    round_line.SetRadius(radius)
    round_line.SetNumberOfSides(20)
    round_line.CappingOn()
    return round_line


def beads(points: F64, radius: float) -> Any:
    """Return a VTK source of balls at `points` (p, 3)."""
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkGlyph3D
    from vtkmodules.vtkFiltersSources import vtkSphereSource

    places = vtkPoints()
    for x in points:
        places.InsertNextPoint(*x)
    cloud = vtkPolyData()
    cloud.SetPoints(places)
    ball = vtkSphereSource()
    ball.SetRadius(radius)
    ball.SetThetaResolution(24)
    ball.SetPhiResolution(16)
    copies = vtkGlyph3D()
    copies.SetInputData(cloud)
    copies.SetSourceConnection(ball.GetOutputPort())
    copies.ScalingOff()
    return copies


def draw_ink(image: Image.Image, inks: Sequence[Ink], scale: float, theme: Theme) -> None:
    """Draw lines with a thin dark halo into `image`, `scale` picture pixels a logical pixel."""
    brush = ImageDraw.Draw(image)
    for ink in inks:
        path = np.asarray(ink.path, dtype=np.float64) * scale
        if ink.closed:
            path = np.concatenate([path, path[:2]])
        points = [(float(x), float(y)) for x, y in path]
        for colour, width in ((theme.halo, INK_WIDTH + 1.6), (ROLE_COLOURS[ink.role], INK_WIDTH)):
            across = round(width * scale)
            brush.line(points, fill=rgb8(colour), width=across, joint="curve")
            for px, py in (points[0], points[-1]):
                half = across / 2
                brush.ellipse((px - half, py - half, px + half, py + half), fill=rgb8(colour))


def write_picture(picture: Image.Image, path: Path) -> None:
    """Write a picture as PNG, whole or not at all.

    Raises
    ------
    FileError
        It could not be written.
    """
    held = io.BytesIO()
    picture.save(held, "PNG")
    write_file(path, held.getvalue())


def sheet(
    pictures: Sequence[tuple[str, Image.Image]],
    columns: int,
    cell: tuple[int, int],
    title: str = "",
) -> Image.Image:
    """Return one picture with all `pictures` in rows, each over its caption.

    Parameters
    ----------
    cell : width and height that each picture is fitted into.
    """
    gap, below, above = 14, 46, 64 if title else 14
    rows = -(-len(pictures) // columns)
    width, height = cell
    whole = Image.new(
        "RGB",
        (gap + columns * (width + gap), above + rows * (height + below + gap)),
        rgb8(LIGHT.panel),
    )
    brush = ImageDraw.Draw(whole)
    if title:
        brush.text((gap + 4, 18), title, fill=rgb8(LIGHT.text), font=ImageFont.load_default(28))
    for i, (caption, picture) in enumerate(pictures):
        left = gap + (i % columns) * (width + gap)
        top = above + (i // columns) * (height + below + gap)
        fitted = picture.copy()
        fitted.thumbnail((width, height), Image.Resampling.LANCZOS)
        whole.paste(
            fitted, (left + (width - fitted.width) // 2, top + (height - fitted.height) // 2)
        )
        brush.text(
            (left + 4, top + height + 10), caption, fill=rgb8(LIGHT.text),
            font=ImageFont.load_default(20),
        )  # fmt: skip
    return whole
