"""The `.eigenform` file: everything is there again to the last bit."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine import Document, Draft, EditOptions, History, SketchEdit, Source, Stroke, UnknownStep
from engine.archive import open_archive, save_archive
from engine.packing import stored_form
from tests.engine.documents_on_disk import WINDOW
from tests.engine.histories import KINDS, PNG, fingerprint, grid, history, view


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


@pytest.mark.parametrize(
    ("ids", "written"),
    [
        ([], "<i4"),
        ([0, 2**31 - 1], "<i4"),
        ([-(2**31), 5], "<i4"),
        ([0, 2**31], "<i8"),
        ([-(2**31) - 1, 0], "<i8"),
    ],
)
def test_ids_take_four_bytes_where_they_fit(ids: list[int], written: str) -> None:
    stored = stored_form(np.array(ids, dtype=np.int64))
    assert stored.dtype.str == written
    assert stored.tolist() == ids


def test_an_array_of_any_layout_is_written_row_by_row() -> None:
    rows = np.arange(12.0).reshape(3, 4)
    for laid_out in (rows.T.copy().T, np.repeat(rows, 2, axis=1)[:, ::2], rows.astype(">f8")):
        stored = stored_form(laid_out)
        assert stored.dtype.str == "<f8"
        assert stored.flags.c_contiguous
        assert (stored == rows).all()
