"""The door of the engine: what is no mesh is refused in words, what is one is told apart."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Mesh, MeshError
from engine.mesh import PositionsError

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


@pytest.mark.parametrize(
    ("faces", "said"),
    [
        ([[0, 1, 2, 3]], r"shape \(1, 4\)\. Triangulate"),
        (np.zeros((0, 3), int), "no faces"),
        ([[0.0, 1.0, 2.0]], "not whole numbers"),
        ([[0, 1, 4]], "vertex 4, but the vertices are numbered 0 to 3"),
        ([[0, 1, -1]], "vertex -1, but the vertices are numbered 0 to 3"),
    ],
)
def test_faces_that_are_none_are_refused(faces: object, said: str) -> None:
    with pytest.raises(MeshError, match=said):
        Mesh(CORNERS, faces)


@pytest.mark.parametrize(
    ("vertices", "said"),
    [
        (CORNERS[:, :2], r"shape \(4, 2\)"),
        (np.where(CORNERS == 1, np.nan, CORNERS), "3 of 4 vertices"),
        (CORNERS + np.array([np.inf, 0, 0]), "4 of 4 vertices"),
    ],
)
def test_positions_that_are_none_are_refused(vertices: np.ndarray, said: str) -> None:
    with pytest.raises(PositionsError, match=said):
        Mesh(vertices, FACES)
    with pytest.raises(PositionsError, match=said):
        Mesh(CORNERS, FACES).with_vertices(vertices)


def test_positions_of_another_mesh_are_refused() -> None:
    with pytest.raises(PositionsError, match="3 positions were given for 4"):
        Mesh(CORNERS, FACES).with_vertices(CORNERS[:3])


def test_the_digest_tells_positions_and_faces_apart() -> None:
    mesh = Mesh(CORNERS, FACES)
    assert mesh.digest == Mesh(CORNERS.tolist(), np.array(FACES, dtype=np.int32)).digest
    others = (
        mesh.with_vertices(np.nextafter(CORNERS, 2)),
        Mesh(CORNERS, FACES[1:] + FACES[:1]),
        Mesh(CORNERS, [face[::-1] for face in FACES]),
    )
    assert len({mesh.digest, *(other.digest for other in others)}) == 4


def test_what_was_given_can_be_changed_and_the_mesh_cannot() -> None:
    given = CORNERS.copy()
    mesh = Mesh(given, FACES)
    given[0] = 9.0
    assert (mesh.vertices == CORNERS).all()
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_the_other_positions_keep_the_faces_themselves() -> None:
    mesh = Mesh(CORNERS, FACES)
    moved = mesh.with_vertices(2 * CORNERS)
    assert moved.faces is mesh.faces
    assert moved.topology is mesh.topology
    assert (moved.vertices == 2 * CORNERS).all()
    assert moved.diagonal == pytest.approx(2 * mesh.diagonal)
