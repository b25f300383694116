"""Every file of the shared meshes opens with the right result or is refused with its reason."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from engine import FileError, Imported, open_file, save

CLEAN = {
    "armadillo.obj": (14587, 29170),
    "boot.obj": (19931, 39906),
    "bunny_hr.obj": (29834, 59664),
    "fish.obj": (10786, 21568),
    "goblet_vase.stl": (5457, 10910),
    "hammer.obj": (30082, 60160),
    "hand_closed.obj": (7993, 15982),
    "mountain_open.obj": (25600, 50562),
    "penguin_hr.obj": (13442, 26880),
    "spot.obj": (11533, 23062),
    "wingnut.obj": (3047, 6090),
}
FULL = (2930, 5856)

# What must be in the mesh after cleanup, and what the report must speak of.
OPENED: dict[str, tuple[tuple[int, int], str]] = {
    "r01_triple_vierbein.obj": ((120, 108), "more than two faces taken apart"),
    "r02_hourglass_ico.obj": ((24, 40), "touch in a point"),
    "r03_moebius.obj": ((280, 448), "only one side"),
    "r04_openscad-nonmanifold-crash.obj": ((717, 1442), "without area"),
    "r05_self_intersectA.obj": ((8582, 17160), "Nothing"),
    "r14_busted.STL": ((1941, 3878), "Nothing"),
    "r15_box_UTF16BE.obj": ((8, 12), "UTF-16"),
    "r25_wallhole.obj": ((35, 66), "57 vertices at the very place"),
    "r40_scan_plasticVase.ply": ((18264, 35708), "7 edges with more than two faces"),
    "r40_scan_seaVase.ply": ((18155, 35483), "21 edges with more than two faces"),
    "s01_nonmanifold_edge.obj": ((11, 13), "1 edge with more than two faces"),
    "s02_nonmanifold_vertex.obj": ((16, 24), "1 vertex where surfaces touch"),
    "s03_duplicate_vertices_faces.obj": (FULL, "11,712 faces that repeated.*66.7%"),
    "s04_repeated_index_faces.obj": ((2933, 5806), "50 faces that named a vertex twice"),
    "s05_zero_area.obj": (FULL, "56 faces without area mended"),
    "s06_inconsistent_winding.obj": (FULL, "1,952 faces turned"),
    "s07_inverted_all.obj": (FULL, "inside out"),
    "s08_500_tiny_components.obj": ((4930, 7856), "Nothing"),
    "s09_isolated_vertices.obj": (FULL, "1,000 vertices that no face uses"),
    "s11_many_holes.obj": ((3001, 5556), "71 vertices where surfaces touch"),
    "s12_stl_soup.stl": (FULL, "Nothing"),
    "s14_self_intersect.obj": ((5860, 11712), "Nothing"),
    "s20_nan.obj": ((2927, 5838), "3 vertices left out.*18 faces"),
    "s21_inf.obj": ((2928, 5844), "2 vertices left out.*12 faces"),
    "s22_nan_binary.ply": ((2927, 5838), "3 vertices left out.*18 faces"),
    "s23_nan.stl": ((2927, 5838), "left out.*18 faces"),
    "s24_huge_coords.obj": (FULL, "Nothing"),
    "s27_tiny_scale.obj": (FULL, "Nothing"),
    "s30_index_out_of_range.obj": (FULL, "1 face left out"),
    "s31_index_huge.obj": (FULL, "2 faces left out"),
    "s32_index_zero.obj": (FULL, "1 face left out"),
    "s33_index_negative_valid.obj": (FULL, "Nothing"),
    "s34_index_negative_oob.obj": (FULL, "1 face left out"),
    "s35_index_oob.ply": (FULL, "1 face left out"),
    "s37_index_oob.off": (FULL, "1 face left out"),
    "s40_ngon_5000.obj": ((5000, 4998), "1 polygon"),
    "s42_face_1_2_verts.obj": ((8, 12), "2 faces with fewer than three corners"),
    "s66_count_low.stl": (FULL, "announces 10 triangles.*holds 5,856"),
    "s70_utf16.obj": (FULL, "UTF-16"),
    "s72_crlf.obj": (FULL, "Nothing"),
    "s73_cr_only.obj": (FULL, "Nothing"),
    "s76_backslash_cont.obj": ((8, 12), "Nothing"),
    "s79_binary_stl_solid_header.stl": (FULL, "Nothing"),
    "s84_NOEXT": ((8, 12), "OBJ"),
    "s85_wrong_ext.stl": (FULL, "OBJ"),
    "s87_EXT.OBJ": (FULL, "Nothing"),
    "s88_mtl_missing.obj": (FULL, "Nothing"),
    "s89_mtl_traversal.obj": ((8, 12), "Nothing"),
}

REFUSED = {
    "r16_OutOfMemory.off": "announces 353,535,235,358 vertices",
    "r17_crash-30d6.ply": "header does not end",
    "r22_BoxWithInfinites.glb": "not be finite",
    "r23_RecursiveNodes.gltf": "holds itself",
    "s25_huge_overflow.obj": r"coordinates up to 1\.05e\+200",
    "s28_denormal.obj": "a size of 1.72e-310",
    "s50_zero_bytes.obj": "is empty",
    "s51_zero_bytes.ply": "is empty",
    "s52_zero_bytes.stl": "is empty",
    "s53_zero_bytes.off": "is empty",
    "s54_zero_bytes.3mf": "is empty",
    "s54b_zero_bytes.glb": "is empty",
    "s54c_zero_bytes.dae": "is empty",
    "s55_no_faces.obj": "holds no faces",
    "s56_no_vertices.obj": "holds no vertices",
    "s57_truncated.obj": "holds no faces",
    "s58_truncated.ply": "the file ends before",
    "s59_truncated.stl": "bytes for 798",
    "s61_bomb_vertices.ply": "announces 4,000,000,000",
    "s62_bomb_faces.ply": "announces 2,000,000,000",
    "s64_count_low.ply": "left over",
    "s65_bomb.stl": "announces 4,294,967,295 triangles",
    "s67_bomb.off": "announces 2,000,000,000",
    "s69_bomb_1e9.ply": "announces 1,000,000,000",
    "s69b_bomb_5e7.ply": "announces 50,000,000",
    "s77_binary_as_obj.obj": "binary data",
    "s78_html_as_stl.stl": "a web page",
    "s90_zip_bomb.3mf": "would unpack from 0.3 MB to 315 MB",
    "s91_billion_laughs.dae": "declares entities",
    "s92_deep_nesting.x3d": "nested more than 200 deep",
    "s94_directory.obj": "is a folder",
}


def assert_sound(found: Imported) -> None:
    for mesh in (found.mesh, found.as_read):
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < mesh.n


def assert_says_it(name: str, text: str) -> None:
    """Assert that a refusal names the file, states a fact and gives a remedy."""
    assert name in text
    assert len(re.findall(r"[.;](?= [A-Z“]|$)", text)) >= 2, text
    assert "Traceback" not in text
    assert "not foreseen" not in text


@pytest.mark.parametrize("name", sorted(CLEAN))
def test_a_clean_file_comes_out_as_it_is(shared_meshes: Path, name: str) -> None:
    found = open_file(shared_meshes / "clean" / name)
    assert (found.mesh.n, len(found.mesh.faces)) == CLEAN[name]
    assert not found.report.repairs
    assert not found.report.lost
    assert not found.report.warnings
    assert found.mesh is found.as_read


@pytest.mark.parametrize("name", sorted(n for n in CLEAN if n.endswith(".obj")))
def test_vertices_and_faces_keep_their_order_and_bits(shared_meshes: Path, name: str) -> None:
    path = shared_meshes / "clean" / name
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(w) for w in words[1:4]] for words in lines if words[:1] == ["v"]]
    faces = [[int(w.split("/")[0]) - 1 for w in words[1:]] for words in lines if words[:1] == ["f"]]
    mesh = open_file(path).mesh
    assert (mesh.vertices == np.array(vertices)).all()
    assert (mesh.faces == np.array(faces)).all()


@pytest.mark.parametrize("name", sorted(OPENED))
def test_a_damaged_file_opens_with_the_right_result(shared_meshes: Path, name: str) -> None:
    size, words = OPENED[name]
    found = open_file(shared_meshes / "nasty" / name)
    assert_sound(found)
    assert (found.mesh.n, len(found.mesh.faces)) == size
    assert re.search(words, "\n".join(found.report.lines()), re.DOTALL), found.report.lines()
    repaired = found.mesh is not found.as_read
    assert repaired == bool(found.report.repairs)


@pytest.mark.parametrize("name", sorted(OPENED))
def test_cleanup_moves_nothing_and_is_done_once(
    shared_meshes: Path, tmp_path: Path, name: str
) -> None:
    found = open_file(shared_meshes / "nasty" / name)
    held = {row.tobytes() for row in found.as_read.vertices}
    assert all(row.tobytes() in held for row in found.mesh.vertices)
    save(found.mesh, tmp_path / "again.ply")
    again = open_file(tmp_path / "again.ply")
    assert again.mesh.digest == found.mesh.digest, again.report.lines()
    assert not again.report.repairs


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_a_hopeless_file_is_refused_with_its_reason(shared_meshes: Path, name: str) -> None:
    with pytest.raises(FileError, match=REFUSED[name]) as refusal:
        open_file(shared_meshes / "nasty" / name)
    assert_says_it(name, str(refusal.value))


def test_no_shared_file_is_forgotten(shared_meshes: Path) -> None:
    nasty = {p.name for p in (shared_meshes / "nasty").iterdir()} - {"fuzz"}
    assert nasty == set(OPENED) | set(REFUSED)
    assert {p.name for p in (shared_meshes / "clean").iterdir()} == set(CLEAN)


def test_files_that_kill_the_native_reader_cost_a_sentence_at_most(shared_meshes: Path) -> None:
    opened = 0
    paths = sorted((shared_meshes / "nasty" / "fuzz").iterdir())
    for path in paths:
        try:
            found = open_file(path)
        except FileError as refusal:
            assert_says_it(path.name, str(refusal))
            continue
        opened += 1
        assert_sound(found)
        assert found.report.lost, path.name
    assert 0 < opened < len(paths)
