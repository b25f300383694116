"""Damage files in many ways, with fixed seeds: each must open right or be refused in words.

    python -m tests.soak.mutations --count 10000 --seed 1

prints one line a format and how often the worker had to be replaced; it ends with 1 on any fault.
"""

from __future__ import annotations

import argparse
import io
import random
import re
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from engine import FileError, Imported, Mesh, open_file, save
from engine.files.process import worker
from tests.soak.plain_readers import PLAINLY_READ, read_plainly, triangles_of

HUGE = [0, 1, -1, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**32 + 1, 2**63, 2**64, 10**30]
MUTATIONS = ("bits", "bytes", "cut", "count", "splice", "repeat", "swap", "word")


def grid() -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Return a bent sheet of 7 by 9 vertices: triangles, with a quad in each corner cell."""
    rows, columns = 7, 9
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    z = 0.2 * x * y + rng.random(x.shape)
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()]) * np.pi
    faces: list[tuple[int, ...]] = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a = i * columns + j
            b, c, d = a + 1, a + columns + 1, a + columns
            faces += [(a, b, c), (a, c, d)] if (i, j) != (0, 0) else [(a, b, c, d)]
    return vertices, faces


def seeds() -> dict[str, tuple[str, bytes]]:
    """Return the files that are damaged: name to (format, content)."""
    v, faces = grid()
    triangles = [t for f in faces for t in ([f] if len(f) == 3 else [f[:3], (f[0], f[2], f[3])])]
    lines = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in v.tolist())
    obj = "# a sheet\n" + "".join(f"v {line}\n" for line in lines.splitlines())
    obj += "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces)
    rich = "mtllib a.mtl\no sheet\n" + "".join(f"v {line}\n" for line in lines.splitlines())
    rich += "vt 0 0\nvn 0 0 1\ng part\ns 1\nusemtl grey\n"
    rich += "".join("f " + " ".join(f"{i - len(v)}/1/1" for i in f) + "\n" for f in faces)
    off = f"OFF\n{len(v)} {len(faces)} 0\n{lines}"
    off += "".join(f"{len(f)} " + " ".join(map(str, f)) + "\n" for f in faces)
    return {
        "plain.obj": ("OBJ", obj.encode()),
        "rich.obj": ("OBJ", rich.encode()),
        "sheet.off": ("OFF", off.encode()),
        "text.ply": ("PLY", _ply_text(lines, faces, len(v))),
        "little.ply": ("PLY", _ply_binary(v, faces, "<", "f8", "double")),
        "big.ply": ("PLY", _ply_binary(v, faces, ">", "f4", "float")),
        "binary.stl": ("STL", _stl_binary(v, triangles)),
        "text.stl": ("STL", _stl_text(v, triangles)),
        "sheet.3mf": ("3MF", _3mf(v, triangles)),
    }


def _ply_head(form: str, number: str, n: int, f: int) -> bytes:
    return (
        f"ply\nformat {form} 1.0\ncomment a sheet\nelement vertex {n}\nproperty {number} x\n"
        f"property {number} y\nproperty {number} z\nelement face {f}\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()


def _ply_text(lines: str, faces: list[tuple[int, ...]], n: int) -> bytes:
    rows = "".join(f"{len(f)} " + " ".join(map(str, f)) + "\n" for f in faces)
    return _ply_head("ascii", "double", n, len(faces)) + (lines + rows).encode()


def _ply_binary(
    v: np.ndarray, faces: list[tuple[int, ...]], order: str, kind: str, number: str
) -> bytes:
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    rows = b"".join(bytes([len(f)]) + np.array(f, order + "i4").tobytes() for f in faces)
    return _ply_head(form, number, len(v), len(faces)) + v.astype(order + kind).tobytes() + rows


def _stl_binary(v: np.ndarray, triangles: list[tuple[int, ...]]) -> bytes:
    rows = b"".join(bytes(12) + v[list(t)].astype("<f4").tobytes() + bytes(2) for t in triangles)
    return b"a sheet".ljust(80) + len(triangles).to_bytes(4, "little") + rows


def _stl_text(v: np.ndarray, triangles: list[tuple[int, ...]]) -> bytes:
    text = "solid sheet\n"
    for t in triangles:
        corners = "".join(f"   vertex {x!r} {y!r} {z!r}\n" for x, y, z in v[list(t)].tolist())
        text += f" facet normal 0 0 1\n  outer loop\n{corners}  endloop\n endfacet\n"
    return (text + "endsolid sheet\n").encode()


def _3mf(v: np.ndarray, triangles: list[tuple[int, ...]]) -> bytes:
    rows = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n' for x, y, z in v.tolist())
    more = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in triangles)
    model = (
        '<?xml version="1.0"?><model unit="millimeter" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1"><mesh><vertices>{rows}</vertices><triangles>{more}</triangles></mesh>'
        '</object></resources><build><item objectid="1"/></build></model>'
    )
    return pack_3mf(model.encode())


def pack_3mf(model: bytes) -> bytes:
    """Return a 3MF archive around the XML `model`."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    return out.getvalue()


def mutate(data: bytes, how: str, rng: random.Random) -> bytes:
    """Return `data` damaged in the way `how`."""
    damaged = bytearray(data)
    at = rng.randrange(len(damaged))
    # Half of the damage goes to the beginning, where headers are.
    if rng.random() < 0.5:
        at = rng.randrange(min(len(damaged), 400))
    if how == "bits":
        for _ in range(rng.choice([1, 1, 1, 4, 16])):
            at = rng.randrange(len(damaged))
            damaged[at] ^= 1 << rng.randrange(8)
    elif how == "bytes":
        length = rng.choice([1, 1, 2, 4, 16])
        damaged[at : at + length] = rng.randbytes(length)
    elif how == "cut":
        del damaged[rng.randrange(1, len(damaged)) :]
    elif how == "count":
        numbers = list(re.finditer(rb"-?\d+(\.\d+)?", bytes(damaged)))
        if numbers:
            chosen = rng.choice(numbers[: 12 if rng.random() < 0.5 else None])
            damaged[chosen.start() : chosen.end()] = str(rng.choice(HUGE)).encode()
    elif how == "splice":
        length = rng.randrange(1, 200)
        start = rng.randrange(len(damaged))
        damaged[at:at] = damaged[start : start + length]
    elif how == "repeat":
        length = rng.randrange(1, 2000)
        damaged[at + length : at + length] = damaged[at : at + length]
    elif how == "swap":
        lines = bytes(damaged).split(b"\n")
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[i], lines[j] = lines[j], lines[i]
        damaged = bytearray(b"\n".join(lines))
    else:
        words = [
            b"nan",
            b"-inf",
            b"1e400",
            b"0,5",
            b"\\",
            b"#",
            b"\0",
            b"\r",
            b"f",
            b"v",
            b"/",
            b"-",
        ]
        damaged[at:at] = rng.choice(words)
    return bytes(damaged)


def mutated_file(name: str, kind: str, data: bytes, rng: random.Random) -> tuple[str, bytes]:
    """Return how and what: one or two mutations of a seed; a 3MF mostly inside its archive."""
    how = [rng.choice(MUTATIONS) for _ in range(rng.choice([1, 1, 2]))]
    inside = kind == "3MF" and rng.random() < 0.7
    if inside:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            data = archive.read("3D/3dmodel.model")
    for one in how:
        data = mutate(data, one, rng) or b"\0"
    return "+".join(how), pack_3mf(data) if inside else data


@dataclass
class Tally:
    """How it went, by the names of the files."""

    names: list[str]
    opened: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    respawns: int = 0
    stopped: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)


def fault_of(path: Path, found: Imported, data: bytes) -> str:
    """Return what is wrong with an opened file against the second opinion, or ""."""
    report, mesh = found.report_as_read, found.as_read
    lost = sum(c.faces for c in report.reading if c.lost)
    if not np.isfinite(mesh.vertices).all() or not np.isfinite(found.mesh.vertices).all():
        return "a coordinate that is not finite"
    for m in (mesh, found.mesh):
        if m.faces.min() < 0 or m.faces.max() >= m.n:
            return "an index out of range"
    if report.format not in PLAINLY_READ:
        return ""
    vertices, polygons = read_plainly(data, report.format)
    corners, count = triangles_of(vertices, polygons)
    if count != len(mesh.faces):
        return f"{len(mesh.faces)} triangles, the plain reader finds {count}"
    if len(polygons) + lost < report.declared_faces and not _notes_other_losses(found):
        return f"{report.declared_faces} declared, {len(polygons)} kept, {lost} reported lost"
    got = {tuple(row) for row in (mesh.vertices[mesh.faces].reshape(-1, 9) + 0.0).tolist()}
    if not corners <= got:
        return f"{len(corners - got)} triangles are not those of the plain reader"
    return ""


def _notes_other_losses(found: Imported) -> bool:
    return any(c.what == "not_placed" for c in found.report.reading)


def sentence_fault(path: Path, text: str) -> str:
    """Return what a refusal lacks: the file's name, a fact, a remedy; no traceback."""
    if path.name not in text:
        return f"does not name the file: {text}"
    if len(re.findall(r"[.;] [A-Z“]|\.$", text)) < 2 or "Traceback" in text or "Error" in text:
        return f"no fact and remedy: {text}"
    return "not foreseen: " + text if "not foreseen" in text else ""


def experimental_seeds(folder: Path) -> dict[str, tuple[str, bytes]]:
    """Return small files in the other formats that open: name to (format, content)."""
    vertices, faces = grid()
    kept = np.array([f for f in faces if len(f) == 3])
    save(Mesh(vertices, kept), folder / "seed.glb")
    return {
        "seed.glb": ("glTF", (folder / "seed.glb").read_bytes()),
        "seed.dae": ("DAE", _dae(vertices, kept)),
        "seed.x3d": ("X3D", _x3d(vertices, faces)),
        "seed.3ds": ("3DS", _3ds(vertices, kept)),
    }


def _spelt(numbers: np.ndarray) -> str:
    return " ".join(map(repr, numbers.ravel().tolist()))


def _source(key: str, rows: np.ndarray, names: str) -> str:
    params = "".join(f'<param name="{n}" type="float"/>' for n in names)
    return (
        f'<source id="{key}"><float_array id="{key}-array" count="{rows.size}">{_spelt(rows)}'
        f'</float_array>\n<technique_common><accessor source="#{key}-array" count="{len(rows)}" '
        f'stride="{rows.shape[1]}">{params}</accessor></technique_common></source>\n'
    )


def _dae(v: np.ndarray, triangles: np.ndarray) -> bytes:
    """Return a COLLADA file with a normal for each triangle, beside the vertices."""
    rows = np.dstack([triangles, np.repeat(np.arange(len(triangles))[:, None], 3, axis=1)])
    corners = v[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n'
        '<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>\n'
        '<library_geometries><geometry id="sheet"><mesh>\n'
        + _source("places", v, "XYZ")
        + _source("normals", normals, "XYZ")
        + '<vertices id="joined"><input semantic="POSITION" source="#places"/></vertices>\n'
        f'<triangles count="{len(triangles)}">\n'
        '<input semantic="VERTEX" source="#joined" offset="0"/>\n'
        '<input semantic="NORMAL" source="#normals" offset="1"/>\n'
        f"<p>{_spelt(rows)}</p>\n</triangles></mesh></geometry></library_geometries>\n"
        '<library_visual_scenes><visual_scene id="world"><node id="n">\n'
        '<instance_geometry url="#sheet"/></node></visual_scene></library_visual_scenes>\n'
        '<scene><instance_visual_scene url="#world"/></scene></COLLADA>\n'
    ).encode()


def _x3d(v: np.ndarray, faces: list[tuple[int, ...]]) -> bytes:
    rows = "\n".join(" ".join(map(str, f)) + " -1" for f in faces)
    places = ",\n".join(" ".join(map(repr, row)) for row in v.tolist())
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<X3D profile="Interchange" version="3.1"><head/>\n<Scene>\n<Shape>\n'
        '<Appearance><Material diffuseColor="0.8 0.8 0.8"/></Appearance>\n'
        f'<IndexedFaceSet solid="false" coordIndex="{rows}">\n'
        f'<Coordinate point="{places}"/>\n</IndexedFaceSet>\n</Shape>\n</Scene>\n</X3D>\n'
    ).encode()


def _chunk(kind: int, content: bytes) -> bytes:
    return kind.to_bytes(2, "little") + (6 + len(content)).to_bytes(4, "little") + content


def _3ds(v: np.ndarray, triangles: np.ndarray) -> bytes:
    rows = np.column_stack([triangles, np.full(len(triangles), 7)]).astype("<u2")
    mesh = _chunk(0x4110, len(v).to_bytes(2, "little") + v.astype("<f4").tobytes())
    mesh += _chunk(0x4120, len(rows).to_bytes(2, "little") + rows.tobytes())
    named = _chunk(0x4000, b"sheet\0" + _chunk(0x4100, mesh))
    return _chunk(0x4D4D, _chunk(0x0002, bytes([3, 0, 0, 0])) + _chunk(0x3D3D, named))


def damaged_files(
    count: int, seed: int, files: dict[str, tuple[str, bytes]]
) -> Iterator[tuple[str, str, bytes]]:
    """Give `count` damaged files as name, how, content; the `files` take turns."""
    rng = random.Random(seed)
    kinds = list(files.items())
    for i in range(count):
        name, (kind, data) = kinds[i % len(kinds)]
        how, damaged = mutated_file(name, kind, data, rng)
        yield name, f"{i} {how}", damaged


def run(count: int, seed: int, folder: Path, experimental: bool = False) -> Tally:
    """Open `count` damaged files one after the other."""
    files = experimental_seeds(folder) if experimental else seeds()
    tally = Tally(list(files))
    last = worker.pid
    for name, how, data in damaged_files(count, seed, files):
        path = folder / name
        path.write_bytes(data)
        try:
            found = open_file(path)
        except FileError as error:
            tally.refused[name] += 1
            tally.stopped[name] += "stopped the reader" in str(error)
            fault = sentence_fault(path, str(error))
        else:
            tally.opened[name] += 1
            fault = fault_of(path, found, data)
        if fault:
            tally.faults.append(f"{name} {how}: {fault}")
            (folder / f"fault-{how.split()[0]}-{name}").write_bytes(data)
        if worker.pid != last:
            tally.respawns += last is not None
            last = worker.pid
    return tally


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--experimental", action="store_true", help="glTF, DAE, X3D and 3DS")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="eigenform-mutations-"))
    tally = run(options.count, options.seed, folder, options.experimental)
    for name in tally.names:
        ended = f"of them by the end of the worker {tally.stopped[name]:4}"
        print(f"{name:12} opened {tally.opened[name]:6} refused {tally.refused[name]:6}, {ended}")
    print(f"worker replaced {tally.respawns} times; {len(tally.faults)} faults (files in {folder})")
    for fault in tally.faults[:50]:
        print(fault)
    return int(bool(tally.faults))


if __name__ == "__main__":
    sys.exit(main())
