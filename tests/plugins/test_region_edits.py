"""The region's commands on a document."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Document, EngineError
from plugins.region_edits import REGION_EDITS
from tests.plugins.test_sketch_tools import plate

EDITS = {edit.id: edit for edit in REGION_EDITS}


def test_every_command_changes_the_region_and_nothing_else() -> None:
    empty = Document.open(plate(41))
    away = np.linalg.norm(empty.mesh.vertices, axis=1)
    disc = np.flatnonzero(away < 30)
    document = empty.with_draft(empty.draft.with_roi(disc))
    sizes = {}
    for name, edit in EDITS.items():
        assert not edit.available(empty)
        assert edit.available(document)
        changed = edit.changed(document)
        assert changed.mesh is document.mesh
        assert (np.diff(changed.draft.roi) > 0).all()
        sizes[name] = len(changed.draft.roi)
    assert sizes["shrink"] < len(disc) < sizes["grow"]
    assert sizes["invert"] == empty.mesh.n - len(disc)
    assert abs(sizes["smooth_border"] - len(disc)) < 0.1 * len(disc)


def test_what_cannot_be_done_is_told() -> None:
    empty = Document.open(plate())
    with pytest.raises(EngineError, match="no region"):
        EDITS["grow"].changed(empty)
    dot = empty.with_draft(empty.draft.with_roi(np.array([220])))
    with pytest.raises(EngineError, match="Nothing would be left"):
        EDITS["shrink"].changed(dot)
