"""Bad tools in the window: named, switched off, and everything else goes on."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import app.jobs
import app.patience
import app.stepping
import app.window
from app.window import Window
from plugins.registry import Found, find_tools
from tests.app.driving import NONE, Mouse, settled
from tests.plugins.misbehaving import GESTURES, QUESTIONS, RELEASE, Asked, Bad

pytestmark = pytest.mark.window


@pytest.fixture
def bad(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bad]:
    """A bad tool that the next window finds; what hangs is let go after the test."""
    tool, found = Bad(), find_tools()
    tools = {**found.items, "bad": tool}
    monkeypatch.setattr(app.window, "find_tools", lambda: Found(tools, ()))
    RELEASE.clear()
    yield tool
    RELEASE.set()


@pytest.fixture
def window(bad: Bad, make_window, sphere) -> Window:
    return make_window(sphere)


def drag(window: Window, by: float = 30.0) -> None:
    middle = np.array([window.viewport.width() / 2, window.viewport.height() / 2])
    Mouse().stroke(window, middle + np.linspace(0, by, 5)[:, None] * [1.0, 0.5])


def use(window: Window, bad: Bad, how: str) -> None:
    bad.how = how
    window.toolhost.choose("bad")
    drag(window)


def assert_usable(window: Window, qtbot) -> None:
    """A region can be circled and is decomposed."""
    window.toolhost.choose("lasso")
    middle = np.array([window.viewport.width() / 2, window.viewport.height() / 2])
    t = np.linspace(0, 2 * np.pi, 30)[:, None]
    Mouse().stroke(window, middle + 90 * np.hstack([np.cos(t), np.sin(t)]))
    qtbot.waitUntil(lambda: window.session.decomposition is not None)


def test_a_bad_gesture_is_named_and_the_tool_switched_off(window: Window, bad: Bad) -> None:
    before = window.session.document
    for how, reason in GESTURES.items():
        window.toolbox.switch_on("bad")
        use(window, bad, how)
        assert window.session.document is before, how
        assert not window.toolhost.in_gesture
        assert window.hint.text.startswith("The tool “Bad” failed and was stopped (")
        assert reason in window.hint.text
        assert "bad" in window.toolbox.switched_off
        assert not window.rail.buttons["bad"].isEnabled()
        window.toolhost.choose("bad")
        assert window.toolhost.active is not bad, "it cannot be taken up again"


def test_a_bad_step_leaves_the_document_as_it_was(window: Window, bad: Bad, qtbot) -> None:
    before = window.session.document
    for how in ("raises", "exits", "none", "not_a_number", "smuggled", "too_many"):
        window.toolbox.switch_on("bad")
        use(window, bad, f"step {how}")
        qtbot.waitUntil(lambda: "bad" in window.toolbox.switched_off)
        qtbot.waitUntil(settled(window))
        assert window.session.document is before, how
        assert "The tool “Bad” failed and was stopped (its step " in window.hint.text
        assert np.isfinite(window.viewport.vertices).all()


@pytest.mark.parametrize("how", ["hangs", "loops"])
def test_a_step_that_hangs_is_left_behind(
    how: str, window: Window, bad: Bad, qtbot, monkeypatch
) -> None:
    monkeypatch.setattr(app.jobs, "SILENCE", 0.6)
    monkeypatch.setattr(app.stepping, "HUNG", 0.3)
    before = window.session.document
    use(window, bad, f"step {how}")
    qtbot.waitUntil(lambda: "bad" in window.toolbox.switched_off)
    assert window.session.document is before
    assert "gave no sign of life" in window.hint.text
    assert not window.session.applying
    assert_usable(window, qtbot)
    if how == "loops":
        engines = [t for t in threading.enumerate() if t.name == "engine"]
        assert len(engines) == 1, "Python that loops is ended"


def test_cancel_leaves_a_step_behind_that_does_not_listen(
    window: Window, bad: Bad, qtbot, monkeypatch, artefacts
) -> None:
    monkeypatch.setattr(app.jobs, "GRACE", 0.3)
    before = window.session.document
    use(window, bad, "step hangs")
    assert window.session.applying
    window.status.refresh()
    window.status.cancel()
    qtbot.waitUntil(lambda: "left behind" in window.hint.text)
    assert "The tool “Bad” did not stop when it was told to" in window.hint.text
    assert window.session.document is before
    assert "bad" not in window.toolbox.switched_off, "it may only have been slow"
    assert_usable(window, qtbot)


def test_work_that_was_interrupted_begins_again(
    window: Window, bad: Bad, qtbot, monkeypatch
) -> None:
    """A preview that hangs inside the streaming of modes takes nothing with it."""
    monkeypatch.setattr(app.jobs, "SILENCE", 1.5)
    monkeypatch.setattr(app.stepping, "HUNG", 0.3)
    assert_usable(window, qtbot)
    use(window, bad, "step hangs")
    qtbot.waitUntil(lambda: "bad" in window.toolbox.switched_off)
    known = window.session.decomposition
    assert known is not None
    qtbot.waitUntil(lambda: window.session.decomposition.complete)


def test_a_gesture_that_loops_is_interrupted(window: Window, bad: Bad, qtbot, monkeypatch) -> None:
    before = window.session.document
    with monkeypatch.context() as short:
        short.setattr(app.patience, "SECONDS", 0.5)
        use(window, bad, "loops")
    assert "did not come back within" in window.hint.text
    assert window.session.document is before
    assert "bad" in window.toolbox.switched_off
    assert_usable(window, qtbot)


@pytest.fixture
def make_asking(make_window, sphere, monkeypatch) -> Iterator[Callable[[str, str], Window]]:
    """A window with a tool in hand that does wrong as soon as it is asked something."""
    found = find_tools()
    RELEASE.clear()

    def make(what: str, how: str) -> Window:
        tool = Asked("", how)
        tools = {"asked": tool, **found.items}
        monkeypatch.setattr(app.window, "find_tools", lambda: Found(tools, ()))
        window = make_window(sphere)
        window.toolhost.choose("asked")
        assert window.toolhost.active is tool
        tool.what = what
        return window

    yield make
    RELEASE.set()


def ask(window: Window) -> None:
    """Let the window ask its tools everything that it asks them."""
    view = window.viewport
    Mouse().send(view, "move", (view.width() / 2, view.height() / 2), NONE)
    window.refresh()
    window.session.choose_region(np.arange(40), "Region")


def assert_left_out(window: Window, reason: str) -> None:
    assert window.toolbox.switched_off == {"asked"}
    assert reason in window.toolbox.reasons["asked"]
    assert window.toolhost.active.id != "asked"
    assert not window.rail.buttons["asked"].isEnabled()


@pytest.mark.parametrize("what", QUESTIONS)
@pytest.mark.parametrize(
    ("how", "reason"), [("raises", "KeyError: 'no {}'"), ("exits", "SystemExit: no {}")]
)
def test_a_tool_that_raises_when_it_is_asked_is_left_out(
    what: str, how: str, reason: str, make_asking
) -> None:
    window = make_asking(what, how)
    ask(window)
    assert_left_out(window, reason.format(what))


@pytest.mark.parametrize("what", QUESTIONS)
def test_a_tool_that_hangs_when_it_is_asked_is_interrupted(
    what: str, make_asking, qtbot, monkeypatch
) -> None:
    window = make_asking(what, "loops")
    with monkeypatch.context() as short:
        short.setattr(app.patience, "SECONDS", 0.3)
        ask(window)
    assert_left_out(window, "did not come back within")
    assert_usable(window, qtbot)


@pytest.mark.parametrize("what", ["claims", "available"])
def test_an_answer_that_is_neither_true_nor_false_is_wrong(what: str, make_asking) -> None:
    window = make_asking(what, "array")
    ask(window)
    assert_left_out(window, "ValueError")
