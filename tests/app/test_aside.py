"""What takes longer than a moment is worked out aside, and is the same to the last bit."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from PySide6.QtCore import Qt

import app.solving
import app.stage
from app.form import Form
from app.jobs import Jobs
from app.viewport import layers
from app.viewport.aside import Aside
from app.viewport.scene import Scene
from app.viewport.surface import Surface
from app.window import Window
from tests.app.designing import CTRL, curve, enter, modes, region, rest
from tests.app.viewport_stage import torus
from tests.program import PATIENCE

# ---- what is asked for


def test_what_is_worked_out_is_handed_over_in_the_windows_thread(qtbot) -> None:
    aside, threads, taken = Aside(), [], []

    def work() -> int:
        threads.append(threading.get_ident())
        return 7

    aside.ask("a", work, lambda made: taken.append((made, threading.get_ident())))
    assert aside.under_way
    qtbot.waitUntil(lambda: not aside.under_way)
    assert taken == [(7, threading.get_ident())]
    assert threads[0] != threading.get_ident()


def test_of_one_kind_the_newest_counts_and_what_is_between_is_never_begun(qtbot) -> None:
    aside, gate, done, taken = Aside(), threading.Event(), [], []

    def work(number: int) -> int:
        done.append(number)
        assert gate.wait(PATIENCE)
        return number

    for number in range(4):
        aside.ask("a", lambda n=number: work(n), taken.append)
    gate.set()
    qtbot.waitUntil(lambda: not aside.under_way)
    assert done == [0, 3]
    assert taken == [3]


def test_what_is_dropped_is_not_handed_over(qtbot) -> None:
    aside, gate, taken = Aside(), threading.Event(), []
    aside.ask("a", lambda: gate.wait(PATIENCE), lambda _made: taken.append("a"))
    aside.drop("a")
    assert not aside.under_way
    gate.set()
    aside.ask("a", lambda: None, lambda _made: taken.append("another"))
    qtbot.waitUntil(lambda: bool(taken))
    assert taken == ["another"]


# ---- the form


def test_a_surface_moved_aside_is_the_one_moved_at_once() -> None:
    mesh = torus(6000)

    def surface() -> Surface:
        incidence = mesh.topology.incidence
        return Surface(mesh.vertices, mesh.faces, (9, 9, 9), incidence=incidence)

    at_once, aside = surface(), surface()
    ids = np.flatnonzero(mesh.vertices[:, 0] > 0)
    places = mesh.vertices[ids] * 1.25
    ring = at_once.move(places, ids)
    kept = aside.positions
    before = kept.copy()
    made = aside.moved_to(places, ids)
    assert (kept == before).all(), "nothing is seen of it until it is taken"
    aside.take(made)
    assert (made.about.ring == ring).all()
    assert (aside.positions == at_once.positions).all()
    assert (aside.normals == at_once.normals).all()
    assert aside.reach == at_once.reach
    assert aside.stamp[1] == at_once.stamp[1], "it counts as one move"
    drawn = aside.data.GetPoint(int(ids[0]))
    assert drawn == pytest.approx(tuple(at_once.positions[ids[0]]))


@pytest.fixture
def threads(monkeypatch) -> dict[str, set[bool]]:
    """Whether it was the window's thread that worked out what takes long, by its name."""
    seen: dict[str, set[bool]] = {"moved_to": set(), "made_ghost": set(), "marked": set()}
    window = threading.get_ident()

    def noted(kind: type, name: str) -> None:
        work = getattr(kind, name)

        def call(*given):
            # Of a ghost that is apart at few vertices there is little to work out.
            if name != "made_ghost" or given[2] is None or len(given[2]) > 20:
                seen[name].add(threading.get_ident() == window)
            return work(*given)

        monkeypatch.setattr(kind, name, call)

    noted(Surface, "moved_to")
    noted(Scene, "made_ghost")
    noted(Scene, "marked")
    return seen


@pytest.mark.window
def test_a_large_region_is_shown_ready_made(window: Window, qtbot, monkeypatch, threads) -> None:
    for module in (app.stage, layers):
        monkeypatch.setattr(module, "MANY", 20)
    session, view = window.session, window.viewport
    opened = session.document.mesh
    moves: list[object] = []
    move = Surface.move
    monkeypatch.setattr(Surface, "move", lambda *given: (moves.append(given), move(*given)))
    roi = region(window, qtbot)
    modes(window, qtbot)
    assert len(roi) > 20
    rest(window, qtbot)
    _shown_as_it_is(window)
    assert view.scene.ghost is not None
    curve(window, qtbot, -0.2)
    _shown_as_it_is(window)
    enter(window, qtbot)
    _shown_as_it_is(window)
    while session.document.draft.roi is not None:
        qtbot.keyClick(view, Qt.Key.Key_Z, CTRL)
    rest(window, qtbot)
    assert (view.vertices == opened.vertices).all()
    _shown_as_it_is(window)
    assert not moves, "no move of so much was worked out in the window's thread"
    assert threads == {"moved_to": {False}, "made_ghost": {False}, "marked": {False}}


def _shown_as_it_is(window: Window) -> None:
    view = window.viewport
    assert (view.vertices == window.session.shown.vertices).all()
    there = view.scene.placement.to_scene(view.vertices).astype(np.float32)
    assert (view.scene.surface.positions == there).all()


@pytest.mark.window
def test_what_is_shown_next_takes_the_place_of_a_form_that_is_still_made(
    window: Window, qtbot, monkeypatch
) -> None:
    for module in (app.stage, layers):
        monkeypatch.setattr(module, "MANY", 20)
    stage, view, opened = window.stage, window.viewport, window.session.document.mesh
    gate, begun, made = threading.Event(), threading.Event(), Surface.moved_to

    def held(*given):
        begun.set()
        assert gate.wait(PATIENCE)
        return made(*given)

    monkeypatch.setattr(Surface, "moved_to", held)
    ids = np.arange(200)
    stage._draw(Form(opened, ids, opened.vertices[ids] + 1.0))
    assert begun.wait(PATIENCE)
    assert stage.flowing, "it is on its way"
    few = np.arange(10)
    stage._flow(Form(opened, few, opened.vertices[few] + 1.0))
    gate.set()
    rest(window, qtbot)
    assert not stage.flowing
    assert (view.vertices[few] == opened.vertices[few] + 1.0).all()
    assert (view.vertices[10:] == opened.vertices[10:]).all()


@pytest.mark.window
def test_a_large_region_is_not_factorised_before_anybody_asks(
    window: Window, qtbot, monkeypatch
) -> None:
    monkeypatch.setattr(app.solving, "MOST_AHEAD", 20)
    channels: list[str] = []
    submit = Jobs.submit

    def noted(jobs: Jobs, channel: str, *given, **more):
        channels.append(channel)
        return submit(jobs, channel, *given, **more)

    monkeypatch.setattr(Jobs, "submit", noted)
    region(window, qtbot)
    modes(window, qtbot)
    solving = window.session._showing._solving
    qtbot.waitUntil(lambda: not solving._rest.isActive())
    assert "decompose" in channels
    assert "prepare" not in channels
    monkeypatch.setattr(app.solving, "MOST_AHEAD", 20_000)
    solving.prepare_soon(window.session.document)
    qtbot.waitUntil(lambda: "prepare" in channels)
