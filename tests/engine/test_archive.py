"""The `.eigenform` file: to the last bit there and back, salvaged when damaged, never trusted."""

from __future__ import annotations

import errno
import json
import os
import pickle
import random
import stat
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine import (
    Cancelled,
    Document,
    Draft,
    EditOptions,
    EngineError,
    FileError,
    History,
    Mesh,
    Run,
    SketchEdit,
    Source,
    Stroke,
    UnknownStep,
)
from engine.archive import FORMAT_VERSION, Archive, open_archive, save_archive
from engine.files.place import beside
from tests.engine.histories import KINDS, PNG, Nudge, fingerprint, grid, history, view

WINDOW = {"camera": [0.1, 2, None, "a"], "open": {"x": True}}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str]:
    """The bytes of a small document file, and the fingerprint of what is in it."""
    path = tmp_path_factory.mktemp("whole") / "small.eigenform"
    state = history().state()
    save_archive(path, state, {0: PNG, 2: PNG + b"2"}, WINDOW)
    return path.read_bytes(), fingerprint(state)


def rewritten(data: bytes, path: Path, change: Any) -> Path:
    """Write the document file `data` to `path` with its members (a dict) changed by `change`."""
    import io

    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members = change(members) or members
    with zipfile.ZipFile(path, "w") as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return path


def with_manifest(data: bytes, path: Path, change: Any) -> Path:
    """Write the document file `data` with its manifest (a dict) changed by `change`."""

    def changed(members: dict[str, bytes]) -> None:
        manifest = json.loads(members["manifest.json"])
        change(manifest)
        text = json.dumps(manifest).encode()
        members["manifest.json"] = members["manifest-copy.json"] = text

    return rewritten(data, path, changed)


def test_everything_comes_back_to_the_last_bit(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = tmp_path / "ä b.eigenform"
    path.write_bytes(whole[0])
    found = open_archive(path, KINDS)
    assert found.report == ()
    assert fingerprint(found.state) == whole[1]
    assert dict(found.pictures) == {0: PNG, 2: PNG + b"2"}
    assert found.window == WINDOW
    save_archive(path, found.state, found.pictures, found.window)
    assert path.read_bytes() == whole[0], "the same document gives the same bytes"


def test_a_name_of_any_bytes_comes_back(tmp_path: Path) -> None:
    name = os.fsdecode(b"\xff\xfe caf\xe9.obj")
    path = tmp_path / "a.eigenform"
    save_archive(path, History(Document.open(grid(), name)).state())
    assert open_archive(path, KINDS).state.current.name == name


def test_history_goes_on_after_opening(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(whole[0])
    again = open_archive(path, KINDS).history
    assert again.can_redo
    assert again.redo().recipe.steps[-1].title == "Nudge"
    added = again.add(again.current, "More")
    assert added.id == max(again.moments) == 6
    while again.can_undo:
        again.undo()
    assert again.current.mesh is again.current.original


def test_what_was_shared_is_shared_again(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(whole[0])
    moments = open_archive(path, KINDS).state.moments
    region, target, step = (moments[i].document for i in (1, 2, 3))
    assert region.recipe is target.recipe
    assert step.recipe is not target.recipe
    assert region.draft.roi is target.draft.roi is step.draft.roi
    assert region.mesh is target.mesh is region.original
    assert moments[4].document.recipe.steps[0] is step.recipe.steps[0]


def test_a_step_of_a_missing_plugin_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    state = history().state()
    save_archive(path, state)
    found = open_archive(path, {})
    kinds = {type(step) for m in found.state.moments.values() for step in m.document.recipe.steps}
    assert kinds == {UnknownStep}
    save_archive(path, found.state)
    assert fingerprint(open_archive(path, KINDS).state) == fingerprint(state)


@settings(max_examples=25, deadline=None)
@given(
    data=st.recursive(
        st.none()
        | st.booleans()
        | st.integers(-(2**70), 2**70)
        | st.floats(allow_nan=False, allow_infinity=False)
        | st.text(max_size=8),
        lambda inner: (
            st.lists(inner, max_size=80)
            | st.dictionaries(st.sampled_from(["array", "a", "shape", "ü"]), inner, max_size=3)
        ),
        max_leaves=25,
    ),
    numbers=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=70, max_size=90),
)
def test_any_json_of_a_step_survives(
    data: Any, numbers: list[float], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("json") / "a.eigenform"
    given_data = {"x": data, "long": numbers, "rows": [numbers[:35], numbers[35:70]]}
    begun = History(Document.open(grid()))
    step = UnknownStep("stranger", given_data)
    begun.add(begun.current.with_step(step, begun.current.mesh), "S")
    save_archive(path, begun.state())
    found = open_archive(path, {}).state.current.recipe.steps[0]
    assert repr(found.to_json()) == repr(given_data)


def test_meshes_are_stored_by_the_rows_that_moved(tmp_path: Path) -> None:
    short, long = tmp_path / "short.eigenform", tmp_path / "long.eigenform"
    save_archive(short, history(side=60, steps=1).state())
    save_archive(long, history(side=60, steps=41).state())
    per_step = (long.stat().st_size - short.stat().st_size) / 40
    assert per_step < 0.1 * grid(60).vertices.nbytes


# ---- damage


def outcome(path: Path, fingerprint_of_whole: str) -> str:
    """Open a damaged file: "whole", "partial" or "refused"; anything else fails the test."""
    try:
        found = open_archive(path, KINDS)
    except FileError as error:
        sentence = str(error)
    else:
        sentence = ""
    if sentence:
        assert path.name in sentence
        assert sentence.endswith(".")
        return "refused"
    check_sound(found)
    if found.report:
        assert all(line.endswith(".") for line in found.report)
        return "partial"
    assert fingerprint(found.state) == fingerprint_of_whole, "a change went unnoticed"
    assert dict(found.pictures) == {0: PNG, 2: PNG + b"2"}
    return "whole"


def check_sound(found: Archive) -> None:
    for moment in found.state.moments.values():
        mesh = moment.document.mesh
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.max() < mesh.n
        assert moment.parent is None or moment.parent in found.state.moments
    again = found.history
    while again.can_undo:
        again.undo()


STRIDES = [pytest.param(61), pytest.param(1, marks=pytest.mark.soak)]


@pytest.mark.parametrize("stride", STRIDES)
def test_cut_off_anywhere(stride: int, whole: tuple[bytes, str], tmp_path: Path) -> None:
    data, mark = whole
    path = tmp_path / "cut.eigenform"
    outcomes = []
    for length in [*range(0, len(data), stride), *range(len(data) - 25, len(data))]:
        path.write_bytes(data[:length])
        outcomes.append(outcome(path, mark))
    assert "whole" not in outcomes
    # Once the original surface is there, every longer rest gives something back.
    first = outcomes.index("partial")
    assert set(outcomes[first:]) == {"partial"}
    assert first * stride < 0.75 * len(data)


@pytest.mark.parametrize("stride", STRIDES)
def test_one_bit_flipped_anywhere(stride: int, whole: tuple[bytes, str], tmp_path: Path) -> None:
    data, mark = whole
    path = tmp_path / "flip.eigenform"
    dice = random.Random(5)
    counts = {"whole": 0, "partial": 0, "refused": 0}
    for at in range(0, len(data), stride):
        flipped = bytearray(data)
        flipped[at] ^= 1 << dice.randrange(8)
        path.write_bytes(flipped)
        counts[outcome(path, mark)] += 1
    # Only what hits the original surface itself may cost the whole document.
    assert counts["refused"] < 0.35 * sum(counts.values())
    assert counts["partial"] > 0.3 * sum(counts.values())


def test_spliced_swapped_and_blanked(whole: tuple[bytes, str], tmp_path: Path) -> None:
    data, mark = whole
    path = tmp_path / "mangled.eigenform"
    dice = random.Random(6)
    for _ in range(200):
        mangled = bytearray(data)
        a, b = sorted(dice.randrange(len(data)) for _ in range(2))
        match dice.randrange(4):
            case 0:
                del mangled[a:b]
            case 1:
                mangled[a:b] = bytes(b - a)
            case 2:
                mangled[a:a] = data[b : b + 50]
            case 3:
                mangled[a : a + 20] = dice.randbytes(20)
        path.write_bytes(mangled)
        outcome(path, mark)


def without_surfaces(data: bytes, path: Path, arrays: tuple[str, ...]) -> Path:
    """Write the document file `data` without the `arrays` of the surfaces that steps made."""

    def lose(members: dict[str, bytes]) -> None:
        meshes = json.loads(members["manifest.json"])["meshes"]
        for entry in meshes.values():
            if "base" in entry:
                for name in arrays:
                    members.pop(f"arrays/{entry[name]}.npy", None)

    return rewritten(data, path, lose)


def test_lost_surfaces_are_computed_again_from_the_steps(
    whole: tuple[bytes, str], tmp_path: Path
) -> None:
    path = without_surfaces(whole[0], tmp_path / "a.eigenform", ("values",))
    found = open_archive(path, KINDS)
    assert fingerprint(found.state) == whole[1]
    (told,) = found.report
    assert told.startswith("3 of 6 states were damaged and computed again from the steps")


def test_what_a_step_no_longer_gives_is_lost(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = without_surfaces(whole[0], tmp_path / "a.eigenform", ("values",))

    class Changed(Nudge):
        def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
            moved = super().apply(mesh, run).vertices
            return mesh.with_vertices(np.nextafter(moved, np.inf))

    for kinds in ({"nudge": Changed}, {}):
        found = open_archive(path, kinds)
        assert sorted(found.state.moments) == [0, 1, 2]
        assert found.report[0].startswith("3 of 6 states could not be read.")


def test_a_sketch_is_computed_again_and_a_cancel_is_heard(tmp_path: Path) -> None:
    mesh = grid(20)
    roi = np.flatnonzero(np.hypot(*(mesh.vertices[:, :2] - 1 / 6).T) < 0.12)
    anchors = roi[len(roi) // 2 : len(roi) // 2 + 3]
    stroke = Stroke(anchors, view(), Source(anchors, view()).still(mesh).target + 5.0)
    begun = History(Document.open(mesh))
    for level in (0.3, 0.8):
        edit = SketchEdit(roi, level, (stroke,), EditOptions())
        begun.add(begun.current.with_step(edit, edit.apply(begun.current.mesh)), "Sketch")
    save_archive(tmp_path / "whole.eigenform", begun.state())
    data = (tmp_path / "whole.eigenform").read_bytes()
    path = without_surfaces(data, tmp_path / "a.eigenform", ("rows", "values"))
    kinds = {"sketch": SketchEdit}
    assert fingerprint(open_archive(path, kinds).state) == fingerprint(begun.state())

    def stop(_fraction: float, _text: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        open_archive(path, kinds, Run(stop))


def test_a_lost_state_costs_only_itself(whole: tuple[bytes, str], tmp_path: Path) -> None:
    def lose_step_of_last(members: dict[str, bytes]) -> None:
        manifest = json.loads(members["manifest.json"])
        lost = manifest["moments"][-1]["document"]
        del members[f"arrays/{manifest['meshes'][lost['mesh']]['values']}.npy"]
        del manifest["steps"][lost["steps"][-1]]
        members["manifest.json"] = members["manifest-copy.json"] = json.dumps(manifest).encode()

    path = rewritten(whole[0], tmp_path / "a.eigenform", lose_step_of_last)
    found = open_archive(path, KINDS)
    assert sorted(found.state.moments) == [0, 1, 2, 3, 4]
    assert found.report[0].startswith("1 of 6 states could not be read.")


def test_without_its_list_the_surface_is_left(whole: tuple[bytes, str], tmp_path: Path) -> None:
    def lose_manifests(members: dict[str, bytes]) -> None:
        members["manifest.json"] = members["manifest-copy.json"] = b"{"

    path = rewritten(whole[0], tmp_path / "a.eigenform", lose_manifests)
    found = open_archive(path, KINDS)
    assert found.state.current.mesh.digest == grid().digest
    assert "Only the original surface" in found.report[-1]


# ---- hostility


def refused(path: Path) -> str:
    with pytest.raises(FileError) as caught:
        open_archive(path, KINDS)
    return str(caught.value)


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


def test_a_sketch_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    mesh = grid(20)
    roi = np.flatnonzero(np.hypot(*(mesh.vertices[:, :2] - 1 / 6).T) < 0.12)
    anchors = roi[len(roi) // 2 : len(roi) // 2 + 3]
    source = Source(anchors, view(), weights=np.array([0.3, 1.0, 1 / 7]))
    target = source.still(mesh).target + 0.1
    stroke = Stroke(anchors, view(), target, weights=source.weights)
    options = EditOptions(
        depth_hold=1 / 3, amount=0.7, pins=(int(roi[0]),), mirror=(1.0, 0.0, 0.0, 0.2)
    )
    edit = SketchEdit(roi, 1 / 3, (stroke,), options)
    begun = History(Document.open(mesh))
    begun.add(begun.current.with_draft(Draft(roi, 1 / 3, source, (stroke,), options)), "Draft")
    begun.add(begun.current.with_step(edit, mesh), "Sketch")
    save_archive(tmp_path / "a.eigenform", begun.state())
    found = open_archive(tmp_path / "a.eigenform", {"sketch": SketchEdit})
    assert found.report == ()
    assert fingerprint(found.state) == fingerprint(begun.state())


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
    refused(tmp_path / "absent.eigenform")
    refused(tmp_path)


# ---- writing


def test_a_failed_write_leaves_the_old_file(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(whole[0])
    bad = History(Document.open(grid()))
    bad.add(bad.current.with_step(UnknownStep("x", {"t": float("nan")}), bad.current.mesh), "bad")
    with pytest.raises((EngineError, ValueError)):
        save_archive(path, bad.state())
    assert path.read_bytes() == whole[0]
    assert [p.name for p in tmp_path.iterdir()] == ["a.eigenform"]


def test_a_full_disk_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(b"old")

    def full(_handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError, match="disk is full"):
        save_archive(path, history().state())
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


def test_what_reads_back_wrong_never_takes_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(b"old")
    real = os.fsync

    def bad_disk(handle: int) -> None:
        os.lseek(handle, -900, os.SEEK_END)
        os.write(handle, b"?" * 8)
        real(handle)

    monkeypatch.setattr(os, "fsync", bad_disk)
    with pytest.raises(FileError, match="reads back wrong"):
        save_archive(path, history().state())
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


def test_no_permission_is_said(tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    folder.chmod(0o500)
    try:
        if os.access(folder, os.W_OK):
            pytest.skip("this user may write everywhere")
        with pytest.raises(FileError, match="not allowed"):
            save_archive(folder / "a.eigenform", history().state())
    finally:
        folder.chmod(0o700)


def test_absent_folders_and_long_names_are_said(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="folder is not there"):
        save_archive(tmp_path / "absent" / "a.eigenform", history().state())
    with pytest.raises(FileError, match="too long"):
        save_archive(tmp_path / ("n" * 300), history().state())
    with pytest.raises(FileError, match="there is a folder"):
        save_archive(tmp_path, history().state())


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege there")
def test_links_are_followed_and_modes_kept(tmp_path: Path) -> None:
    real, link = tmp_path / "real.eigenform", tmp_path / "link.eigenform"
    real.write_bytes(b"old")
    real.chmod(0o640)
    link.symlink_to(real)
    save_archive(link, history().state())
    assert link.is_symlink()
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert open_archive(real, KINDS).report == ()


def test_what_killed_writers_left_is_swept(tmp_path: Path) -> None:
    with beside(tmp_path / "a.eigenform", ".eigenform") as part:
        ours = part.name
    dead = ours.replace(f"-{os.getpid()}-", f"-{2**22 + 1}-")
    for name in (ours, dead, "mine.part"):
        (tmp_path / name).write_bytes(b"x")
    save_archive(tmp_path / "a.eigenform", history().state())
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([ours, "a.eigenform", "mine.part"])
