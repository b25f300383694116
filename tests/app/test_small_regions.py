"""Regions of a dozen vertices: they are seen, and can be reshaped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.look import RIM, rgb8
from app.viewport.tint import feathered
from app.window import Window
from engine import Mesh, grown
from tests.app.designing import draw, enter, region
from tests.app.driving import bow, picture, pixels


def test_a_small_region_looks_like_it_and_a_large_one_fades_out(sphere: Mesh) -> None:
    topology = sphere.topology
    ids = np.array([1500])
    for rings in range(12):
        tint = feathered(ids, sphere.faces, topology.incidence, sphere.n)
        assert (tint.weight[ids] > 0.5).mean() >= 0.85, f"{len(ids)} vertices"
        outside = np.setdiff1d(np.arange(sphere.n), ids)
        assert (tint.weight[outside] > 0.5).mean() < 0.02
        if rings > 8:
            assert np.unique(tint.weight).size > 20, "it fades out"
        ids = grown(topology, ids)


@pytest.mark.window
def test_a_dozen_vertices_are_seen_and_follow_a_curve(
    window: Window, qtbot, artefacts: Path
) -> None:
    session, view = window.session, window.viewport
    roi = region(window, qtbot, 0.0, 0.0, 0.052)
    assert 6 <= len(roi) <= 24, len(roi)
    picture(window, artefacts, "a dozen vertices")
    assert rim_pixels(window) > 40, "its rim is drawn"
    draw(window, qtbot, bow(view, (-0.03, 0.0), (0.03, 0.0)))
    assert session.document.draft.source is not None, window.hint.text
    draw(window, qtbot, bow(view, (-0.03, -0.03), (0.03, -0.03)))
    picture(window, artefacts, "a dozen vertices and a target")
    assert session.target_error < 0.5
    enter(window, qtbot)
    assert np.abs(session.document.mesh.vertices - session.document.original.vertices).max() > 0.5


@pytest.mark.window
def test_too_few_vertices_for_a_curve_are_told_with_a_way_out(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    vertex = int(np.argmin(view.view().depth(session.document.mesh.vertices)))
    place = view.view().project(session.document.mesh.vertices[[vertex]])[0]
    middle = np.array([view.width() / 2, view.height() / 2])
    x, y = (place - middle) / view.height()
    roi = region(window, qtbot, x, y, 0.013)
    assert len(roi) == 1
    draw(window, qtbot, bow(view, (x - 0.03, y), (x + 0.03, y)))
    assert "too few for a curve" in window.hint.text
    spot = window.hint.place_of("region.grow")
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=spot.toPoint())
    assert len(session.document.draft.roi) > 4, "a click grows it"


def rim_pixels(window: Window) -> int:
    """How many pixels of the viewport are as amber as the rim."""
    seen = pixels(window.viewport)
    return int((np.abs(seen - np.array(rgb8(RIM))).max(axis=-1) < 60).sum())
