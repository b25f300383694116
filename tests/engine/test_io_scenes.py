"""DAE, X3D and 3DS: what other programs write opens right, what contradicts itself is refused."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from engine import FileError, Mesh, save
from engine.files.importing import read_soup
from engine.files.soup import Soup, settle
from tests.program import PATIENCE
from tests.soak.mutations import experimental_seeds, grid, sentence_fault

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
QUAD = POINTS[[0, 1, 2, 3]]


def read(text: str | bytes, name: str) -> Soup:
    return read_soup(Path(name), text if isinstance(text, bytes) else text.encode(), name)


def opened(text: str | bytes, name: str):
    """The vertices and triangles, and what is said about them."""
    v, f, notes = settle(read(text, name), name)
    return v, f, " ".join(note.words for note in notes)


def refusal(text: str | bytes, name: str) -> str:
    with pytest.raises(FileError) as found:
        settle(read(text, name), name)
    assert sentence_fault(Path(name), str(found.value)) == ""
    return str(found.value)


def area(v: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Vector area, (3,)."""
    a, b, c = v[f].transpose(1, 0, 2)
    return np.cross(b - a, c - a).sum(axis=0) / 2


SOURCE = """
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<source id="t"><float_array id="ta" count="2">0.5 0.5</float_array>
<technique_common><accessor source="#ta" count="1" stride="2"><param name="S"/><param name="T"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
"""
INPUTS = """<input semantic="TEXCOORD" source="#t" offset="0" set="0"/>
<input semantic="VERTEX" source="#v" offset="1"/>"""
TRIANGLES = f'<triangles count="2">{INPUTS}<p>0 0 0 1 0 2 0 0 0 2 0 3</p></triangles>'
POLYLIST = f'<polylist count="1">{INPUTS}<vcount>4</vcount><p>0 0 0 1 0 2 0 3</p></polylist>'


def dae(primitives: str = TRIANGLES, nodes: str | None = None, more: str = "") -> str:
    """A COLLADA file around a geometry “g”, placed by `nodes`; without them it has no scene."""
    scene = ""
    if nodes is not None:
        scene = (
            '<library_visual_scenes><visual_scene id="w">'
            f"{nodes}</visual_scene></library_visual_scenes>"
            '<scene><instance_visual_scene url="#w"/></scene>'
        )
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" '
        'version="1.4.1"><asset><unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis></asset>'
        f'<library_geometries><geometry id="g"><mesh>{SOURCE}{primitives}</mesh></geometry>'
        f"</library_geometries>{more}{scene}</COLLADA>"
    )


@pytest.mark.parametrize(
    "primitive",
    [
        TRIANGLES,
        POLYLIST,
        f'<polygons count="1">{INPUTS}<p>0 0 0 1 0 2 0 3</p></polygons>',
        f'<tristrips count="1">{INPUTS}<p>0 0 0 1 0 3 0 2</p></tristrips>',
        f'<trifans count="1">{INPUTS}<p>0 0 0 1 0 2 0 3</p></trifans>',
        '<triangles count="2"><input semantic="VERTEX" source="#v" offset="0"/>'
        "<p>0 1 2\n0\t2 3</p></triangles>",
    ],
    ids=["triangles", "polylist", "polygons", "tristrips", "trifans", "one input"],
)
def test_every_kind_of_dae_faces_gives_the_same_square(primitive: str) -> None:
    v, f, words = opened(dae(primitive), "a.dae")
    assert np.array_equal(v, POINTS)
    assert len(f) == 2
    assert np.allclose(area(v, f), [0, 0, 1])
    assert "unit is inch" in words


def test_dae_materials_share_vertices_and_curves_are_left_out() -> None:
    halves = [
        f'<triangles count="1" material="m{i}">{INPUTS}<p>0 0 0 {i} 0 {i + 1}</p></triangles>'
        for i in (1, 2)
    ]
    edges = '<lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1</p></lines>'
    v, f, words = opened(dae("".join(halves) + edges), "a.dae")
    assert (len(v), len(f)) == (4, 2)
    assert "1 set of curves left out" in words


def test_dae_nodes_place_in_the_order_they_are_written() -> None:
    turned = (
        '<node id="outer"><translate>10 0 0</translate><rotate>0 0 1 90</rotate><node>'
        "<scale>2 1 1</scale><matrix>1 0 0 0 0 1 0 0 0 0 1 5 0 0 0 1</matrix>"
        '<instance_geometry url="#g"/></node></node>'
    )
    v, f, _ = opened(dae(nodes=turned), "a.dae")
    x, y, z = (POINTS * np.array([2, 1, 1])).T
    assert np.allclose(v, np.column_stack([10 - y, x, z + 5]))
    assert np.allclose(area(v, f), [0, 0, 2])


def test_a_mirrored_dae_part_keeps_its_outside() -> None:
    mirrored = '<node><scale>-1 1 1</scale><instance_geometry url="#g"/></node>'
    v, f, _ = opened(dae(POLYLIST, mirrored), "a.dae")
    assert np.array_equal(v, POINTS * np.array([-1, 1, 1]))
    assert np.allclose(area(v, f), [0, 0, 1])


def test_dae_nodes_are_instanced_and_loops_refused() -> None:
    library = '<library_nodes><node id="lib"><instance_geometry url="#g"/></node></library_nodes>'
    twice = (
        '<node><instance_node url="#lib"/></node>'
        '<node><translate>3 0 0</translate><instance_node url="#lib"/></node>'
    )
    v, f, _ = opened(dae(nodes=twice, more=library), "a.dae")
    assert np.array_equal(v, np.vstack([POINTS, POINTS + np.array([3, 0, 0])]))
    assert len(f) == 4
    loop = '<node id="n"><instance_node url="#n"/></node>'
    assert "more than 100 deep" in refusal(dae(nodes=loop), "a.dae")
    ten = '<instance_node url="#{}"/>' * 10
    many = "".join(f'<node id="d{i}">{ten}</node>'.replace("{}", f"d{i + 1}") for i in range(30))
    many += '<node id="d30"><instance_geometry url="#g"/></node>'
    assert "multiply" in refusal(dae(nodes=many), "a.dae")


def test_a_dae_skin_opens_as_it_was_bound() -> None:
    skin = (
        '<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>'
        "1 0 0 7 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller>"
        "</library_controllers>"
    )
    node = '<node><translate>0 0 99</translate><instance_controller url="#c"/></node>'
    v, _, words = opened(dae(nodes=node, more=skin), "a.dae")
    assert np.array_equal(v, POINTS + np.array([7, 0, 0]))
    assert "skeleton" in words
    itself = skin.replace('source="#g"', 'source="#c"')
    assert "controls itself" in refusal(dae(nodes=node, more=itself), "a.dae")


def test_dae_geometry_that_is_not_placed_is_reported() -> None:
    second = '<geometry id="h"><mesh><triangles count="1"><input semantic="VERTEX" source="#v"/>'
    second += "<p>0 1 2</p></triangles></mesh></geometry></library_geometries>"
    placed = '<node><instance_geometry url="#g"/></node>'
    text = dae(nodes=placed).replace("</library_geometries>", second)
    soup = read(text, "a.dae")
    assert len(soup.sizes) == 2
    assert soup.declared_faces == 3
    (lost,) = [n for n in soup.notes if n.lost]
    assert (lost.what, lost.faces) == ("not_placed", 1)


@pytest.mark.parametrize(
    ("good", "bad", "why"),
    [
        ('count="12"', 'count="15"', "announces 15 numbers and holds 12"),
        ("1 1 0 0 1 0</float", "1 1 0 0 1</float", "announces 12 numbers and holds 11"),
        ('count="4" stride="3"', 'count="5" stride="3"', "reaches beyond"),
        ('count="4" stride="3"', 'count="4" stride="4"', "reaches beyond"),
        ('count="4" stride="3"', 'count="4" offset="1" stride="3"', "reaches beyond"),
        ('count="4" stride="3"', 'count="4" stride="2"', "reaches beyond"),
        ('count="4" stride="3"', 'count="-4" stride="3"', "not a whole number"),
        ('count="1" stride="2"', 'count="9" stride="2"', "reaches beyond"),
        ('source="#pa"', 'source="#gone"', "refers to “#gone”"),
        ('source="#v"', 'source="#p"', "refers to “#p”"),
        ('semantic="POSITION"', 'semantic="NORMAL"', "no positions"),
        ('semantic="VERTEX"', 'semantic="NORMAL"', "which vertices"),
        ('<triangles count="2">', '<triangles count="3">', "announces 3 and holds 2"),
        ('<triangles count="2">', "<triangles>", "not a whole number"),
        ("0 2 0 3</p>", "0 2 0</p>", "multiple of 2"),
        ('offset="1"', 'offset="7777"', "multiple of 7,778"),
        ("0 0 0 1 0 2 0 0 0 2 0 3</p>", "0 9 0 9 0 2 0 0 0 2 0 3</p>", ""),
        ("0 0 0 1 0 0 1 1 0 0 1 0<", "NaN INF 0 1 0 0 1 1 0 0 1 0<", "finite"),
    ],
)  # fmt: skip
def test_a_dae_that_contradicts_itself_is_refused_or_reported(
    good: str, bad: str, why: str
) -> None:
    text = dae()
    assert good in text
    if why:
        assert why in refusal(text.replace(good, bad, 1), "a.dae")
        return
    v, f, words = opened(text.replace(good, bad, 1), "a.dae")
    assert np.array_equal(v[f[0]], POINTS[[0, 2, 3]])
    assert "1 face left out that refers to vertices which the file does not have" in words


@pytest.mark.parametrize(
    ("primitive", "why"),
    [
        (POLYLIST.replace("<vcount>4<", "<vcount>5<"), "not as many as they announce"),
        (POLYLIST.replace("<vcount>4<", "<vcount>2 2<"), "announces 1 and holds 2"),
        (POLYLIST.replace("<vcount>4<", "<vcount>-4<"), "not as many as they announce"),
        (f'<polygons count="2">{INPUTS}<p>0 0 0 1 0 2</p></polygons>', "announces 2 and holds 1"),
        (
            f'<polygons count="1">{INPUTS}<ph><p>0 0 0 1 0 2</p><h>0</h></ph></polygons>',
            "with holes",
        ),
    ],
)
def test_a_dae_whose_polygons_are_miscounted_is_refused(primitive: str, why: str) -> None:
    assert why in refusal(dae(primitive), "a.dae")


def x3d(shape: str) -> str:
    return f'<?xml version="1.0"?><X3D version="3.3"><Scene>{shape}</Scene></X3D>'


COORDINATE = '<Coordinate DEF="C" point="0 0 0, 1 0 0, 1 1 0, 0 1 0"/>'
FACES = f'<IndexedFaceSet coordIndex="0 1 2 3 -1">{COORDINATE}</IndexedFaceSet>'


@pytest.mark.parametrize(
    ("geometry", "way"),
    [
        (FACES, 1),
        (FACES.replace("0 1 2 3 -1", "0,1,2,-1,0,2,3"), 1),
        (FACES.replace("coordIndex", "ccw='false' coordIndex"), -1),
        (f'<IndexedTriangleSet index="0 1 2 0 2 3">{COORDINATE}</IndexedTriangleSet>', 1),
        (f'<IndexedQuadSet index="0 1 2 3">{COORDINATE}</IndexedQuadSet>', 1),
        (f'<IndexedTriangleStripSet index="0 1 3 2 -1">{COORDINATE}</IndexedTriangleStripSet>', 1),
        (f'<IndexedTriangleFanSet index="0 1 2 3">{COORDINATE}</IndexedTriangleFanSet>', 1),
        (f'<TriangleFanSet fanCount="4">{COORDINATE}</TriangleFanSet>', 1),
        (f"<QuadSet>{COORDINATE}</QuadSet>", 1),
        ('<TriangleSet><Coordinate point="0 0 0 1 0 0 1 1 0 0 0 0 1 1 0 0 1 0"/></TriangleSet>', 1),
    ],
)
def test_every_kind_of_x3d_faces_gives_the_same_square(geometry: str, way: int) -> None:
    v, f, _ = opened(x3d(f"<Shape>{geometry}</Shape>"), "a.x3d")
    assert len(f) == 2
    assert np.allclose(area(v, f), [0, 0, way])


def test_x3d_transforms_reuse_and_switches() -> None:
    scene = (
        f'<Transform translation="5 0 0" rotation="0 0 1 1.5707963267948966" center="1 0 0">'
        f'<Shape DEF="S">{FACES}</Shape></Transform><Transform scale="2 2 2"><Shape USE="S"/>'
        '</Transform><Switch whichChoice="-1"><Shape USE="S"/></Switch>'
        '<Shape><Sphere radius="1"/></Shape>'
    )
    v, f, words = opened(x3d(scene), "a.x3d")
    x, y, z = (POINTS - np.array([1, 0, 0])).T
    first = np.column_stack([6 - y, x, z])
    assert np.allclose(v, np.vstack([first, 2 * POINTS]))
    assert len(f) == 4
    assert "1 Sphere left out" in words


@pytest.mark.parametrize(
    ("shape", "why"),
    [
        (FACES.replace("0 1 0", "0 1"), "11 coordinates of points"),
        (FACES.replace("0 1 2 3 -1", "0 1 2 9 -1"), "vertices that the file does not have"),
        (FACES.replace("0 1 2 3 -1", "0 1 2 -7 -1"), "vertices that the file does not have"),
        (FACES.replace("1 0 0", "1 nan 0"), "not finite"),
        (FACES.replace(COORDINATE, '<Coordinate USE="gone"/>'), "uses “gone”"),
        (FACES.replace(COORDINATE, ""), "has no coordinates"),
        (f"<TriangleSet>{COORDINATE}</TriangleSet>", "no multiple of 3"),
        (f'<TriangleFanSet fanCount="5">{COORDINATE}</TriangleFanSet>', "fanCount"),
        (f'<IndexedQuadSet index="0 1 2">{COORDINATE}</IndexedQuadSet>', "no multiple of 4"),
    ],
)
def test_an_x3d_that_contradicts_itself_is_refused(shape: str, why: str) -> None:
    assert why in refusal(x3d(f"<Shape>{shape}</Shape>"), "a.x3d")


def test_an_x3d_group_that_holds_itself_is_refused() -> None:
    loop = '<Group DEF="G"><Group USE="G"/></Group>'
    assert "holds itself" in refusal(x3d(loop), "a.x3d")


def chunk(kind: int, content: bytes) -> bytes:
    return kind.to_bytes(2, "little") + (6 + len(content)).to_bytes(4, "little") + content


def three_ds(count: int = 4, faces: int = 2, last: int = 3, after: bytes = b"") -> bytes:
    rows = np.array([[0, 1, 2, 0], [0, 2, last, 0]], "<u2").tobytes()
    mesh = chunk(0x4110, count.to_bytes(2, "little") + POINTS.astype("<f4").tobytes())
    mesh += chunk(0x4120, faces.to_bytes(2, "little") + rows + after)
    return chunk(0x4D4D, chunk(0x3D3D, chunk(0x4000, b"square\0" + chunk(0x4100, mesh))))


def test_3ds_opens_and_one_that_contradicts_itself_does_not() -> None:
    smoothing = chunk(0x4150, bytes(8))
    v, f, _ = opened(three_ds(after=smoothing), "a.3ds")
    assert np.array_equal(v, POINTS)
    assert np.array_equal(f, [[0, 1, 2], [0, 2, 3]])
    _, f, words = opened(three_ds(last=4), "a.3ds")
    assert np.array_equal(f, [[0, 1, 2]])
    assert "1 face left out that refers to vertices which the file does not have" in words
    assert "announces 3 faces and has room for 2" in refusal(three_ds(faces=3), "a.3ds")
    assert "announces 5 vertices and has room for 4" in refusal(three_ds(count=5), "a.3ds")
    assert "more bytes of vertices" in refusal(three_ds(count=3), "a.3ds")
    whole = three_ds()
    for end in range(17, len(whole)):
        assert "damaged" in refusal(whole[:end], "a.3ds")


def test_the_seeds_that_are_damaged_open_whole(tmp_path: Path) -> None:
    vertices, faces = grid()
    for name, (kind, data) in experimental_seeds(tmp_path).items():
        if kind == "glTF":
            continue
        v, f, _ = opened(data, name)
        triangles = [face for face in faces if len(face) == 3]
        exact = 1e-6 if kind == "3DS" else 0.0
        assert np.allclose(v, vertices, rtol=exact, atol=0), name
        assert {tuple(t) for t in triangles} <= {tuple(t) for t in f.tolist()}, name


def test_what_meshlab_writes_opens_the_same(tmp_path: Path) -> None:
    vertices, faces = grid()
    triangles = np.array([face for face in faces if len(face) == 3])
    save(Mesh(vertices, triangles), tmp_path / "seed.ply")
    code = (
        "import pymeshlab; s = pymeshlab.MeshSet(); s.load_new_mesh('seed.ply')\n"
        "for e in ('dae', 'x3d', '3ds'): s.save_current_mesh('out.' + e)"
    )
    # Under a comma locale that code would write commas.
    plain = {**os.environ, "LC_ALL": "C.UTF-8"}
    command = [sys.executable, "-c", code]
    subprocess.run(
        command, cwd=tmp_path, check=True, capture_output=True, env=plain, timeout=PATIENCE
    )
    for name in ("out.dae", "out.x3d", "out.3ds"):
        v, f, _ = opened((tmp_path / name).read_bytes(), name)
        assert np.allclose(v[f], vertices[triangles], rtol=0, atol=2e-4), name
