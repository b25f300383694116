"""`.eigenform` files that mean harm, or are something else: refused, or read with care."""

from __future__ import annotations

import pickle
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine import FileError, SketchEdit
from engine.archive import FORMAT_VERSION, open_archive, save_archive
from tests.engine.documents_on_disk import check_sound, outcome, rewritten, with_manifest
from tests.engine.histories import KINDS, fingerprint, view


def refused(path: Path) -> str:
    with pytest.raises(FileError) as caught:
        open_archive(path, KINDS)
    said = str(caught.value)
    assert said.startswith(f"“{path.name}” ")
    assert re.search(r"\w[.)] [A-Z][^.]+\.$", said), f"no remedy: {said}"
    return said


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "/etc/passwd", "arrays/../x.npy", "C:\\x", "arrays/x", "ü.json"]
)
def test_foreign_names_are_refused(name: str, whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = rewritten(whole[0], tmp_path / "a.eigenform", lambda m: {**m, name: b"x"})
    assert "no document has" in refused(path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.eigenform"]


def test_a_bomb_is_refused_before_it_unfolds(tmp_path: Path) -> None:
    path = tmp_path / "bomb.eigenform"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("manifest.json", b"0" * 50_000_000)
    assert path.stat().st_size < 100_000
    assert "compressed" in refused(path)


def test_parts_that_share_their_bytes_are_refused(whole: tuple[bytes, str], tmp_path: Path) -> None:
    # A directory that names one big member many times: more content than file.
    path = tmp_path / "overlap.eigenform"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", b"x" * 100_000)
        info = archive.infolist()[0]
        for k in range(200):
            twin = zipfile.ZipInfo(f"pictures/{k}.png")
            twin.file_size = twin.compress_size = info.file_size
            twin.CRC, twin.header_offset = info.CRC, info.header_offset
            archive.filelist.append(twin)
    assert path.stat().st_size < 200_000
    refused(path)


def test_the_same_part_twice_is_refused(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(whole[0])
    with pytest.warns(UserWarning, match="Duplicate"), zipfile.ZipFile(path, "a") as archive:
        archive.writestr("manifest.json", b"{}")
    assert "twice" in refused(path)


def test_nothing_is_unpickled(tmp_path: Path, whole: tuple[bytes, str]) -> None:
    trap = tmp_path / "sprung"

    class Trap:
        def __reduce__(self) -> Any:
            return (Path.touch, (trap,))

    body = pickle.dumps(Trap())
    objects = np.empty(1, dtype=object)
    objects[0] = Trap()
    file = tmp_path / "o.npy"
    np.save(file, objects, allow_pickle=True)

    def poison(payload: bytes) -> Any:
        def change(members: dict[str, bytes]) -> None:
            for name in members:
                if name.startswith("arrays/"):
                    members[name] = payload

        return change

    for payload in (file.read_bytes(), body):
        refused(rewritten(whole[0], tmp_path / "a.eigenform", poison(payload)))
    assert not trap.exists()


def test_arrays_that_claim_too_much_are_refused(whole: tuple[bytes, str], tmp_path: Path) -> None:
    def huge(members: dict[str, bytes]) -> None:
        for name in members:
            if name.startswith("arrays/"):
                members[name] = members[name].replace(b"'shape': (16, 3)", b"'shape': (2**60,3)")
                members[name] = members[name].replace(b"(18, 3)", b"(10**9, 3)")

    refused(rewritten(whole[0], tmp_path / "a.eigenform", huge))


ABSURD: list[tuple[str, Any]] = [
    ("version 0", lambda m: m.update(eigenform=0)),
    ("version text", lambda m: m.update(eigenform="1")),
    ("no version", lambda m: m.pop("eigenform")),
    ("moments no list", lambda m: m.update(moments={"a": 1})),
    ("no moments", lambda m: m.update(moments=[])),
    ("meshes no table", lambda m: m.update(meshes=[1])),
    ("mesh key list", lambda m: [d["document"].update(mesh=[1]) for d in m["moments"]]),
    ("mesh to itself", lambda m: [e.update(base=k, faces=None) for k, e in m["meshes"].items()]),
    ("moment ids text", lambda m: [d.update(id="x") for d in m["moments"]]),
    ("moment ids huge", lambda m: [d.update(id=10**400) for d in m["moments"]]),
    ("negative ids", lambda m: [d.update(id=-d["id"] - 1) for d in m["moments"]]),
    ("own parents", lambda m: [d.update(parent=d["id"]) for d in m["moments"]]),
    ("times", lambda m: [d.update(time="now") for d in m["moments"]]),
    ("unit is a list", lambda m: [d["document"].update(unit=["mm"]) for d in m["moments"]]),
    ("level", lambda m: [d["document"]["draft"].update(level=1e300) for d in m["moments"]]),
    ("level true", lambda m: [d["document"]["draft"].update(level=True) for d in m["moments"]]),
    (
        "roi beyond the mesh",
        lambda m: [
            d["document"]["draft"].update(roi={"values": [10**12], "shape": [1]})
            for d in m["moments"]
        ],
    ),
    (
        "roi negative",
        lambda m: [
            d["document"]["draft"].update(roi={"values": [-1], "shape": [1]}) for d in m["moments"]
        ],
    ),
    (
        "roi of floats",
        lambda m: [
            d["document"]["draft"].update(roi={"values": [0.5], "shape": [1]}) for d in m["moments"]
        ],
    ),
    (
        "shape absurd",
        lambda m: [
            d["document"]["draft"].update(roi={"values": [1], "shape": [10**30, -1]})
            for d in m["moments"]
        ],
    ),
    (
        "options",
        lambda m: [
            d["document"]["draft"].update(options={"amount": "a lot"}) for d in m["moments"]
        ],
    ),
    ("steps unknown", lambda m: [d["document"].update(steps=["s999"]) for d in m["moments"]]),
    ("steps numbers", lambda m: [d["document"].update(steps=[3]) for d in m["moments"]]),
    ("muted", lambda m: [d["document"].update(muted=[10**9]) for d in m["moments"]]),
    ("regions", lambda m: [d["document"].update(regions={"a": 1}) for d in m["moments"]]),
    (
        "view flat",
        lambda m: [
            d["document"].update(
                views={"a": {"matrix": {"values": [1.0], "shape": [1]}, "size": [1.0, 1.0]}}
            )
            for d in m["moments"]
        ],
    ),
]


@pytest.mark.parametrize("change", [c for _, c in ABSURD], ids=[name for name, _ in ABSURD])
def test_an_absurd_manifest_is_refused(
    change: Any, whole: tuple[bytes, str], tmp_path: Path
) -> None:
    refused(with_manifest(whole[0], tmp_path / "a.eigenform", change))


SKETCH = {
    "roi": "5-10",
    "level": 0.5,
    "strokes": [{"anchors": [5, 6], "view": view().to_json(), "target": [[1.0, 2.0], [3.0, 4.0]]}],
}


def sketches(**changes: Any) -> Any:
    """Make every step a sketch with `changes`."""
    entry = {"kind": "sketch", "data": {**SKETCH, **changes}}

    def change(manifest: dict[str, Any]) -> None:
        manifest["steps"] = dict.fromkeys(manifest["steps"], entry)

    return change


@pytest.mark.parametrize(
    "changes",
    [
        {"roi": "0-99999999"},
        {"roi": "0-99999999999999999999999"},
        {"roi": " ".join(["0-4000"] * 3)},
        {"roi": "5-"},
        {"roi": "3 -5"},
        {"roi": "3--5"},
        {"level": 1e300},
        {"level": "high"},
        {"options": {"polish": 10**9}},
        {"options": {"amount": 1e308}},
        {"options": {"rim": "none"}},
        {"options": {"pins": [10**30]}},
        {"strokes": [{**SKETCH["strokes"][0], "target": [[1e300, 0.0], [0.0, 0.0]]}]},
        {"strokes": [{**SKETCH["strokes"][0], "anchors": [5, 5]}]},
        {"strokes": "many"},
        {"strokes": [[]] * 10},
    ],
    ids=str,
)
def test_a_recipe_with_absurd_numbers_costs_its_steps(
    changes: dict[str, Any], whole: tuple[bytes, str], tmp_path: Path
) -> None:
    kinds = {"nudge": SketchEdit, "sketch": SketchEdit}
    path = with_manifest(whole[0], tmp_path / "a.eigenform", sketches())
    assert open_archive(path, kinds).report == ()
    path = with_manifest(whole[0], tmp_path / "a.eigenform", sketches(**changes))
    found = open_archive(path, kinds)
    assert found.report[0].startswith("3 of 6 states could not be read.")
    check_sound(found)


def _renumber(manifest: dict[str, Any], old: int, new: int) -> None:
    for moment in manifest["moments"]:
        for name in ("id", "parent"):
            moment[name] = new if moment[name] == old else moment[name]


HARMLESS: list[tuple[str, Any]] = [
    ("current elsewhere", lambda m: m.update(current=10**50)),
    ("redo wild", lambda m: m.update(redo={"0": 10**50, "x": 1, "1": "a", "3": 3})),
    ("window no table", lambda m: m.update(window=[1])),
    ("step absurd", lambda m: [s.update(data={"ids": [1], "by": []}) for s in m["steps"].values()]),
    ("steps without data", lambda m: [step.pop("data") for step in m["steps"].values()]),
    ("root numbered last", lambda m: _renumber(m, 0, 10**6)),
    ("endless times", lambda m: [d.update(time=1e309) for d in m["moments"]]),
    ("rings", lambda m: [d.update(parent=(d["id"] + 1) % 6) for d in m["moments"]]),
    ("unknown field", lambda m: [d["document"].update(aura=3) for d in m["moments"]]),
]


@pytest.mark.parametrize("change", [c for _, c in HARMLESS], ids=[name for name, _ in HARMLESS])
def test_what_can_be_saved_of_an_odd_manifest(
    change: Any, whole: tuple[bytes, str], tmp_path: Path
) -> None:
    found = open_archive(with_manifest(whole[0], tmp_path / "a.eigenform", change), KINDS)
    check_sound(found)
    save_archive(tmp_path / "again.eigenform", found.state)
    again = open_archive(tmp_path / "again.eigenform", KINDS)
    assert again.report == ()
    assert fingerprint(again.state) == fingerprint(found.state)


def test_deep_and_endless_json_is_refused(whole: tuple[bytes, str], tmp_path: Path) -> None:
    for text in (b"[" * 200_000, b'{"eigenform": 1e999}', b"9" * 10_000, b"NaN", b"\xff\xfe"):
        path = rewritten(
            whole[0],
            tmp_path / "a.eigenform",
            lambda m, t=text: m.update({"manifest.json": t, "manifest-copy.json": t}),
        )
        outcome(path, "")


def test_a_newer_version_is_told_apart(whole: tuple[bytes, str], tmp_path: Path) -> None:
    change = {"eigenform": FORMAT_VERSION + 1}
    path = with_manifest(whole[0], tmp_path / "a.eigenform", lambda m: m.update(change))
    assert "Update Eigenform" in refused(path)


@pytest.mark.parametrize(
    "content", [b"", b"PK", b"PK\x03\x04", b"<html>", b"ply\n", b"\x00" * 5000], ids=repr
)
def test_other_files_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.eigenform"
    path.write_bytes(content)
    assert "other.eigenform" in refused(path)


def test_other_zip_files_absent_files_and_folders_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.eigenform"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("word/document.xml", "x")
    assert "not an Eigenform document" in refused(path)
    path.write_bytes(path.read_bytes()[:-30])
    assert "not an Eigenform document" in refused(path), "nor is what is left of one"
    refused(tmp_path / "absent.eigenform")
    refused(tmp_path)
