"""The ghost: the original over the form, by its outlines and the slopes of its features."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from app.viewport.around import faces_about, renumbered
from app.viewport.surface import F32, Placement, Surface, unit_normals
from engine.arrays import F64, I64, distinct
from engine.mesh import Topology

# Clear where one looks straight at it and it runs along the plain form: the ghost shows outlines
# and the slopes of bumps, and hides nothing of the form, which it would cover with blotches
# wherever it pokes out. How much of a slope there is comes as the red of its vertices, and how far
# it stands off the form as the green: where the two run into each other it ends without an edge.
_ONLY_SLOPES = """//VTK::Light::Impl
  float ghostFacing = abs(normalVCVSOutput.z);
  float ghostOutline = 0.8 * (1.0 - ghostFacing) * (1.0 - ghostFacing);
  ghostOutline *= vertexColorVSOutput.g;
  float ghostSlope = 0.45 * smoothstep(0.08, 0.55, vertexColorVSOutput.r);
  gl_FragData[0].rgb = vec3(0.87, 0.90, 0.95) * (0.45 + 0.55 * ghostFacing);
  gl_FragData[0].a = max(ghostOutline, ghostSlope);
"""
Plain = tuple[I64, F64]  # ids of the region, and its base there, mesh units
_GHOST_GAP = 0.02  # scene units: below this the ghost would only flicker on the form
_FADES = 0.4  # scene units off the form within which it fades


@dataclass(frozen=True, eq=False)
class Drawing:
    """What of the original is in the picture.

    Parameters
    ----------
    used : (v,) vertices of the form.
    positions, normals : (v, 3) in the scene.
    faces : (f, 3) in positions of `used`.
    """

    used: I64
    positions: F32
    faces: I64
    normals: F32


class Ghost:
    """The part of the original that is apart from the form.

    Parameters
    ----------
    surface : the form as it is shown.
    topology : of the form.
    placement : where it is in the scene.
    original : (n, 3) mesh units.
    plain : the base of the region, from which its features rise; None where there is none.

    Attributes
    ----------
    drawn : what of it is in the picture, or None.
    """

    def __init__(
        self,
        renderer: vtkRenderer,
        surface: Surface,
        topology: Topology,
        placement: Placement,
        original: F64,
        plain: Plain | None = None,
    ) -> None:
        self._renderer = renderer
        self._of = surface
        self._topology = topology
        self._placement = placement
        self._original = original
        self._apart = np.zeros(surface.n, dtype=bool)
        self._used: I64 = np.zeros(0, dtype=np.int64)
        self._strength = np.zeros(surface.n, dtype=np.uint8)
        self._off = np.zeros(surface.n, dtype=np.uint8)
        self._features = None if plain is None else _Features(original, topology, *plain)
        self.drawn: Surface | None = None

    @property
    def seen(self) -> bool:
        """Whether anything of it is in the picture."""
        return self.drawn is not None

    @property
    def reach(self) -> float:
        """How far from the origin it is along an axis, at the most, scene units."""
        return 0.0 if self.drawn is None else self.drawn.reach

    def follow(self, ids: I64) -> None:
        """Note that the form moved at the vertices `ids`, and show what is apart now."""
        self.show(self.compared(ids))

    def compared(self, ids: I64) -> Drawing | None:
        """Return what is apart now that the form moved at the vertices `ids`; in any thread.

        None when it is the same as before: then only its slopes may be others.
        """
        gap = self._placement.to_scene(self._original[ids]) - self._of.positions[ids]
        far = np.abs(gap) > _GHOST_GAP
        apart = far[:, 0] | far[:, 1] | far[:, 2]
        self._off[ids] = 255 * _off(gap)
        if self._features is not None:
            shares = self._features.strength(self._of, self._placement)
            self._strength[self._features.ids] = shares
        if (apart == self._apart[ids]).all():
            return None
        self._apart[ids] = apart
        topology = self._topology
        faces = topology.faces[faces_about(np.flatnonzero(self._apart), topology.incidence)]
        used = distinct(faces, len(self._original))
        positions = self._placement.to_scene(self._original[used]).astype(np.float32)
        corners = renumbered(faces, used, len(self._original))
        return Drawing(used, positions, corners, unit_normals(positions, corners, len(used)))

    def show(self, drawing: Drawing | None) -> None:
        """Show what `compared` gave."""
        if drawing is not None:
            self.remove()
            if len(drawing.faces):
                self._draw(drawing)
        self._shade()

    def remove(self) -> None:
        """Take it out of the picture."""
        if self.drawn is not None:
            self._renderer.RemoveActor(self.drawn.actor)
            self.drawn = None

    def _shade(self) -> None:
        """Let every place show as much of the ghost as it is worth."""
        if self.drawn is not None:
            shares = self._strength[self._used], self._off[self._used]
            self.drawn.recolour(np.stack([*shares, shares[1]], axis=1))

    def _draw(self, drawing: Drawing) -> None:
        self.drawn = Surface(
            drawing.positions, drawing.faces, (255, 255, 255), normals=drawing.normals
        )
        actor = self.drawn.actor
        look = actor.GetProperty()
        look.SetOpacity(0.8)  # anything below 1, for VTK to draw it with what is translucent
        look.BackfaceCullingOn()
        self._used = drawing.used
        actor.PickableOff()
        actor.GetShaderProperty().AddFragmentShaderReplacement(
            "//VTK::Light::Impl", True, _ONLY_SLOPES, False
        )
        self._renderer.AddActor(actor)


class _Features:
    """How steeply the original rises from its base, in a region and one ring around it.

    Parameters
    ----------
    original : (n, 3), mesh units.
    roi, base : ids of the region (r,) and its base (r, 3), mesh units.

    Attributes
    ----------
    ids : the vertices that are looked at.
    """

    def __init__(self, original: F64, topology: Topology, roi: I64, base: F64) -> None:
        n = len(original)
        about = topology.faces[faces_about(roi, topology.incidence)]
        self.ids = distinct(about, n)
        faces = renumbered(about, self.ids, n)
        middle = original[self.ids].mean(axis=0)
        self._original = original[self.ids]
        risen = self._original - middle
        plain = risen.copy()
        plain[renumbered(roi, self.ids, n)] = base - middle
        self._normals = unit_normals(risen, faces, len(self.ids))
        self._slope = _sine(self._normals, unit_normals(plain, faces, len(self.ids)))
        # Where its ring is cut off a normal is not the true one.
        self._slope[~np.isin(self.ids, roi, kind="table")] = 0.0

    def strength(self, surface: Surface, placement: Placement) -> NDArray[np.uint8]:
        """Return how much of a feature is missing on the form as it is now, 0 to 255 for 0 to 1.

        It is the sine of the angle between original and base, or original and form if that is less:
        what has come back to the form is no feature of the ghost, nor is the form's new bend.
        """
        gap = placement.to_scene(self._original) - surface.positions[self.ids]
        slope = np.minimum(self._slope, _sine(self._normals, surface.normals[self.ids]))
        return np.asarray(255 * slope * _off(gap), dtype=np.uint8)


def _off(gap: F64 | F32) -> NDArray[Any]:
    """Return how far off the form it is, (k,) from 0 to 1, for gaps (k, 3) in scene units."""
    return np.minimum(np.sqrt(np.einsum("ij,ij->i", gap, gap)) / _FADES, 1.0)


def _sine(a: F32, b: F32) -> F32:
    """Return the sine of the angle between unit vectors (k, 3), (k,)."""
    cosine = np.einsum("ij,ij->i", a, b)
    return np.sqrt(np.clip(1 - cosine * cosine, 0, 1))
