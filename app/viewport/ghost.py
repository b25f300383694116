"""The ghost: the original, as outlines over the form, wherever the form has left it."""

from __future__ import annotations

import numpy as np
from vtkmodules.vtkRenderingCore import vtkRenderer

from app.look import rgb
from app.viewport.around import faces_about, renumbered
from app.viewport.surface import Placement, Surface
from engine.arrays import F64, I64, distinct
from engine.mesh import Topology

# Clear where one looks straight at it: the ghost shows its outlines and hides nothing of the form,
# which it would cover with blotches wherever it pokes out.
_ONLY_OUTLINES = """//VTK::Light::Impl
  float ghostTurned = 1.0 - abs(normalVCVSOutput.z);
  gl_FragData[0].a *= ghostTurned * ghostTurned;
"""
_GHOST_GAP = 0.02  # scene units: below this the ghost would only flicker on the form


class Ghost:
    """The part of the original that is apart from the form.

    Parameters
    ----------
    surface : the form as it is shown.
    topology : of the form.
    placement : where it is in the scene.
    original : (n, 3) mesh units.

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
    ) -> None:
        self._renderer = renderer
        self._of = surface
        self._topology = topology
        self._placement = placement
        self._original = original
        self._apart = np.zeros(surface.n, dtype=bool)
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
        """Note that the form moved at the vertices `ids`."""
        gap = self._placement.to_scene(self._original[ids]) - self._of.positions[ids]
        far = np.abs(gap) > _GHOST_GAP
        apart = far[:, 0] | far[:, 1] | far[:, 2]
        if (apart == self._apart[ids]).all():
            return
        self._apart[ids] = apart
        self.remove()
        topology = self._topology
        faces = topology.faces[faces_about(np.flatnonzero(self._apart), topology.incidence)]
        if len(faces):
            self._draw(faces)

    def remove(self) -> None:
        """Take it out of the picture."""
        if self.drawn is not None:
            self._renderer.RemoveActor(self.drawn.actor)
            self.drawn = None

    def _draw(self, faces: I64) -> None:
        n = len(self._original)
        used = distinct(faces, n)
        positions = self._placement.to_scene(self._original[used])
        self.drawn = Surface(positions, renumbered(faces, used, n), (255, 255, 255))
        actor = self.drawn.actor
        look = actor.GetProperty()
        look.SetOpacity(0.8)
        look.BackfaceCullingOn()
        look.SetAmbient(0.35)
        look.SetDiffuse(0.65)
        self.drawn.mapper.ScalarVisibilityOff()
        look.SetColor(*rgb("#dfe6f2"))
        actor.PickableOff()
        actor.GetShaderProperty().AddFragmentShaderReplacement(
            "//VTK::Light::Impl", True, _ONLY_OUTLINES, False
        )
        self._renderer.AddActor(actor)
