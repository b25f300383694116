"""Behind the outline: whether a region ends where the form turns away from the eye."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from plugins.api import B1, I64, Context, Mesh, View, grown

BESIDE, MANY = 0.3, 0.3  # of a curve's length, of its anchors: when the region ends beside it
BACK = 0.25  # of the region about a curve: when so much is turned away, it goes on behind
ASIDE = 0.35  # cosine to the curve: what lies more along it is beyond its end, not beside it
AT_OUTLINE = 0.2  # of the ring about a region: when so much is turned away, it ends at the outline


def ends_at_outline(context: Context, roi: I64) -> bool:
    """Whether a region ends at the outline of the form: much of what is beside it is turned away.

    A curve that moves the outline would leave there what lies behind it.
    """
    outside = _beside(context.shown, roi)
    if len(outside) == 0:
        return False
    return bool(_turned_away(context.shown, outside, context.view).mean() > AT_OUTLINE)


def ends_behind(context: Context, anchors: I64, roi: I64) -> bool:
    """Whether the region ends beside a curve on the outline of the form, out of sight.

    Then the form cannot follow the curve evenly: what lies behind the outline stays. It is so where
    vertices outside the region that are turned away from the eye lie beside many anchors, nearer
    than a share of the curve's length, and few of the region's own do. What lies beyond its ends
    does not count.
    """
    mesh, view = context.shown, context.view
    outside = _beside(mesh, roi)
    if len(outside) == 0:
        return False
    hidden = mesh.vertices[outside[_turned_away(mesh, outside, view)]]
    curve = mesh.vertices[anchors]
    if len(hidden) == 0 or len(curve) < 2:
        return False
    length = float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())
    reach = BESIDE * length
    away = cKDTree(curve).query(mesh.vertices[roi], distance_upper_bound=reach)[0]
    own = roi[away < reach]
    if _turned_away(mesh, own, view).mean() > BACK:
        return False
    along = np.gradient(curve, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    to = hidden[None, :, :] - curve[:, None, :]
    away = np.linalg.norm(to, axis=2)
    aside = np.abs(np.einsum("chk,ck->ch", to, along)) < ASIDE * away
    return bool((aside & (away < BESIDE * length)).any(axis=1).mean() > MANY)


def _beside(mesh: Mesh, roi: I64) -> I64:
    """Return the vertices next to a region, ascending."""
    beside = np.zeros(mesh.n, dtype=bool)
    beside[grown(mesh.topology, roi)] = True
    beside[roi] = False
    return np.flatnonzero(beside)


def _turned_away(mesh: Mesh, ids: I64, view: View) -> B1:
    """Mask (i,) of the vertices `ids`, ascending, where the surface faces away from the eye."""
    wanted = np.zeros(mesh.n, dtype=bool)
    wanted[ids] = True
    faces = mesh.faces[mesh.topology.faces_about(ids)]
    a, b, c = (view.project(mesh.vertices[corner]) for corner in faces.T)
    u, v = b - a, c - a
    # Twice the area in the picture; y runs down, so what faces the eye has less than nothing.
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    seen = np.zeros(len(ids))
    for corner in faces.T:
        kept = wanted[corner]
        np.add.at(seen, np.searchsorted(ids, corner[kept]), area[kept])
    return np.asarray(seen > 0)
