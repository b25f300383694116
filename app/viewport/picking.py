"""Picking and lasso on the image of triangle ids, in logical pixels from the top left corner."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QImage, QPainter, QPolygonF

from engine.arrays import B1, F64, I64
from engine.view import View
from plugins.api import Hit


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
    vertices : (n, 3) positions in the units of `view`.
    normals : (n, 3) unit normals.
    faces : (f, 3).
    """

    ids: NDArray[np.int32]
    view: View
    scale: float
    vertices: NDArray[Any]
    normals: NDArray[Any]
    faces: I64

    @cached_property
    def screen(self) -> F64:
        """Device pixels x, y (0.5 is the middle of the first) and depth z/w of all vertices, (n, 3).

        A vertex behind the eye has not-a-number as its place.
        """
        m = self.view.matrix
        h = self.vertices @ m[:, :3].T + m[:, 3]
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

    def vertices_inside(self, polygon: ArrayLike, through: bool = False) -> I64:
        """Return ascending ids of the vertices inside a lasso (p, 2), the visible ones or all."""
        if len(np.asarray(polygon)) < 3:
            return np.zeros(0, dtype=np.int64)
        height, width = self.ids.shape
        mask = inside_mask(polygon, width, height, self.scale)
        return self._chosen(mask, through)

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64:
        """Return ascending ids of the vertices within `radius` px of a point: a brush's touch."""
        at = self.screen[self._in_picture, :2] / self.scale
        near = self._in_picture[((at - (x, y)) ** 2).sum(axis=1) <= radius**2]
        return near if through else near[self._visible(near)]

    def _chosen(self, mask: B1, through: bool) -> I64:
        candidates = self._in_picture
        pixel = self.screen[candidates, :2].astype(np.int64)
        candidates = candidates[mask[pixel[:, 1], pixel[:, 0]]]
        return candidates if through else candidates[self._visible(candidates)]

    def _visible(self, candidates: I64) -> B1:
        """Whether each candidate is seen: a triangle at it is, or it is not behind what is seen.

        Hidden vertices just behind a silhouette lie at the depth of what is seen around them; their
        normals point away and give them away.
        """
        height, width = self.ids.shape
        place = self.screen[candidates]
        px, py = place[:, 0].astype(np.int64), place[:, 1].astype(np.int64)
        seen = np.zeros(len(candidates), dtype=bool)
        for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            left = np.flatnonzero(~seen)
            qx, qy = px[left] + dx, py[left] + dy
            there = (qx >= 0) & (qx < width) & (qy >= 0) & (qy < height)
            left, qx, qy = left[there], qx[there], qy[there]
            face = self.ids[qy, qx]
            left, face = left[face >= 0], face[face >= 0]
            corners = self.faces[face]
            own = (corners == candidates[left, None]).any(axis=1)
            front = self._on_plane(place[left], corners, dx == 0 and dy == 0)
            facing = self._turned_alike(candidates[left], face)
            seen[left[own | (front & facing)]] = True
        return seen

    def _on_plane(self, place: NDArray[Any], corners: I64, centre: bool) -> B1:
        """Whether each place is not behind the plane of the triangle `corners` seen near it."""
        a, b, c = (self.screen[corners[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        flat = np.abs(normal[:, 2]) > 1e-12
        slope = np.where(flat, normal[:, 2], 1.0)
        depth = a[:, 2] - ((place[:, :2] - a[:, :2]) * normal[:, :2]).sum(axis=1) / slope
        most = np.maximum(np.maximum(a[:, 2], b[:, 2]), c[:, 2])
        least = np.minimum(np.minimum(a[:, 2], b[:, 2]), c[:, 2])
        # Outside its triangle a steep plane runs away; what is seen lies within its corners' depths.
        limit = np.clip(np.where(flat, depth, most), least, most)
        return np.asarray(place[:, 2] <= limit + 1e-6)

    def _turned_alike(self, vertices: I64, face: NDArray[Any]) -> B1:
        """Whether each vertex's normal faces the eye as the triangle seen at its pixel does."""
        toward = self._toward_eye(self.vertices[vertices])
        vertex_side = (self.normals[vertices] * toward).sum(axis=1)
        a, b, c = (self.screen[self.faces[face, k], :2] for k in range(3))
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        # y runs down, so a triangle seen from outside has a negative area.
        return np.asarray(vertex_side * np.where(area <= 0, 1.0, -1.0) > 0.0)

    @cached_property
    def eye(self) -> F64 | None:
        """The eye's position (3,), or None when the view is orthographic."""
        w = self.view.matrix[3]
        if np.linalg.norm(w[:3]) <= 1e-12 * abs(w[3]):
            return None
        m = self.view.matrix[[0, 1, 3]]
        return np.linalg.solve(m[:, :3], -m[:, 3])

    def _toward_eye(self, points: NDArray[Any]) -> F64:
        if self.eye is not None:
            return np.asarray(self.eye - points)
        rows = self.view.matrix[:2, :3]
        forward = np.cross(rows[0], rows[1])
        return np.broadcast_to(forward / np.linalg.norm(forward), points.shape)

    def face_at(self, x: float, y: float) -> int:
        """Return the id of the triangle seen at a logical pixel, or -1."""
        height, width = self.ids.shape
        i, j = int(np.floor(x * self.scale)), int(np.floor(y * self.scale))
        return int(self.ids[j, i]) if 0 <= i < width and 0 <= j < height else -1

    def pick(self, x: float, y: float) -> Hit | None:
        """Return the face, its nearest vertex and the point on it at a logical pixel."""
        face = self.face_at(x, y)
        if face < 0:
            return None
        point = self._on_face(face, x, y)
        corners = self.faces[face]
        distance = np.linalg.norm(self.screen[corners, :2] - np.array([x, y]) * self.scale, axis=1)
        return Hit(face, int(corners[np.argmin(distance)]), point)

    def _on_face(self, face: int, x: float, y: float) -> F64:
        """Return the point (3,) of `face` that projects to a pixel, held within the triangle."""
        corners = np.asarray(self.vertices[self.faces[face]], dtype=np.float64)
        p = self.view.pixel_matrix
        rows = np.stack([p[0] - x * p[2], p[1] - y * p[2]])
        # Barycentric b with rows . (corners^T b, 1) = 0 and sum b = 1.
        system = np.vstack([rows[:, :3] @ corners.T + rows[:, 3:], np.ones(3)])
        scale = np.abs(system[:2]).max(axis=1, keepdims=True)
        system[:2] /= np.where(scale > 0, scale, 1.0)
        b = np.linalg.lstsq(system, np.array([0.0, 0.0, 1.0]), rcond=None)[0]
        b = np.clip(b, 0.0, 1.0)
        return np.asarray(corners.T @ (b / b.sum()))

    def faces_under(self, path: ArrayLike) -> I64:
        """Return ids of the triangles seen below a path (p, 2), in its order.

        The background is left out; a triangle comes again when the path comes back to it.
        """
        p = np.atleast_2d(np.asarray(path, dtype=np.float64)) * self.scale
        steps = np.maximum(1, np.ceil(2 * np.linalg.norm(np.diff(p, axis=0), axis=1))).astype(int)
        at = np.concatenate([[0.0], np.cumsum(steps)])
        dense = np.stack([np.interp(np.arange(at[-1] + 1), at, p[:, k]) for k in range(2)], axis=1)
        pixel = np.floor(dense).astype(np.int64)
        height, width = self.ids.shape
        there = (pixel >= 0).all(axis=1) & (pixel[:, 0] < width) & (pixel[:, 1] < height)
        pixel = pixel[there]
        seen = self.ids[pixel[:, 1], pixel[:, 0]]
        seen = seen[seen >= 0].astype(np.int64)
        return seen[np.concatenate([[True], seen[1:] != seen[:-1]])] if len(seen) else seen
