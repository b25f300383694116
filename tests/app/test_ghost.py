"""The ghost: what the level has taken away is seen on the plain form, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from app.window import Window
from tests.app.designing import modes, region, rest
from tests.app.driving import bumpy_sphere, pixels

pytestmark = pytest.mark.window


def tinted(window: Window, qtbot) -> np.ndarray:
    """Return how much the ghost changes each pixel in the middle of the form, 0 to 255."""
    view = window.viewport
    rest(window, qtbot)
    with_ghost = pixels(view)
    view.ghost(None)
    change = np.abs(pixels(view) - with_ghost).max(axis=2)
    high, wide = change.shape
    around = np.s_[high // 2 - high // 10 : high // 2 + high // 10 + 1]
    across = np.s_[wide // 2 - high // 10 : wide // 2 + high // 10 + 1]
    return change[around, across]


def test_small_bumps_are_readable_where_one_looks_straight_at_the_form(make_window, qtbot) -> None:
    window = make_window(bumpy_sphere(8000, 0.06))
    region(window, qtbot, radius=0.25)
    modes(window, qtbot)
    change = tinted(window, qtbot)
    assert (change > 12).mean() > 0.02, "the slopes of bumps are seen"
    assert (change > 12).mean() < 0.6, "what lies between them is not veiled"
    assert change.max() < 120, "and the form is seen through them"


def test_a_feature_that_is_back_on_the_form_is_no_ghost(make_window, qtbot) -> None:
    window = make_window(bumpy_sphere(8000, 0.06))
    region(window, qtbot, radius=0.25)
    modes(window, qtbot)
    window.session.slide_level(0.97)
    change = tinted(window, qtbot)
    assert (change > 12).mean() < 0.02


def test_a_form_without_features_has_outlines_only(make_window, qtbot) -> None:
    window = make_window(bumpy_sphere(8000, 0.0))
    roi = region(window, qtbot, radius=0.25)
    modes(window, qtbot)
    view = window.viewport
    view.set_vertices(view.vertices[roi] * 0.97, roi)  # pushed in: all of the ghost is before it
    assert view.scene.ghost is not None
    change = tinted(window, qtbot)
    assert (change > 12).mean() < 0.02, "what is pushed in is not veiled"


def test_the_ghost_has_no_edge_where_it_runs_into_the_form(make_window, qtbot) -> None:
    window = make_window(bumpy_sphere(8000, 0.0))
    roi = region(window, qtbot, radius=0.4)
    modes(window, qtbot)
    view = window.viewport
    bright = []
    for scale in (0.9985, 0.97):  # only just under it, and well below
        view.set_vertices(window.session.document.mesh.vertices[roi] * scale, roi)
        rest(window, qtbot)
        assert view.scene.ghost is not None, "either way it is there"
        with_ghost = pixels(view)
        hidden = view.scene.ghost.actor
        hidden.VisibilityOff()
        bright.append(np.abs(pixels(view) - with_ghost).max())
        hidden.VisibilityOn()
    near, far = bright
    assert far > 30, "its outline stands off the form"
    assert near < far / 2
