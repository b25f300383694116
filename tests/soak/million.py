"""How long each act on a form of a million vertices keeps the window's thread.

`xvfb-run -a -s "-screen 0 2600x1800x24" python -m tests.soak.million` does in a real window what a
designer does, one act after the other, and prints for each the longest call of ours: in processor
time of the window's thread, without what software OpenGL takes, and on the clock. With
`--profile DIR` the longest call of each act, if it took more than 40 ms, is written there by
function; the profile itself adds to what it measures, most where many small functions are called.
It fails when a call takes more than 50 ms. A busy machine makes every figure larger: whoever waits
for memory that another program uses is counted as working.
"""

from __future__ import annotations

import argparse
import cProfile
import io
import pstats
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtCore import QPoint, QSettings, Qt
from PySide6.QtTest import QTest

from app.look import Appearance
from app.start import application
from app.viewport import Viewport, gradual, idimage, picture
from app.viewport.heavy import prepare
from app.window import Window
from engine import Document
from tests.app.driving import Mouse, bow, circle, settled
from tests.app.viewport_stage import sphere
from tests.soak.monkey import pump
from tests.soak.stalls import Stopwatch, TraceFunction

ALLOWED = 0.050  # s
CTRL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
PLAIN = Qt.KeyboardModifier.NoModifier
LONGEST = 300.0  # s for one act


class Profiler(Stopwatch):
    """A stopwatch that keeps the profile, by function, of the longest call of each act."""

    folder: Path | None = None
    _profile: cProfile.Profile | None = None
    _worst: dict[str, float]

    def _called(self, frame: FrameType, event: str, given: Any) -> TraceFunction | None:
        idle = self._root is None
        following = super()._called(frame, event, given)
        if idle and self._root is not None and self.folder is not None:
            self._profile = cProfile.Profile(time.thread_time, builtins=True)
            self._profile.enable()
        return following

    def _ended(self, frame: FrameType, event: str, given: Any) -> TraceFunction:
        last = event == "return" and frame is self._root
        if last and self._profile is not None:
            self._profile.disable()
        following = super()._ended(frame, event, given)
        if last and self._profile is not None:
            self._write(self._profile)
            self._profile = None
        return following

    def _write(self, profile: cProfile.Profile) -> None:
        assert self.folder is not None
        newest = self.stalls[-1] if self.stalls else None
        if newest is None or newest.cpu < 0.8 * ALLOWED:
            return
        if newest.cpu <= self._worst.get(self.doing, 0.0):
            return
        self._worst[self.doing] = newest.cpu
        text = io.StringIO()
        text.write(f"{newest}\n")
        pstats.Stats(profile, stream=text).sort_stats("cumulative").print_stats(45)
        (self.folder / f"{self.doing}.txt").write_text(text.getvalue())


class Designer:
    """Does the acts, and prints what each took."""

    def __init__(self, window: Window, watch: Profiler, folder: Path) -> None:
        self.window, self.watch, self.folder = window, watch, folder
        self.session, self.view = window.session, window.viewport
        self.worst = 0.0

    def do(self, name: str, *events: Callable[[], object]) -> None:
        """Send events and wait until nothing is computed any more; print the longest call."""
        self.watch.doing = name
        first = len(self.watch.stalls)
        with self.watch.running():
            for event in events:
                pump(event)
            self.wait()
        mine = self.watch.stalls[first:]
        longer = [one for one in mine if one.cpu > ALLOWED]
        cpu = max((one.cpu for one in mine), default=0.0)
        wall = max((one.wall for one in mine), default=0.0)
        where = max(mine, key=lambda one: one.cpu).where if mine else "-"
        self.worst = max(self.worst, cpu)
        said = self.session.problems.sentence
        print(f"{name:24} {1e3 * cpu:6.0f} ms {1e3 * wall:7.0f} on the clock  {where}  {said}",
              flush=True)  # fmt: skip
        if len(longer) > 1:
            print("   also", *(f"{1e3 * one.cpu:.0f} ms {one.where}" for one in longer))

    def wait(self) -> None:
        """Let the window work until all is at rest, for a moment longer than one turn."""
        end = time.monotonic() + LONGEST
        quiet = 0
        while quiet < 60:
            assert time.monotonic() < end, f"{self.watch.doing} does not end"
            time.sleep(0.004)  # Qt's own wait would spin, and keep the other threads from working
            pump(None)
            quiet = quiet + 1 if self._at_rest() else 0

    def _at_rest(self) -> bool:
        session, view = self.session, self.view
        idle = not any(session.jobs.busy(one) for one in ("symmetry", "write"))
        still = not view.moving and not view.sight_comes and not session.writing.busy
        beside = self.window.compare
        return (
            settled(self.window)() and idle and still
            and (beside is None or not beside.viewport.moving)
        )  # fmt: skip

    def stroke(self, path: ArrayLike, modifiers: Qt.KeyboardModifier = PLAIN) -> list:
        """The events of a stroke with the mouse."""
        hand, points = Mouse(), list(np.asarray(path))
        kinds = ["press", *["move"] * (len(points) - 1), "release"]
        places = [*points, points[-1]]
        return [
            lambda k=kind, p=place: hand.send(self.view, k, p, modifiers)
            for kind, place in zip(kinds, places, strict=True)
        ]

    def key(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = PLAIN) -> Callable[[], object]:
        """A key of the viewport."""
        return lambda: QTest.keyClick(self.view, key, modifiers)

    def trigger(self, name: str) -> Callable[[], object]:
        """An action of the menus."""
        return lambda: self.window.actions_table.trigger(name)

    def play(self) -> None:
        """Everything, in an order that a designer might choose."""
        session, view, window = self.session, self.view, self.window
        ends = (-0.05, 0.0), (0.05, 0.0)
        middle = QPoint(view.width() // 2, view.height() // 2)
        button = Qt.MouseButton.MiddleButton
        self.do("turn",
                lambda: QTest.mousePress(view, button, PLAIN, middle),
                *(lambda k=k: QTest.mouseMove(view, middle + QPoint(6 * k, 0)) for k in range(8)),
                lambda: QTest.mouseRelease(view, button, PLAIN, middle))  # fmt: skip
        self.do("lasso", *self.stroke(circle(view, 0, 0, 0.085)))
        print(f"   {len(session.document.draft.roi)} vertices")
        self.do("grow", self.trigger("region.grow"))
        self.do("shrink", self.trigger("region.shrink"))
        self.do("level", *(lambda v=v: session.slide_level(v) for v in np.linspace(0, 0.4, 9)))
        self.do("source", *self.stroke(bow(view, *ends)))
        self.do("target", *self.stroke(bow(view, *ends, -0.3)))
        way = np.linspace(bow(view, *ends, -0.3)[15], middle_of(view), 12)
        self.do("target dragged", *self.stroke(way))
        self.do("apply", self.key(Qt.Key.Key_Return))
        assert len(session.document.recipe.steps) == 1, session.problems.sentence
        first = session.history.current_id
        self.do("undo", self.key(Qt.Key.Key_Z, CTRL))
        self.do("redo apply", self.key(Qt.Key.Key_Z, CTRL | SHIFT))
        self.do("name a variant", lambda: session.rename(first, "one"))
        for display in ("zebra", "curvature", "deviation"):
            self.do(display, lambda d=display: view.set_display(d))
        self.do("clay", lambda: view.set_display("clay"))
        self.do("wireframe", lambda: view.set_wireframe(True))
        self.do("no wireframe", lambda: view.set_wireframe(False))
        self.do("original shown", lambda: window.stage.show_original(True))
        self.do("original hidden", lambda: window.stage.show_original(False))
        self.do("to the start", lambda: session.go(0))
        self.do("another lasso", *self.stroke(circle(view, 0.12, 0.1, 0.085)))
        self.do("its source", *self.stroke(bow(view, (0.07, 0.1), (0.17, 0.1))))
        self.do("its target", *self.stroke(bow(view, (0.07, 0.1), (0.17, 0.1), -0.3)))
        self.do("its apply", self.key(Qt.Key.Key_Return))
        assert len(session.document.recipe.steps) == 1, session.problems.sentence
        second = session.history.current_id
        self.do("change of variant", lambda: session.go(first))
        self.do("and back", lambda: session.go(second))
        self.do("compare", lambda: window.compare_with(first))
        morph = window.compare.morph
        self.do("morph form", lambda: morph.form.setValue(40))
        self.do("morph detail", lambda: morph.detail.setValue(70))
        self.do("morph kept", lambda: morph.kept.emit())
        self.do("undo the morph", self.key(Qt.Key.Key_Z, CTRL))
        self.do("redo the morph", self.key(Qt.Key.Key_Z, CTRL | SHIFT))
        self.do("swap", lambda: window.compare.swap())
        self.do("compare in deviation", lambda: view.set_display("deviation"))
        self.do("compare in clay", lambda: view.set_display("clay"))
        self.do("close the comparison", lambda: window.end_compare())
        self.do("leave the region", *[self.key(Qt.Key.Key_Escape)] * 3)
        self.do("mirror", lambda: window.symmetry.choose("x"))
        self.do("mirrored lasso", *self.stroke(circle(view, 0.2, 0.0, 0.07)))
        self.do("mirrored source", *self.stroke(bow(view, (0.17, 0.0), (0.23, 0.0))))
        self.do("mirrored target", *self.stroke(bow(view, (0.17, 0.0), (0.23, 0.0), -0.3)))
        self.do("mirrored apply", self.key(Qt.Key.Key_Return))
        self.do("mirror found", lambda: window.symmetry.choose("found"))
        self.do("mirror off", lambda: window.symmetry.choose("off"))
        self.do("brush", lambda: window.toolhost.choose("brush"),
                *self.stroke(bow(view, (-0.2, 0.1), (0.2, 0.1), 0.2)))  # fmt: skip
        self.do("lasso added", lambda: window.toolhost.choose("lasso"),
                *self.stroke(circle(view, -0.2, -0.2, 0.1), SHIFT))  # fmt: skip
        self.do("save", lambda: window.documents.save_to(self.folder / "a.eigenform"))
        self.do("export", lambda: window.files.export(self.folder / "a.ply"))
        self.do("lasso of half the form", *self.stroke(circle(view, 0, 0, 0.36)))
        print(f"   {len(session.document.draft.roi)} vertices")
        self.do("undo the lasso", self.key(Qt.Key.Key_Z, CTRL))
        self.do("picture", lambda: view.render_image((400, 300)))
        self.do("open", lambda: window.files.open(self.folder / "a.ply"))
        self.do("open a document", lambda: window.files.open(self.folder / "a.eigenform"))


def middle_of(view: Viewport) -> tuple[float, float]:
    """The middle of the viewport, px."""
    return view.width() / 2, view.height() / 2


@contextmanager
def million(vertices: int, folder: Path) -> Iterator[Window]:
    """A window on a sphere of so many vertices, that keeps its journal in a folder."""
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(folder / "s"))
    window = Window(Appearance(application(), "dark"))
    window.keep_safe(folder / "state")
    window.resize(1100, 760)
    window.show()
    QTest.qWaitForWindowExposed(window)
    window.activateWindow()
    mesh = sphere(vertices, 50.0)
    prepare(mesh)
    window.session.start(Document.open(mesh, "million.ply"))
    try:
        yield window
    finally:
        window.safety.leave()
        window.close()
        pump(None)


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, and tell whether every call was short enough."""
    parser = argparse.ArgumentParser(prog="million", description=__doc__)
    parser.add_argument("--vertices", type=int, default=933_000)
    parser.add_argument("--profile", type=Path, metavar="DIR")
    given = parser.parse_args(arguments)
    drawing = [
        Viewport.paintGL, Viewport.initializeGL, Viewport.resizeGL, idimage.capture, idimage.read,
        picture.rendered, gradual.Gradual._rendered,
    ]  # fmt: skip
    watch = Profiler(pump.__code__, frozenset(f.__code__ for f in drawing), keep_above=0.004)
    watch.folder, watch._worst = given.profile, {}
    if given.profile is not None:
        given.profile.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name, million(given.vertices, Path(name)) as window:
        designer = Designer(window, watch, Path(name))
        designer.do("begin")
        designer.play()
    print(f"longest: {1e3 * designer.worst:.0f} ms")
    return 0 if designer.worst < ALLOWED else 1


if __name__ == "__main__":
    sys.exit(main())
