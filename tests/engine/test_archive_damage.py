"""A damaged `.eigenform` file: what can be had of it is had, and what is lost is said."""

from __future__ import annotations

import json
import random
from pathlib import Path

import numpy as np
import pytest

from engine import Cancelled, Document, EditOptions, History, Mesh, Run, SketchEdit, Source, Stroke
from engine.archive import open_archive, save_archive
from tests.engine.documents_on_disk import outcome, rewritten
from tests.engine.histories import KINDS, Nudge, fingerprint, grid, view

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
