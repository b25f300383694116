"""Files that are odd: the right ones open whole, and of the others nothing goes without a word."""

from __future__ import annotations

import io
import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

from engine import FileError, open_file
from tests.engine.test_io_shared import assert_says_it, assert_sound
from tests.soak.mutations import grid, pack_3mf, seeds

SEEDS = {name: data for name, (_, data) in seeds().items()}
OBJ, OFF, PLY, STL = (SEEDS[n] for n in ("plain.obj", "sheet.off", "little.ply", "text.stl"))
BARE = OBJ.partition(b"\n")[2]
TEXT_PLY, BIG_PLY, BINARY_STL = (SEEDS[n] for n in ("text.ply", "big.ply", "binary.stl"))
MODEL = zipfile.ZipFile(io.BytesIO(SEEDS["sheet.3mf"])).read("3D/3dmodel.model")
N, F = len(grid()[0]), len(grid()[1])


def lines(data: bytes, head: bytes, new: bytes) -> bytes:
    """Return `data` with every line that begins with `head` put into `new` as {}."""
    return b"\n".join(
        new.replace(b"{}", line) if line.startswith(head) else line for line in data.split(b"\n")
    )


def vertices_of_off(data: bytes, more: bytes) -> bytes:
    """Return the OFF with `more` behind every vertex."""
    rows = data.split(b"\n")
    return b"\n".join([*rows[:2], *(row + more for row in rows[2 : 2 + N]), *rows[2 + N :]])


def faces_of_off(data: bytes, more: bytes) -> bytes:
    """Return the OFF with `more` behind every face."""
    rows = data.strip().split(b"\n")
    return b"\n".join([*rows[: 2 + N], *(row + more for row in rows[2 + N :])])


def ply_with(head: bytes, body: bytes, before: bytes = b"element vertex") -> bytes:
    """Return the binary PLY with another element, in front of the vertices or behind the faces."""
    end = PLY.index(b"end_header\n") + len(b"end_header\n")
    if before == b"end_header":
        return PLY.replace(before, head + before) + body
    return PLY[:end].replace(before, head + before, 1) + body + PLY[end:]


def with_line_ends(data: bytes, ends: bytes) -> bytes:
    """Return the PLY with other line ends in its header."""
    end = data.index(b"\n", data.index(b"end_header")) + 1
    return data[:end].replace(b"\n", ends) + data[end:]


def fed(data: bytes) -> bytes:
    """Return the PLY with a first coordinate whose first byte is a line feed."""
    end = data.index(b"end_header\n") + len(b"end_header\n")
    return data[:end] + b"\n" + data[end + 1 :]


FED = fed(PLY)


def binary_stl(head: bytes, count: int | None = None) -> bytes:
    told = BINARY_STL[80:84] if count is None else count.to_bytes(4, "little")
    return head.ljust(80)[:80] + told + BINARY_STL[84:]


def model_3mf(old: str, new: str) -> bytes:
    assert old.encode() in MODEL
    return pack_3mf(MODEL.replace(old.encode(), new.encode(), 1))


def archive(parts: list[tuple[str, bytes]]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in parts:
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            with packed.open(info, "w") as part:
                part.write(data)
    return out.getvalue()


PRODUCTION = (
    b'<model xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"><resources>'
    b'<object id="2"><components><component objectid="1" p:path="/3D/o.model"/></components>'
    b'</object></resources><build><item objectid="2"/></build></model>'
)
SLICES = (
    '<s:slicestack id="9"><s:slice ztop="1"><s:vertices><s:vertex x="1" y="2"/>'
    "</s:vertices></s:slice></s:slicestack></resources>"
)

RIGHT: dict[str, bytes] = {
    # A backslash ends comments, paths and names too; only numbers go on in the next line.
    "comment_ends_in_backslash.obj": b"# from C:\\models\\\n" + BARE,
    "comments_end_in_backslash.obj": lines(OBJ, b"v", b"{} # C:\\"),
    "path_ends_in_backslash.obj": b"mtllib C:\\models\\\n" + BARE,
    "group_ends_in_backslash.obj": OBJ.replace(b"\nf", b"\ng part\\\nf", 1),
    "japanese_group.obj": "g 表\n".encode("shift_jis") + BARE,
    "vertex_goes_on.obj": re.sub(rb"(?m)^v (\S+) (\S+) ", rb"v \1 \\\n \2 \\ \n", OBJ),
    "face_goes_on.obj": re.sub(rb"(?m)^f (\S+) ", rb"f \1 \\\n\\\n", OBJ),
    "crlf_goes_on.obj": re.sub(rb"(?m)^f (\S+) ", rb"f \1 \\\r\n", OBJ),
    "mixed_corners.obj": b"vt 0 0\nvn 0 0 1\n"
    + re.sub(rb"(?m)^f (\d+) (\d+)", rb"f \1/1 \2//1", OBJ),
    "colours_and_comments.obj": lines(OBJ, b"v", b"{} 1 0 0.5#red"),
    "weights.obj": lines(OBJ, b"v", b"{} 1.0"),
    "signs.obj": re.sub(rb"(?m)^v (\d)", rb"v +\1", OBJ),
    "tabs_and_form_feeds.obj": OBJ.replace(b" ", b"\t").replace(b"\n", b"\f\n"),
    "faces_first.obj": b"\n".join(sorted(OBJ.split(b"\n"), key=lambda row: row[:1] == b"v")),
    "points_and_lines.obj": OBJ + b"p 1\nl 1 2 3\n",
    "comment_names_the_end.ply": PLY.replace(b"comment a sheet", b"comment not the end_header yet"),
    "note_names_the_end.ply": TEXT_PLY.replace(b"comment a sheet", b"obj_info end_header"),
    "blanks_behind_the_end.ply": PLY.replace(b"end_header", b"end_header \t"),
    "carriage_returns.ply": with_line_ends(PLY, b"\r"),
    "blank_and_both.ply": with_line_ends(PLY.replace(b"end_header", b"end_header ", 1), b"\r\n"),
    "line_feed_first_in_body.ply": with_line_ends(FED, b"\r"),
    "mark_before_binary.ply": b"\xef\xbb\xbf" + PLY,
    "mark_before_big.ply": b"\xef\xbb\xbf" + BIG_PLY,
    "capital_magic.ply": b"PLY" + PLY[3:],
    "comments_of_three_megabytes.ply": PLY.replace(
        b"comment a sheet", b"\n".join([b"comment " + b"x" * 70] * 40_000)
    ),
    "element_before.ply": ply_with(
        b"element m 2\nproperty list uchar double w\nproperty short k\n",
        b"\x02" + bytes(18) + b"\x00\x01\x01",
    ),
    "element_behind.ply": ply_with(
        b"element e 2\nproperty int a\nproperty uchar b\n", b"\x01" * 10, b"end_header"
    ),
    "named_binary.stl": binary_stl(b"solid facet normal 0 0 1 outer loop vertex"),
    "one_triangle_a_line.stl": re.sub(rb"\s*\n\s+(?!facet)", b" ", STL),
    "all_on_one_line.stl": STL.replace(b"\n", b" "),
    "in_capitals.stl": STL.upper(),
    "many_solids.stl": STL.replace(b" facet", b"endsolid\nsolid b\n facet"),
    "named_like_a_corner.stl": STL.replace(b"solid sheet", b"solid facet vertex 1 2 3"),
    "colours.off": b"C" + vertices_of_off(OFF, b" 255 0 0 255"),
    "normals.off": b"N" + vertices_of_off(OFF, b" 0 0 1"),
    "both.off": b"CN" + vertices_of_off(OFF, b" 0 0 1 0.1 0.2 0.3 1"),
    "face_colours.off": faces_of_off(OFF, b" 255 0 0"),
    "comments.off": lines(OFF, b"", b"{} # 3 4 5").replace(b"OFF", b"# a\nOFF\n\n# b", 1),
    "no_keyword.off": OFF.removeprefix(b"OFF\n"),
    "counts_with_keyword.off": OFF.replace(b"OFF\n", b"OFF ", 1),
    "slices_beside.3mf": model_3mf("</resources>", SLICES),
    "parts_apart.3mf": archive([("3D/3dmodel.model", PRODUCTION), ("3D/o.model", MODEL)]),
    "no_build.3mf": model_3mf('<item objectid="1"/>', ""),
    "utf16.3mf": pack_3mf(MODEL.decode().encode("utf-16")),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(RIGHT))
def test_an_odd_file_opens_whole(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(RIGHT[name])
    like = {".obj": OBJ, ".off": OFF, ".3mf": SEEDS["sheet.3mf"], ".stl": STL, ".ply": PLY}
    special = {"big": BIG_PLY, "binary.stl": BINARY_STL, "feed_first": FED}
    data = next((d for word, d in special.items() if word in name), like[path.suffix])
    (tmp_path / f"plain{path.suffix}").write_bytes(data)
    plain, found = open_file(tmp_path / f"plain{path.suffix}"), open_file(path)
    assert (found.mesh.vertices == plain.mesh.vertices).all()
    assert (found.mesh.faces == plain.mesh.faces).all()
    assert not found.report.lost
    assert not found.report.repairs


TWO_FACES = b"element face 1\nproperty list uchar int vertex_indices\n"

LOSSY: dict[str, bytes] = {
    "zeros_behind.obj": OBJ + bytes(100),
    "zero_in_a_vertex.obj": OBJ.replace(b"\nv ", b"\nv\0", 1),
    "corners_without_end.obj": OBJ + b"f " + b"1 " * 1_000_000,
    "digits_without_end.obj": OBJ + b"v " + b"1" * 1_000_000 + b" 0 0\nf -1 1 2\n",
    "index_of_sixteen_digits.obj": OBJ + b"f 4294967297 1 9007199254740993\n",
    "two_faces.ply": ply_with(TWO_FACES, b"\x03" + bytes(12), b"end_header"),
    "two_vertices.ply": ply_with(
        b"element vertex 1\nproperty float x\nproperty float y\nproperty float z\n", bytes(12)
    ),
    "list_that_reaches_on.ply": PLY.replace(b"list uchar", b"list uint"),
    "no_such_type.ply": PLY.replace(b"double x", b"quad\x1b[31m x"),
    "bytes_behind.ply": PLY + b"made by me",
    "other_order.ply": PLY.replace(b"little", b"big"),
    "binary_behind.stl": STL + BINARY_STL,
    "corner_too_many.stl": STL.replace(b"  endloop", b"  vertex 0 0 0\n  endloop", 1),
    "count_too_high.stl": binary_stl(b"solid", 2**32 - 1),
    "length_of_no_count.stl": binary_stl(b"solid", 7) + b"tail",
    "face_among_coloured_vertices.off": b"C"
    + vertices_of_off(OFF, b" 255 0 0").replace(b"%d %d" % (N, F), b"%d %d" % (N + 1, F - 1), 1),
    "four_dimensions.off": b"4" + vertices_of_off(OFF, b" 1"),
    "n_dimensions.off": b"n" + OFF,
    "the_same_part_twice.3mf": archive(
        [("3D/3dmodel.model", MODEL), ("/3D/3dmodel.model", MODEL)]
    ),
    "two_objects_of_one_number.3mf": model_3mf("</resources>", '<object id="1"/></resources>'),
    "missing_coordinate.3mf": pack_3mf(re.sub(rb' z="[^"]*"', b"", MODEL, count=1)),
    "nested_archive.3mf": pack_3mf(SEEDS["sheet.3mf"]),
    "unit_without_end.3mf": model_3mf("millimeter", "inch" * 100_000),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(LOSSY))
def test_what_is_lost_is_told_or_the_file_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(LOSSY[name])
    try:
        found = open_file(path)
    except FileError as refusal:
        told = [str(refusal)]
        assert_says_it(name, told[0])
    else:
        assert_sound(found)
        assert found.report.reading
        told = found.report.lines()
    assert all(len(line) < 400 and line.isprintable() for line in told)


def test_a_protected_3mf_is_called_so(tmp_path: Path) -> None:
    data = bytearray(SEEDS["sheet.3mf"])
    data[data.index(b"PK\x03\x04") + 6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    path = tmp_path / "a.3mf"
    path.write_bytes(data)
    with pytest.raises(FileError, match="password"):
        open_file(path)


def gltf(uri: str, **more: object) -> bytes:
    attributes = {"attributes": {"POSITION": 0}, "material": 7}
    scene = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [attributes]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": uri}],
    }  # fmt: skip
    return json.dumps(scene | more).encode()


@pytest.mark.parametrize(
    "uri", ["/etc/passwd", "../a.bin", "a%00b", "x" * 5000, ".", "circle", "http://a/b"]
)
def test_a_gltf_reaches_for_nothing_outside_its_folder(tmp_path: Path, uri: str) -> None:
    (tmp_path / "a.bin").write_bytes(np.eye(3, dtype="<f4").tobytes())
    inner = tmp_path / "in"
    inner.mkdir()
    (inner / "circle").symlink_to("circle")
    (inner / "a.gltf").write_bytes(gltf(uri))
    with pytest.raises(FileError, match="beside it, which is not there") as refusal:
        open_file(inner / "a.gltf")
    assert_says_it("a.gltf", str(refusal.value))
    assert len(str(refusal.value)) < 400


def test_a_gltf_opens_without_its_pictures(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(np.eye(3, dtype="<f4").tobytes())
    pictures = {"images": [{"uri": "/etc/passwd"}], "textures": [{"source": 0}]}
    (tmp_path / "a.gltf").write_bytes(gltf("a.bin", **pictures))
    assert len(open_file(tmp_path / "a.gltf").mesh.faces) == 1
