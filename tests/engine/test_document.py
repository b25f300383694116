"""Documents never change, and the history is a tree in which nothing is cut off."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Document, History, Mesh
from tests.engine.histories import Nudge, grid, view


def opened() -> Document:
    return Document.open(grid(), "grid.obj", "mm")


def called(*names: str) -> History:
    """A history of documents with these names, one after the other."""
    history = History(opened())
    for name in names:
        add(history, name)
    return history


def add(history: History, name: str) -> None:
    history.add(history.current.with_view(name, view()), name)


def label(history: History) -> str:
    return history.moments[history.current_id].label


def test_undo_and_redo_walk_the_branch_and_stop_at_its_ends() -> None:
    history = called("a", "b")
    assert (history.can_undo, history.can_redo) == (True, False)
    history.redo()
    assert label(history) == "b"
    assert history.undo() is history.current
    assert label(history) == "a"
    assert history.can_redo
    history.undo()
    history.undo()
    assert (label(history), history.can_undo) == ("Opened", False)
    history.redo()
    assert history.redo() is history.current
    assert label(history) == "b"


def test_what_is_done_after_an_undo_is_a_branch_and_redo_follows_the_newest() -> None:
    history = called("a", "b")
    history.undo()
    add(history, "c")
    history.undo()
    assert label(history) == "a"
    history.redo()
    assert label(history) == "c"
    assert [moment.label for moment in history.moments.values()] == ["Opened", "a", "b", "c"]
    assert history.moments[3].parent == history.moments[2].parent == 1


def test_redo_leads_back_to_where_one_came_from() -> None:
    history = called("a", "b")
    history.undo()
    add(history, "c")
    history.go(2)
    assert label(history) == "b"
    history.undo()
    history.undo()
    history.redo()
    history.redo()
    assert label(history) == "b", "the way down to the moment that was gone to"
    history.go(3)
    history.undo()
    history.redo()
    assert label(history) == "c"


def test_a_slide_is_one_moment() -> None:
    history = called("a")
    later = history.current.with_view("later", view())
    history.amend(later)
    assert history.current is later
    assert (len(history.moments), label(history)) == (2, "a")


def test_what_turned_out_impossible_is_forgotten_unless_something_hangs_on_it() -> None:
    history = called("a", "b")
    assert history.take_back() is history.current
    assert (label(history), history.can_redo, sorted(history.moments)) == ("a", False, [0, 1])
    add(history, "c")
    history.undo()
    history.take_back()
    assert (label(history), len(history.moments)) == ("a", 3), "c hangs on it"
    history.go(0)
    history.take_back()
    assert len(history.moments) == 3, "the first one never"


def test_a_name_makes_a_variant_and_touches_nothing_else() -> None:
    history = called("a")
    document = history.current
    history.rename(1, "low")
    assert (history.moments[1].name, history.moments[0].name) == ("low", "")
    assert history.current is document


def test_a_state_stays_as_it_was_taken_and_a_history_goes_on_from_it() -> None:
    history = called("a", "b")
    history.undo()
    state = history.state()
    add(history, "c")
    assert sorted(state.moments) == [0, 1, 2]
    again = History.from_state(state)
    again.redo()
    assert label(again) == "b"
    add(again, "d")
    assert again.moments[3].label == "d", "ids are never given twice"


def test_regions_and_views_are_kept_under_their_names() -> None:
    document, roi = opened(), np.arange(3)
    kept = document.with_region("grip", roi).with_view("front", view())
    assert kept.regions["grip"] is roi
    assert set(kept.views) == {"front"}
    assert not document.regions
    assert not document.views
    other = kept.with_region("grip", roi[:2])
    assert len(other.regions["grip"]) == 2
    assert not other.with_region("grip", None).regions
    assert set(other.with_region("grip", None).views) == {"front"}
    with pytest.raises(TypeError):
        kept.regions["x"] = roi


def test_a_step_keeps_the_region_and_one_that_changes_the_triangles_lets_it_go() -> None:
    document, roi = opened(), np.arange(5, 7)
    chosen = document.with_draft(document.draft.with_roi(roi)).with_region("grip", roi)
    step = Nudge(roi, np.full((2, 3), 0.1))
    after = chosen.with_step(step, step.apply(chosen.mesh))
    assert after.recipe.steps == (step,)
    assert after.draft.roi is roi
    assert after.regions["grip"] is roi
    assert after.original is document.mesh
    fewer = chosen.with_step(step, Mesh(chosen.mesh.vertices, chosen.mesh.faces[1:]))
    assert fewer.draft.roi is None
    assert not fewer.regions
