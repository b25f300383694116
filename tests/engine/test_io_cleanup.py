"""Cleanup: what belongs together is joined, what only touches is not, and nothing moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine import Mesh, open_file, save
from engine.files.defects import Defects, fans_apart, find_defects, joined
from tests.soak.export_kills import sheet

SOUND = Defects(0, 0, 0, 0, 0, 0, 0, 0, False)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
CUBE_FACES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])


def cleaned(folder: Path, vertices: np.ndarray, faces: np.ndarray) -> tuple[Mesh, dict[str, int]]:
    save(Mesh(vertices, faces), folder / "a.ply")
    found = open_file(folder / "a.ply")
    return found.mesh, {c.what: c.vertices or c.faces for c in found.report.repairs}


def test_a_sound_solid_has_no_defect() -> None:
    assert find_defects(CUBE, CUBE_FACES) == SOUND


@given(
    seed=st.integers(0, 10_000), share=st.floats(0.05, 1.0), scale=st.sampled_from([1e-6, 1, 1e6])
)
@settings(max_examples=40, deadline=None)
def test_torn_corners_are_joined_again(seed: int, share: float, scale: float) -> None:
    whole = sheet(0, 9)
    rng = np.random.default_rng(seed)
    torn = np.flatnonzero(rng.random(whole.faces.size) < share)
    faces = whole.faces.ravel().copy()
    vertices = np.vstack([whole.vertices, whole.vertices[faces[torn]]]) * scale
    faces[torn] = whole.n + np.arange(len(torn))
    shuffle = rng.permutation(len(vertices))
    back = np.argsort(shuffle)
    together = joined(vertices[shuffle], back[faces].reshape(-1, 3))
    assert len(np.unique(together)) == whole.n
    assert (vertices[shuffle][together] == (whole.vertices * scale)[whole.faces]).all()


@given(seed=st.integers(0, 10_000), k=st.integers(2, 30))
@settings(max_examples=60, deadline=None)
def test_taking_apart_leaves_no_edge_with_three_fans(seed: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    faces = np.array([rng.choice(8, 3, replace=False) for _ in range(k)])
    parted, copied = fans_apart(faces, 8)
    vertices = rng.random((8, 3))
    doubled = np.vstack([vertices, vertices[copied]])
    assert (doubled[parted] == vertices[faces]).all()
    before, after = find_defects(vertices, faces), find_defects(doubled, parted)
    assert after.nonmanifold_edges <= before.nonmanifold_edges
    # It is done once: what was taken apart is neither joined again nor parted further.
    assert len(fans_apart(parted, len(doubled))[1]) == 0


def test_solids_that_touch_in_a_side_an_edge_or_a_corner_stay_two(tmp_path: Path) -> None:
    for offset in ((1, 0, 0), (1, 1, 0), (1, 1, 1)):
        vertices = np.vstack([CUBE, CUBE + np.array(offset)])
        faces = np.vstack([CUBE_FACES, CUBE_FACES + 8])
        mesh, repairs = cleaned(tmp_path, vertices, faces)
        assert repairs == {}
        assert (mesh.n, len(mesh.faces)) == (16, 24)


def test_solids_welded_at_an_edge_are_taken_apart(tmp_path: Path) -> None:
    vertices, index = np.unique(
        np.vstack([CUBE, CUBE + np.array([1, 1, 0])]), axis=0, return_inverse=True
    )
    faces = index.ravel()[np.vstack([CUBE_FACES, CUBE_FACES + 8])]
    mesh, repairs = cleaned(tmp_path, vertices, faces)
    assert repairs == {"nonmanifold_edges": 2}
    assert find_defects(mesh.vertices, mesh.faces) == SOUND
    assert len(np.unique(mesh.topology.components)) == 2


def test_a_copy_on_top_of_a_solid_goes(tmp_path: Path) -> None:
    mesh, repairs = cleaned(
        tmp_path, np.vstack([CUBE, CUBE]), np.vstack([CUBE_FACES, CUBE_FACES + 8])
    )
    assert repairs == {"duplicate_faces": 12, "unreferenced_vertices": 8}
    assert mesh.digest == Mesh(CUBE, CUBE_FACES).digest


@pytest.mark.parametrize(
    ("copies", "size", "warned"),
    [(30, 1e-3, ["number of faces"]), (1, 0.4, ["surface's area"]), (20, 0.01, []),
     (60, 0.3, ["number of faces", "surface's area"])],
)  # fmt: skip
def test_cleanup_that_changes_much_warns(
    copies: int, size: float, warned: list[str], tmp_path: Path
) -> None:
    """Beyond 2 % of the faces or 1 % of the area; 1,250 faces lie in the sheet of area 1."""
    t = np.linspace(0, 1, 26)
    x, y = (a.ravel() for a in np.meshgrid(t, t))
    first = (np.arange(25)[:, None] * 26 + np.arange(25)).ravel()
    quads = np.column_stack([first, first + 1, first + 27, first + 26])
    # Triangles beside the sheet that are there twice, of legs `size` each.
    corners = np.array([[0, 0, 0], [size, 0, 0], [0, size, 0]])
    beside = (corners + np.arange(copies)[:, None, None] * [0, 0, 1.0] + [2, 0, 0]).reshape(-1, 3)
    twice = np.arange(3 * copies).reshape(-1, 3) + 676
    vertices = np.vstack([np.column_stack([x, y, 0 * x]), beside])
    faces = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], twice, twice])
    save(Mesh(vertices, faces), tmp_path / "a.ply")
    found = open_file(tmp_path / "a.ply")
    assert [c.faces for c in found.report.repairs] == [copies]
    assert len(found.report.warnings) == len(warned)
    for words, told in zip(warned, found.report.warnings, strict=True):
        assert words in told


def test_a_hollow_solid_keeps_its_inner_side(tmp_path: Path) -> None:
    vertices = np.vstack([CUBE, CUBE * 0.5 + 0.25])
    faces = np.vstack([CUBE_FACES, CUBE_FACES[:, ::-1] + 8])
    mesh, repairs = cleaned(tmp_path, vertices, faces)
    assert repairs == {}
    assert (mesh.faces == faces).all()


@pytest.mark.parametrize("thin", [1e-3, 1e-6])
def test_a_thin_triangle_is_no_defect(tmp_path: Path, thin: float) -> None:
    vertices = np.array([[0, 0, 0], [2, 0, 0], [1, thin, 0], [1, -1, 0.0]])
    mesh, repairs = cleaned(tmp_path, vertices, np.array([[0, 1, 2], [1, 0, 3]]))
    assert repairs == {}
    assert mesh.n == 4
