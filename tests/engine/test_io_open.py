"""Opening: the file's own vertices to the last bit, and every deviation from the file is said."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest

from engine import Cancelled, FileError, Run, open_file
from engine.files.polygons import triangulate
from engine.io import MEMORY_LIMIT, estimate
from tests.engine.test_io_shared import assert_says_it
from tests.soak.mutations import grid, pack_3mf, seeds

SEEDS = seeds()


def write(folder: Path, name: str, data: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def tetrahedron(scale: float = 1.0, offset: float = 0.0) -> str:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    text = "".join(f"v {x * scale + offset!r} {y * scale!r} {z * scale!r}\n" for x, y, z in points)
    return text + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.mark.parametrize("name", sorted(SEEDS))
def test_every_format_gives_the_same_sheet(tmp_path: Path, name: str) -> None:
    vertices, faces = grid()
    exact = "big" not in name and name != "binary.stl"
    found = open_file(write(tmp_path, name, SEEDS[name][1]))
    expected = vertices if exact else vertices.astype(np.float32).astype(np.float64)
    assert found.report.format == SEEDS[name][0]
    assert not found.report.lost
    assert not found.report.repairs
    mesh = found.mesh
    assert (mesh.n, len(mesh.faces)) == (len(vertices), sum(len(f) - 2 for f in faces))
    triangles = [f for f in faces if len(f) == 3]
    want = {tuple(expected[list(f)].ravel().tolist()) for f in triangles}
    got = [tuple(row) for row in mesh.vertices[mesh.faces].reshape(-1, 9).tolist()]
    assert want <= set(got)
    if found.report.format != "STL":
        assert (mesh.vertices == expected).all()


@pytest.mark.parametrize(
    ("name", "like"),
    [("model.stl", "plain.obj"), ("model.obj", "binary.stl"), ("model", "text.ply"),
     ("model.ply", "sheet.off"), ("model.txt", "text.stl"), ("model.obj", "sheet.3mf")],
)  # fmt: skip
def test_content_decides_about_the_format(tmp_path: Path, name: str, like: str) -> None:
    kind, data = SEEDS[like]
    assert open_file(write(tmp_path, name, data)).report.format == kind


def test_a_byte_order_mark_costs_no_vertex(tmp_path: Path) -> None:
    found = open_file(write(tmp_path, "a.obj", b"\xef\xbb\xbf" + tetrahedron().encode()))
    assert (found.mesh.n, len(found.mesh.faces)) == (4, 4)
    assert not found.report.changed


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-16"])
def test_utf16_is_read(tmp_path: Path, encoding: str) -> None:
    found = open_file(write(tmp_path, "a.obj", tetrahedron(1.5).encode(encoding)))
    assert found.mesh.vertices.max() == 1.5


def test_decimal_commas_are_read_as_points(tmp_path: Path) -> None:
    text = tetrahedron(0.348).replace(".", ",")
    found = open_file(write(tmp_path, "a.obj", text))
    assert found.mesh.vertices.max() == 0.348
    assert "commas" in "".join(found.report.lines())


def test_carriage_returns_alone_end_lines_in_text_stl(tmp_path: Path) -> None:
    data = SEEDS["text.stl"][1].replace(b"\n", b"\r")
    assert open_file(write(tmp_path, "a.stl", data)).mesh.n == 63


def test_a_comment_of_twenty_megabytes_is_passed_over(tmp_path: Path) -> None:
    text = "# " + "x" * 20_000_000 + "\n" + tetrahedron()
    assert open_file(write(tmp_path, "a.obj", text)).mesh.n == 4


def test_an_offset_of_ten_million_costs_no_bit(tmp_path: Path) -> None:
    found = open_file(write(tmp_path, "a.obj", tetrahedron(1.0, 1e7 + 0.1)))
    assert found.mesh.vertices[1, 0] == 1.0 + (1e7 + 0.1)


def test_texture_seams_do_not_split_vertices(tmp_path: Path) -> None:
    text = tetrahedron().replace("f 1 3 2", "f 1/1 3/2 2/3").replace("f 1 2 4", "f 1/4 2/5 4/6")
    text = "".join(f"vt 0.{i} 0.5\n" for i in range(1, 7)) + text
    assert open_file(write(tmp_path, "a.obj", text)).mesh.n == 4


def test_a_vertex_that_cannot_be_read_is_refused_not_shifted_past(tmp_path: Path) -> None:
    lines = tetrahedron().splitlines()
    for damaged in ("w 1.0 0.0 0.0", "v 1.0 0.0 0.0 v 9 9 9", "v 1.0 0.0 0.0Xv 9.0 9.0 9.0"):
        text = "\n".join([lines[0], damaged, *lines[2:]])
        with pytest.raises(FileError, match="line 2 should be a vertex") as refusal:
            open_file(write(tmp_path, "a.obj", text))
        assert_says_it("a.obj", str(refusal.value))


def test_losses_are_counted_against_what_the_file_declares(tmp_path: Path) -> None:
    vertices, faces = grid()
    text = SEEDS["sheet.off"][1].decode().splitlines()
    text[2 + 10] = "nan 0 0"
    at_it = sum(10 in f for f in faces)
    found = open_file(write(tmp_path, "a.off", "\n".join(text)))
    report = found.report_as_read
    (loss,) = report.lost
    assert (loss.vertices, loss.faces) == (1, at_it)
    assert report.declared_vertices == len(vertices) == found.as_read.n + 1
    assert report.declared_faces == len(faces)
    assert len(found.as_read.faces) == sum(len(f) - 2 for f in faces if 10 not in f)
    assert any("are not in the mesh" in warning for warning in report.warnings)


def test_a_mesh_without_area_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no face with an area"):
        open_file(write(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"))


def test_a_polygon_beyond_all_measure_is_refused(tmp_path: Path) -> None:
    angle = np.linspace(0, 2 * np.pi, 20_001, endpoint=False)
    rows = "".join(f"v {x} {y} 0\n" for x, y in zip(np.cos(angle), np.sin(angle), strict=True))
    text = rows + "f " + " ".join(str(i + 1) for i in range(len(angle)))
    with pytest.raises(FileError, match="20,001 corners"):
        open_file(write(tmp_path, "a.obj", text))


@pytest.mark.parametrize("corners", [4, 5, 12, 64, 65, 300])
def test_concave_polygons_do_not_fold_over(corners: int) -> None:
    angle = np.arange(corners) * 2 * np.pi / corners
    radius = np.where(np.arange(corners) % 2, 1.0, 0.3)
    flat = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    vertices = np.column_stack([flat, 0.5 * flat[:, 0] + 2])
    f = triangulate(vertices, np.arange(corners), np.array([corners]))
    a, b, c = (vertices[f[:, i], :2] for i in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    x, y = flat.T
    whole = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert (areas >= 0).all()
    assert areas.sum() == pytest.approx(whole, rel=1e-12)


def test_declining_cleanup_gives_the_mesh_as_it_was(tmp_path: Path) -> None:
    text = tetrahedron() + "v 5 5 5\nf 1 3 2\nf 2 2 3\n"
    path = write(tmp_path, "a.obj", text)
    raw = open_file(path, clean=False)
    assert (raw.mesh.n, len(raw.mesh.faces)) == (5, 6)
    assert not raw.report.repairs
    cleaned = open_file(path)
    assert (cleaned.mesh.n, len(cleaned.mesh.faces)) == (4, 4)
    assert cleaned.as_read.digest == raw.mesh.digest
    changes = {c.what: (c.vertices, c.faces) for c in cleaned.report.repairs}
    assert changes == {
        "collapsed_faces": (0, 1), "duplicate_faces": (0, 1), "unreferenced_vertices": (1, 0)
    }  # fmt: skip
    assert any("number of faces" in warning for warning in cleaned.report.warnings)


def test_holes_stay_open(tmp_path: Path) -> None:
    vertices, faces = grid()
    middle = [i for i, f in enumerate(faces) if {30, 31} <= set(f)]
    kept = [f for i, f in enumerate(faces) if i not in middle]
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
    text += "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in kept)
    found = open_file(write(tmp_path, "a.obj", text))
    assert len(found.mesh.faces) == sum(len(f) - 2 for f in kept)
    assert not found.report.repairs


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.obj")
    with pytest.raises(FileError, match="not an ordinary file"):
        open_file(tmp_path / "a.obj")


def test_a_missing_file_a_folder_and_a_bad_name_are_refused(tmp_path: Path) -> None:
    for name, why in (("none.obj", "is not there"), (".", "is a folder"), ("a\0.obj", "reached")):
        with pytest.raises(FileError, match=why):
            open_file(f"{tmp_path}/{name}")


NAMES = [
    "Körper für Prüfung.obj", "模型.obj", "🚗 design.obj", "it's \"quoted\" $HOME; rm -rf *.obj",
    "x" * 196 + ".obj", "line\nbreak.obj", "-v.obj", "percent%20s%d.obj", b"\xff\xfe.obj",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_any_name_opens(tmp_path: Path, name: str | bytes) -> None:
    path = tmp_path / os.fsdecode(name)
    path.write_text(tetrahedron())
    found = open_file(path)
    assert found.mesh.n == 4
    "\n".join(found.report.lines()).encode()
    path.write_text("nothing")
    with pytest.raises(FileError) as refusal:
        open_file(path)
    str(refusal.value).encode()


def test_a_symbolic_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    write(tmp_path / "far", "a.obj", tetrahedron())
    (tmp_path / "link.obj").symlink_to(tmp_path / "far" / "a.obj")
    assert open_file(tmp_path / "link.obj").mesh.n == 4
    (tmp_path / "loop.obj").symlink_to(tmp_path / "loop.obj")
    with pytest.raises(FileError, match=r"“loop\.obj” is a symbolic link that leads in a circle"):
        open_file(tmp_path / "loop.obj")


def cancelled_at(stage: str) -> Run:
    """Return a run that is cancelled when it reports `stage`."""
    run = Run(lambda _, text: run.cancel() if text == stage else None)
    return run


def test_a_job_is_cancelled_and_the_next_file_opens(tmp_path: Path) -> None:
    path = write(tmp_path, "a.obj", tetrahedron())
    for stage in ("Starting", "Reading", "Checking", "Cleaning"):
        with pytest.raises(Cancelled):
            open_file(path, run=cancelled_at(stage))
    assert open_file(path).mesh.n == 4


def test_memory_is_estimated_before_and_refused_beyond_the_limit(tmp_path: Path) -> None:
    path = write(tmp_path, "a.stl", b"")
    with path.open("r+b") as sparse:
        sparse.truncate(1 << 30)
    assert estimate(path) > MEMORY_LIMIT
    with pytest.raises(FileError, match="GiB of memory to open"):
        open_file(path)
    assert estimate(write(tmp_path, "b.obj", tetrahedron())) < MEMORY_LIMIT / 10


def model_3mf(objects: str, items: str, unit: str = "millimeter") -> bytes:
    space = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    return pack_3mf(
        f'<model unit="{unit}" xmlns="{space}"><resources>{objects}</resources>'
        f"<build>{items}</build></model>".encode()
    )


PIECE = (
    '<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>'
    '<vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices><triangles>'
    '<triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>'
    '<triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/>'
    "</triangles></mesh></object>"
)


def test_3mf_places_components_and_items(tmp_path: Path) -> None:
    move = "1 0 0 0 1 0 0 0 1 {} 0 0"
    pair = (
        '<object id="2"><components><component objectid="1"/>'
        f'<component objectid="1" transform="{move.format(10)}"/></components></object>'
    )
    items = f'<item objectid="2" transform="{move.format(100)}"/>'
    found = open_file(write(tmp_path, "a.3mf", model_3mf(PIECE + pair, items, "inch")))
    assert (found.mesh.n, len(found.mesh.faces)) == (8, 8)
    assert sorted(found.mesh.vertices[:, 0].tolist()) == [100, 100, 100, 101, 110, 110, 110, 111]
    assert "unit is inch" in "".join(found.report.lines())


def test_3mf_that_multiplies_or_holds_itself_is_refused(tmp_path: Path) -> None:
    twice = "".join(
        f'<object id="{i + 1}"><components><component objectid="{i}"/>'
        f'<component objectid="{i}"/></components></object>'
        for i in range(1, 60)
    )
    with pytest.raises(FileError, match="multiply"):
        open_file(write(tmp_path, "a.3mf", model_3mf(PIECE + twice, '<item objectid="60"/>')))
    loop = '<object id="2"><components><component objectid="2"/></components></object>'
    with pytest.raises(FileError, match="part of itself"):
        open_file(write(tmp_path, "b.3mf", model_3mf(PIECE + loop, '<item objectid="2"/>')))


def glb(positions: np.ndarray, indices: np.ndarray, **changes: object) -> bytes:
    """Return a GLB of one triangle mesh; `changes` replace entries of its accessors."""
    import json

    data = positions.astype("<f4").tobytes() + indices.astype("<u4").tobytes()
    first = {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3"}
    second = {"bufferView": 1, "componentType": 5125, "count": indices.size, "type": "SCALAR"}
    second |= changes
    scene = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [first, second],
        "bufferViews": [
            {"buffer": 0, "byteLength": positions.size * 4},
            {"buffer": 0, "byteOffset": positions.size * 4, "byteLength": indices.size * 4},
        ],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_gltf_opens_and_its_lengths_are_checked_first(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    found = open_file(write(tmp_path, "a.glb", glb(points, faces)))
    assert (found.mesh.n, len(found.mesh.faces)) == (4, 4)
    assert "experimentally" in "".join(found.report.lines())
    for count in (13, 1 << 31, -1, 2.5):
        with pytest.raises(FileError, match="damaged"):
            open_file(write(tmp_path, "b.glb", glb(points, faces, count=count)))
