"""Picking and lasso on the image of triangle ids, in logical pixels from the top left corner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QImage, QPainter, QPolygonF
from scipy import sparse as sp

from app.form import Form
from app.viewport.around import faces_about, ranges
from app.viewport.visibility import deepest, facing, glance, hidden, touched, visible
from engine.arrays import B1, F64, I64
from engine.view import View
from plugins.api import Hit

GLANCE = 1 << 15  # vertices that are looked at together


def inside_mask(polygon: ArrayLike, width: int, height: int, scale: float) -> B1:
    """Return which pixels (height, width), row 0 on top, have their centre inside a closed lasso.

    Where a lasso crosses itself the inside is all that it winds around.

    Parameters
    ----------
    polygon : (p, 2) logical pixels.
    scale : device pixels in one logical pixel.
    """
    image = QImage(width, height, QImage.Format.Format_Grayscale8)
    image.fill(0)
    painter = QPainter(image)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(Qt.GlobalColor.white)
    corners = np.asarray(polygon, dtype=np.float64) * scale
    painter.drawPolygon(QPolygonF([QPointF(x, y) for x, y in corners]), Qt.FillRule.WindingFill)
    painter.end()
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(height, image.bytesPerLine())
    return np.asarray(rows[:, :width] > 127)


@dataclass(frozen=True, eq=False)
class Sight:
    """What one camera sees of one form.

    Parameters
    ----------
    ids : (h, w) int32, triangle at each device pixel, -1 for none; row 0 on top.
    view : the camera, in logical pixels.
    scale : device pixels in one logical pixel.
    form : what is seen, in the units of `view`.
    faces : (f, 3).
    incidence : (n, f), which faces are around a vertex; without it all are looked through.
    """

    ids: NDArray[np.int32]
    view: View
    scale: float
    form: Form
    faces: I64
    incidence: sp.csr_array | None = None

    @property
    def ready(self) -> bool:
        """Whether the next question is answered in a moment, however large the form is."""
        return "_seen" in self.__dict__

    def prepare(self, wanted: Callable[[], bool] = lambda: True) -> None:
        """Work out what every question needs, as long as it is `wanted`; in any thread."""
        # Of neighbours on the screen the same triangles are asked for: many at once stay at hand.
        _, vertices = self._by_pixel
        seen, unsure = np.zeros(self.form.mesh.n, dtype=bool), [vertices[:0]]
        image = self._image(self.faces)
        for some in np.split(vertices, range(GLANCE, len(vertices), GLANCE)):
            if not wanted():
                return
            seen[some], open_ones = glance(some, *image)
            unsure.append(some[open_ones])
        asked = np.concatenate(unsure)
        seen[asked] = ~hidden(asked, self.screen, self.faces)
        self.__dict__["_seen"] = seen

    @cached_property
    def screen(self) -> F64:
        """Device pixels x, y (0.5: the middle of the first) and depth z/w of all vertices, (n, 3).

        A vertex behind the eye has not-a-number as its place.
        """
        return self._placed(self.form.whole.vertices)

    def screen_at(self, ids: I64) -> F64:
        """Return `screen` of the vertices `ids` alone, (k, 3)."""
        return self.screen[ids] if "screen" in self.__dict__ else self._placed(self.form.at(ids))

    def _placed(self, vertices: F64) -> F64:
        m = self.view.matrix
        h = vertices @ m[:, :3].T + m[:, 3]
        width, height = (s * self.scale for s in self.view.size)
        w = np.where(h[:, 3] > 0, h[:, 3], np.nan)
        place = np.empty((len(h), 3))
        place[:, 0] = (h[:, 0] / w + 1) * (width / 2)
        place[:, 1] = (1 - h[:, 1] / w) * (height / 2)
        place[:, 2] = h[:, 2] / w
        return place

    @cached_property
    def _in_picture(self) -> I64:
        height, width = self.ids.shape
        x, y = self.screen[:, 0], self.screen[:, 1]
        return np.flatnonzero((x >= 0) & (x < width) & (y >= 0) & (y < height))

    @cached_property
    def _pixel(self) -> NDArray[np.int32]:
        """The pixel of each vertex in the picture, counted row by row."""
        x, y = (self.screen[self._in_picture, k].astype(np.int32) for k in (0, 1))
        return np.asarray(y * np.int32(self.ids.shape[1]) + x)

    @cached_property
    def _by_pixel(self) -> tuple[NDArray[np.int32], I64]:
        """The pixels of the vertices in the picture, ascending, and which vertices these are."""
        order = np.argsort(self._pixel, kind="stable")
        return self._pixel[order], self._in_picture[order]

    def vertices_inside(self, polygon: ArrayLike, through: bool = False) -> I64:
        """Return ascending ids of the vertices inside a lasso (p, 2), the visible ones or all."""
        if len(np.asarray(polygon)) < 3:
            return np.zeros(0, dtype=np.int64)
        height, width = self.ids.shape
        mask = inside_mask(polygon, width, height, self.scale)
        return self._chosen(mask, through)

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64:
        """Return ascending ids of the vertices within `radius` px of a point: a brush's touch."""
        around = self._within(x, y, radius)
        at = self.screen[around, :2] / self.scale
        near = np.sort(around[((at - (x, y)) ** 2).sum(axis=1) <= radius**2])
        return near if through else near[self._visible(near)]

    def _within(self, x: float, y: float, reach: float) -> I64:
        """Return ids of the vertices whose pixels a square of 2 `reach` px around a point meets."""
        height, width = self.ids.shape
        (left, right), (top, bottom) = (
            np.floor((at + np.array([-reach, reach])) * self.scale).clip(-1, most).astype(int)
            for at, most in ((x, width), (y, height))
        )
        left, right, rows = max(left, 0), min(right, width - 1), np.arange(height)
        rows = rows[max(top, 0) : bottom + 1] if left <= right else rows[:0]
        pixels, vertices = self._by_pixel
        start = np.searchsorted(pixels, (rows * width + left).astype(np.int32), "left")
        end = np.searchsorted(pixels, (rows * width + right).astype(np.int32), "right")
        return vertices[ranges(start, end)]

    def _chosen(self, mask: B1, through: bool) -> I64:
        candidates = self._in_picture[mask.ravel()[self._pixel]]
        return candidates if through else candidates[self._visible(candidates)]

    def _visible(self, candidates: I64) -> B1:
        known: B1 | None = self.__dict__.get("_seen")
        if known is not None:
            return known[candidates]
        if self.incidence is None:
            mine = np.zeros(self.form.mesh.n, dtype=bool)
            mine[candidates] = True
            around = self.faces[mine[self.faces].any(axis=1)]
        else:
            around = self.faces[faces_about(candidates, self.incidence)]
        return visible(candidates, *self._image(around))

    def _image(
        self, around: I64
    ) -> tuple[NDArray[np.int32], F64, I64, B1, B1, NDArray[np.float32]]:
        """Return what `visible` asks for about vertices that have the triangles `around`."""
        outside, n = facing(self.screen, around), self.form.mesh.n
        front, back = touched(around, outside, n), touched(around, ~outside, n)
        return self.ids, self.screen, self.faces, front, back, self._deepest

    @cached_property
    def _deepest(self) -> NDArray[np.float32]:
        return deepest(self.ids, self.screen, self.faces)

    def faces_at(self, points: ArrayLike) -> I64:
        """Return the id of the triangle seen at each of many logical pixels (p, 2), (p,), or -1."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        pixel = np.floor(p * self.scale).astype(np.int64)
        height, width = self.ids.shape
        there = (pixel >= 0).all(axis=1) & (pixel[:, 0] < width) & (pixel[:, 1] < height)
        found = np.full(len(p), -1, dtype=np.int64)
        found[there] = self.ids[pixel[there, 1], pixel[there, 0]]
        return found

    def pick(self, x: float, y: float) -> Hit | None:
        """Return the face, its nearest vertex and the point on it at a logical pixel."""
        middle = int(self.faces_at((x, y))[0])
        if middle < 0:
            return None
        face, shares = self._under(x, y, middle)
        corners = self.faces[face]
        at = self.screen_at(corners)[:, :2]
        distance = np.linalg.norm(at - np.array([x, y]) * self.scale, axis=1)
        point = shares @ self.form.at(corners)
        return Hit(face, int(corners[np.argmin(distance)]), point)

    def _under(self, x: float, y: float, middle: int) -> tuple[int, F64]:
        """Return the nearest seen triangle that covers a point, and the shares of its corners.

        The image tells what is seen in the middle of a pixel; elsewhere in the pixel it may be a
        neighbour. When none covers the point, it is moved into the triangle seen in the middle.
        """
        i, j = int(np.floor(x * self.scale)), int(np.floor(y * self.scale))
        around = self.ids[max(0, j - 1) : j + 2, max(0, i - 1) : i + 2]
        found, best = middle, -np.inf
        for face in np.unique(around[around >= 0]):
            shares = self._shares(int(face), x, y)
            depth = -float(shares @ self.screen_at(self.faces[face])[:, 2])
            if shares.min() >= -1e-9 and depth > best:
                found, best = int(face), depth
        shares = np.clip(self._shares(found, x, y), 0.0, 1.0)
        return found, shares / shares.sum()

    def _shares(self, face: int, x: float, y: float) -> F64:
        """Return barycentric shares b (3,) at a pixel: P(corners' b) = (x, y), sum b = 1."""
        corners = self.form.at(self.faces[face])
        p = self.view.pixel_matrix
        rows = np.stack([p[0] - x * p[2], p[1] - y * p[2]])
        system = np.vstack([rows[:, :3] @ corners.T + rows[:, 3:], np.ones(3)])
        size = np.abs(system[:2]).max(axis=1, keepdims=True)
        system[:2] /= np.where(size > 0, size, 1.0)
        return np.asarray(np.linalg.lstsq(system, np.array([0.0, 0.0, 1.0]), rcond=None)[0])

    def faces_under(self, path: ArrayLike) -> I64:
        """Return ids of the triangles seen below a path (p, 2), in its order.

        The background is left out; a triangle comes again when the path comes back to it.
        """
        p = np.atleast_2d(np.asarray(path, dtype=np.float64))
        apart = np.linalg.norm(np.diff(p, axis=0), axis=1) * self.scale
        at = np.concatenate([[0.0], np.cumsum(np.maximum(1, np.ceil(2 * apart)))])
        dense = np.stack([np.interp(np.arange(at[-1] + 1), at, p[:, k]) for k in range(2)], axis=1)
        seen = self.faces_at(dense)
        seen = seen[seen >= 0]
        return seen[np.concatenate([[True], seen[1:] != seen[:-1]])] if len(seen) else seen
