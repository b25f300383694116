"""How hard a pen has to press: a curve that is bent, remembered, and used by brush and curves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QSettings, Qt
from PySide6.QtTest import QTest

from app.pen_pressure import KEY, PenPressure, counted, remembered
from app.window import Window
from tests.app.designing import region, rest
from tests.app.driving import NONE, Pen, bow, pixels, press

pytestmark = pytest.mark.window
shares = st.floats(0, 1)


@given(shares, shares, st.floats(-1, 1))
def test_the_curve_rises_from_nothing_to_all(a: float, b: float, firmness: float) -> None:
    low, high = sorted((a, b))
    assert counted(0.0, firmness) == 0.0
    assert counted(1.0, firmness) == 1.0
    assert 0.0 <= counted(low, firmness) <= counted(high, firmness) <= 1.0
    assert counted(a, 0.0) == pytest.approx(a), "linear is what the tablet tells"
    assert counted(a, -abs(firmness)) >= a - 1e-12, "soft: a light touch counts more"
    assert counted(a, abs(firmness)) <= a + 1e-12


def dialog(window: Window) -> PenPressure:
    """Open the dialog as its menu does."""
    window.actions_table.trigger("tools.pen")
    return window.findChildren(PenPressure)[-1]


def test_it_is_bent_by_keys_seen_and_remembered(make_window, sphere, qtbot) -> None:
    window = make_window(sphere)
    shown = dialog(window)
    qtbot.waitUntil(shown.isVisible)
    straight = pixels(shown.curve)
    shown.slider.setFocus()
    for _ in range(4):
        QTest.keyClick(shown.slider, Qt.Key.Key_PageUp)
    assert shown.slider.value() == 100
    assert (pixels(shown.curve) != straight).any(), "the curve is another"
    assert remembered() == 1.0
    assert window.viewport.hands.counted(0.5) == pytest.approx(0.5**4)
    shown.close()
    another = make_window(sphere)
    assert another.viewport.hands.counted(0.5) == pytest.approx(0.5**4), "at the next start too"
    again = dialog(another)
    qtbot.waitUntil(again.isVisible)
    assert again.slider.value() == 100
    QTest.mouseClick(again.linear, Qt.MouseButton.LeftButton)
    assert another.viewport.hands.counted(0.5) == 0.5
    again.close()


def test_the_pen_is_tried_on_the_curve(window: Window, qtbot) -> None:
    shown = dialog(window)
    qtbot.waitUntil(shown.isVisible)
    before = pixels(shown.curve)
    Pen(pressure=0.5).send(shown.curve, "press", (60, 60), NONE)
    assert shown.curve.tried == (0.5, 0.5)
    shown.slider.setValue(100)
    assert shown.curve.tried == pytest.approx((0.5, 0.0625)), "and goes with the curve"
    assert (pixels(shown.curve) != before).any()
    assert window.session.document.draft.roi is None, "nothing is painted for it"
    shown.close()


def test_a_firm_pen_paints_narrower_at_the_same_pressure(make_window, sphere, qtbot) -> None:
    painted = {}
    for firmness in (-1.0, 0.0, 1.0):
        QSettings().setValue(KEY, firmness)
        window = make_window(sphere)
        press(window.viewport, Qt.Key.Key_P)
        Pen(pressure=0.5).stroke(window, bow(window.viewport, (-0.1, 0), (0.1, 0)))
        rest(window, qtbot)
        painted[firmness] = len(window.session.document.draft.roi)
        window.close()
    assert painted[-1.0] > painted[0.0] > painted[1.0]


def test_the_weight_of_a_curve_follows_it(make_window, sphere, qtbot) -> None:
    from dataclasses import replace

    weights = {}
    for firmness in (-0.5, 0.0, 0.5):
        QSettings().setValue(KEY, firmness)
        window = make_window(sphere)
        region(window, qtbot)
        options = window.toolbox.options_of("source")
        window.toolbox.set_options("source", replace(options, weights=True))
        Pen(pressure=0.5).stroke(window, bow(window.viewport, (-0.12, 0), (0.12, 0)))
        weights[firmness] = window.session.document.draft.source.weights
        window.close()
    for firmness, found in weights.items():
        assert np.allclose(found, counted(0.5, firmness))


@pytest.mark.parametrize("broken", ["soft", "nan", "7", ""])
def test_a_broken_setting_is_no_harm(window: Window, broken: str) -> None:
    QSettings().setValue(KEY, broken)
    assert -1.0 <= remembered() <= 1.0
