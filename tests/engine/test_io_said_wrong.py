"""A file that says one thing and holds another is refused in the words of that very place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from engine import FileError, open_file, save
from engine.files.gltf import check_gltf
from tests.engine.test_io_open import PIECE, model_3mf
from tests.engine.test_io_scenes import dae, opened, refusal
from tests.soak.export_kills import sheet

SQUARE = b"""ply
format ascii 1.0
element vertex 4
property double x
property double y
property double z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
1 1 0
0 1 0
%s
"""


def moved_by(words: str) -> bytes:
    return model_3mf(PIECE, f'<item objectid="1" transform="{words}"/>')


@pytest.mark.parametrize("words", ["1 0 0 0 1 0 0 0 1 0 0", "1 0 0 0 1 0 0 0 1 0 0 0 0", "1 x"])
def test_a_3mf_transform_is_twelve_numbers(words: str) -> None:
    assert "a transform is not twelve numbers" in refusal(moved_by(words), "a.3mf")


@pytest.mark.parametrize(
    ("node", "why"),
    [
        ("<translate>1 2</translate>", "a “translate” in it is not 3 numbers"),
        ("<translate>1 2 3 4</translate>", "a “translate” in it is not 3 numbers"),
        ("<translate>1 2 1e999</translate>", "a “translate” in it is not 3 numbers"),
        ("<matrix>1 0 0 0</matrix>", "a “matrix” in it is not 16 numbers"),
    ],
)
def test_a_dae_node_is_placed_by_as_many_numbers_as_it_takes(node: str, why: str) -> None:
    nodes = f'<node>{node}<instance_geometry url="#g"/></node>'
    assert why in refusal(dae(nodes=nodes), "a.dae")


@pytest.mark.parametrize(
    "face", [b"-1 0 1 2", b"3.5 0 1 2", b"1e12 0 1 2", b"nan 0 1 2", b"4 0 1 2", b"3 0 1 2 3"]
)
def test_a_text_ply_list_has_the_length_that_it_announces(face: bytes) -> None:
    assert "line 5 behind the header does not hold" in refusal(SQUARE % face, "a.ply")


@pytest.mark.parametrize("suffix", [".ply", ".3mf", ".glb", ".dae", ".x3d"])
def test_a_name_that_promises_another_content_is_told(suffix: str) -> None:
    name = f"a{suffix}"
    assert "although its name says so" in refusal(b"what is in here is no mesh. " * 20, name)


def test_a_name_alone_makes_no_stl() -> None:
    assert "although its name says so" in refusal(b"nothing", "a.stl")


def test_faces_before_any_vertex_are_obj_text() -> None:
    text = "# written the other way round\nf 1 2 3\n" + "# so it is\n" * 8000
    text += "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    found = refusal(text.replace("f 1 2 3", "f 1 2 9"), "a.txt")
    assert "format that can be read" not in found


def test_a_comma_beside_points_is_not_taken_for_a_decimal_comma() -> None:
    text = "v 0,5 0 0\nv 1.5 0 0\nv 0 1 0\nf 1 2 3\n"
    assert "coordinates are not finite numbers" in refusal(text, "a.obj")


def glb(kind: bytes, announced: int, text: bytes) -> bytes:
    return (
        b"glTF"
        + (2).to_bytes(4, "little")
        + (20 + len(text)).to_bytes(4, "little")
        + announced.to_bytes(4, "little")
        + kind
        + text
    )


@pytest.mark.parametrize(("kind", "more"), [(b"JSOM", 0), (b"JSON", 1), (b"JSON", 1 << 20)])
def test_a_glb_begins_with_its_description(kind: bytes, more: int) -> None:
    text = json.dumps({"asset": {"version": "2.0"}}).encode()
    with pytest.raises(FileError, match="its first part is not its description"):
        check_gltf(glb(kind, len(text) + more, text), "a.glb")


def test_an_stl_is_written_with_the_normals_of_its_faces(tmp_path: Path) -> None:
    mesh = sheet(0)
    save(mesh, tmp_path / "a.stl")
    record = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]
    rows = np.frombuffer((tmp_path / "a.stl").read_bytes(), record, offset=84)
    a, b, c = np.moveaxis(rows["corners"].astype(float), 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert len(rows) == len(mesh.faces)
    assert np.allclose(rows["normal"], normal, atol=1e-5)
    assert open_file(tmp_path / "a.stl").mesh.n == mesh.n


@pytest.mark.parametrize("face", ["3 0 1", "0", "-3 0 1 2", "2.5 0 1 2"])
def test_an_off_face_has_as_many_corners_as_it_counts(face: str) -> None:
    text = f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{face}\n"
    assert "line 6 is not a face" in refusal(text, "a.off")


@pytest.mark.parametrize("keyword", ["4OFF", "nOFF", "STCN4nOFF"])
def test_an_off_file_of_another_dimension_is_told(keyword: str) -> None:
    text = f"{keyword}\n3 1 0\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n"
    assert "another dimension than three" in refusal(text, "a.off")


def glb_of(length: int, binary: bytes) -> bytes:
    text = json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": length}]}).encode()
    text += b" " * (-len(text) % 4)
    rest = len(binary).to_bytes(4, "little") + b"BIN\0" + binary
    whole = glb(b"JSON", len(text), text + rest)
    assert int.from_bytes(whole[8:12], "little") == len(whole)
    return whole


def test_a_glb_holds_as_many_bytes_as_it_announces() -> None:
    assert check_gltf(glb_of(8, bytes(8)), "a.glb") == (0, [])
    with pytest.raises(FileError, match="it announces more data than it holds"):
        check_gltf(glb_of(9, bytes(8)), "a.glb")


def test_a_unit_is_named_only_where_there_is_one() -> None:
    assert "The file's unit is inch; the numbers were kept" in opened(dae(), "a.dae")[2]
    unnamed = dae().replace('<unit name="inch" meter="0.0254"/>', "")
    assert unnamed != dae()
    assert "unit" not in opened(unnamed, "a.dae")[2]


def test_an_obj_that_may_have_lost_vertices_warns_of_it(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
    for name, more, warned in (("whole", "", False), ("lost", "f 1 2 9\n", True)):
        path = tmp_path / f"{name}.obj"
        path.write_text(text + more)
        lines = " ".join(open_file(path).report.lines())
        assert ("The file may have lost vertices" in lines) == warned
