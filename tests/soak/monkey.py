"""A monkey at the window: random tools, strokes, keys, files and sizes from a fixed seed.

`python -m tests.soak.monkey --events 10000 --seed 1` prints its figures and fails on any exception,
on a stall of our making, and when undo does not lead back to the first document.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QDialog,
    QFileDialog,
    QInputDialog,
    QMessageBox,
    QWidget,
)

from app.viewport import Viewport, idimage, picture
from app.window import Window
from engine import Document
from tests.app.driving import Mouse, Pen, settled
from tests.soak.stalls import Stopwatch

# Leaves the window, or the program.
NEVER = {"file.quit"}
KEYS = (
    Qt.Key.Key_Escape,
    Qt.Key.Key_Return,
    Qt.Key.Key_Tab,
    Qt.Key.Key_B,
    Qt.Key.Key_Space,
    Qt.Key.Key_Left,
    Qt.Key.Key_Up,
    Qt.Key.Key_Delete,
    Qt.Key.Key_BracketLeft,
    Qt.Key.Key_BracketRight,
    *(getattr(Qt.Key, f"Key_{letter}") for letter in "ABCDFLPSTNHWZ13579"),
)
MODIFIERS = (
    Qt.KeyboardModifier.NoModifier,
    Qt.KeyboardModifier.NoModifier,
    Qt.KeyboardModifier.NoModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.ControlModifier,
)
SIZES = ((1000, 720), (820, 600), (1280, 860), (700, 560))


@dataclass
class Walk:
    """What a walk did and found."""

    events: int = 0
    acts: Counter[str] = field(default_factory=Counter)
    problems: Counter[str] = field(default_factory=Counter)
    stalls: list[str] = field(default_factory=list)
    longest_stall: float = 0.0
    longest_wait: float = 0.0
    memory: list[float] = field(default_factory=list)
    seconds: float = 0.0
    back_at_the_start: bool = False

    def lines(self) -> list[str]:
        """The figures, in words."""
        common = ", ".join(f"{name} {count}" for name, count in self.acts.most_common())
        lines = [
            f"{self.events} events in {self.seconds:.0f} s ({common})",
            f"longest call of ours: {1000 * self.longest_stall:.0f} ms of processor time, "
            f"{1000 * self.longest_wait:.0f} ms on the clock (rendering not counted)",
            f"undo to the start gives the first document: {self.back_at_the_start}",
        ]
        lines += [f"slow: {stall}" for stall in self.stalls]
        if self.memory:
            lines.append(f"memory: {self.memory[0]:.0f} MB, then {self.memory[-1]:.0f} MB")
        lines += [f"said {count} times: {text}" for text, count in self.problems.most_common(12)]
        return lines


class Monkey:
    """Plays with a window.

    Parameters
    ----------
    window : a shown window with a document.
    seed : of everything random.
    folder : where files are saved, exported and opened again.
    files : meshes to open.
    """

    def __init__(self, window: Window, seed: int, folder: Path, files: list[Path]) -> None:
        self.window = window
        self.dice = random.Random(seed)
        self.folder = folder
        self.files = list(files)
        self.walk = Walk()
        self.hands = (Mouse(), Pen(), Pen(eraser=True))
        self.acts: list[tuple[int, Callable[[], None]]] = [
            (10, self.stroke),
            (4, self.likely_edit),
            (8, self.key),
            (6, self.action),
            (4, self.slide),
            (4, self.undo_or_redo),
            (2, self.travel),
            (3, self.orbit),
            (3, self.wheel),
            (1, self.resize),
            (1, self.open_file),
            (1, self.save),
            (2, self.cancel_work),
            (2, self.click_somewhere),
            (4, self.rest),
        ]
        window.session.problems.changed.connect(self._note_problem)

    def play(self, events: int, say: Callable[[str], object] = lambda _line: None) -> Walk:
        """Send so many events, then undo everything; return what was found.

        `say` is told from time to time how far the walk is.
        """
        drawing = [
            Viewport.paintGL,
            Viewport.initializeGL,
            Viewport.resizeGL,
            idimage.capture,
            picture.rendered,
        ]
        watch = self._watch = Stopwatch(pump.__code__, frozenset(f.__code__ for f in drawing))
        began = time.monotonic()
        closing = QTimer()
        closing.timeout.connect(close_what_waits)
        closing.start(150)
        weights = [weight for weight, _ in self.acts]
        told = 0
        with answered_dialogs(self), watch.running():
            while self.walk.events < events:
                act = self.dice.choices(self.acts, weights)[0][1]
                self.walk.acts[act.__name__] += 1
                watch.doing = act.__name__
                act()
                if self.walk.events >= told + 500:
                    told = self.walk.events
                    worst = max((one.cpu for one in watch.stalls), default=0.0)
                    say(f"{told} events, longest call {1000 * worst:.0f} ms, {memory_mb():.0f} MB")
                if not self.window.isVisible():
                    raise AssertionError(f"the window went after {act.__name__}")
        closing.stop()
        self._go_back()
        self.walk.seconds = time.monotonic() - began
        self.walk.longest_stall = max((one.cpu for one in watch.stalls), default=0.0)
        self.walk.longest_wait = max((one.wall for one in watch.stalls), default=0.0)
        self.walk.stalls = [
            f"{1000 * one.cpu:.0f} ms ({1000 * one.wall:.0f} ms on the clock) in {one.where}"
            for one in watch.worst()
        ]
        return self.walk

    # ---- acts

    def stroke(self) -> None:
        """Draw something with something, and perhaps think better of it."""
        hand, view = self.dice.choice(self.hands), self.window.viewport
        path = self._path(view)
        modifiers = self.dice.choice(MODIFIERS)
        self._send(lambda: hand.send(view, "press", path[0], modifiers))
        for number, point in enumerate(path[1:]):
            self._send(lambda p=point: hand.send(view, "move", p, modifiers))
            if number == 8 and self.dice.random() < 0.1:
                self._send(lambda: QTest.keyClick(view, Qt.Key.Key_Escape))
        self._send(lambda: hand.send(view, "release", path[-1], modifiers))

    def likely_edit(self) -> None:
        """Circle a part, draw a source and a target, and mostly apply: what a person would do."""
        view, hand = self.window.viewport, self.hands[self.dice.randrange(2)]
        height, dice = view.height(), self.dice
        middle = np.array([view.width() / 2, height / 2])
        t = np.linspace(0, 2 * np.pi, 24)
        ring = np.column_stack([np.cos(t), np.sin(t)]) * height * dice.uniform(0.1, 0.25)
        s = np.linspace(-0.1, 0.1, 16)
        line = np.column_stack([s, 0 * s]) * height
        bow = np.column_stack([s, dice.uniform(-0.1, 0.1) * np.cos(s * 15)]) * height
        for tool, path in (("lasso", ring), ("source", line), ("target", bow)):
            self._send(lambda name=tool: self.window.toolhost.choose(name))
            points = middle + path
            self._send(lambda p=points: hand.send(view, "press", p[0], MODIFIERS[0]))
            for point in points[1:]:
                self._send(lambda p=point: hand.send(view, "move", p, MODIFIERS[0]))
            self._send(lambda p=points: hand.send(view, "release", p[-1], MODIFIERS[0]))
            if dice.random() < 0.7:
                self.rest()
        if dice.random() < 0.7:
            self._send(lambda: QTest.keyClick(view, Qt.Key.Key_Return))
            self.rest()

    def key(self) -> None:
        """Press a key."""
        key, modifiers = self.dice.choice(KEYS), self.dice.choice(MODIFIERS)
        self._send(lambda: QTest.keyClick(self.window.viewport, key, modifiers))

    def action(self) -> None:
        """Do something out of the menus."""
        name = self.dice.choice(
            [one for one in self.window.actions_table.table if one not in NEVER]
        )
        self.walk.acts[name] += 1
        self._watch.doing = name
        self._send(lambda: self.window.actions_table.trigger(name))

    def slide(self) -> None:
        """Move the level."""
        slider = self.window.level.slider
        for _ in range(self.dice.randrange(1, 12)):
            value = self.dice.randint(slider.minimum(), slider.maximum())
            self._send(lambda v=value: slider.setValue(v))

    def undo_or_redo(self) -> None:
        """Go back and forth."""
        session = self.window.session
        for _ in range(self.dice.randrange(1, 6)):
            self._send(self.dice.choice([session.undo, session.undo, session.redo]))

    def travel(self) -> None:
        """Go to any moment."""
        session = self.window.session
        moment = self.dice.choice(list(session.history.moments))
        self._send(lambda: session.go(moment))

    def orbit(self) -> None:
        """Turn the view with the middle button."""
        view = self.window.viewport
        at = [self.dice.randrange(view.width()), self.dice.randrange(view.height())]
        self._button(view, QEvent.Type.MouseButtonPress, at)
        for _ in range(self.dice.randrange(2, 10)):
            at = [at[0] + self.dice.randint(-25, 25), at[1] + self.dice.randint(-25, 25)]
            self._button(view, QEvent.Type.MouseMove, at)
        self._button(view, QEvent.Type.MouseButtonRelease, at)

    def wheel(self) -> None:
        """Zoom, or slide the level with Alt."""
        view = self.window.viewport
        place = QPointF(self.dice.randrange(view.width()), self.dice.randrange(view.height()))
        event = QWheelEvent(
            place,
            QPointF(view.mapToGlobal(place)),
            QPoint(),
            QPoint(0, self.dice.choice([-120, -40, 40, 120])),
            Qt.MouseButton.NoButton,
            self.dice.choice([*MODIFIERS, Qt.KeyboardModifier.AltModifier]),
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        self._send(lambda: QCoreApplication.sendEvent(view, event))

    def resize(self) -> None:
        """Give the window another size."""
        size = self.dice.choice(SIZES)
        self._send(lambda: self.window.resize(*size))

    def open_file(self) -> None:
        """Open a mesh or a document; sometimes wait for it."""
        path = self.dice.choice(self.files)
        self._send(lambda: self.window.files.open(path))
        if self.dice.random() < 0.6:
            self._wait(10.0)

    def save(self) -> None:
        """Save the document, to be opened again later."""
        path = self.folder / f"{self.dice.randrange(4)}.eigenform"
        self._send(lambda: self.window.documents.save_to(path))
        self._wait(10.0)
        if path.exists() and path not in self.files:
            self.files.append(path)

    def cancel_work(self) -> None:
        """Cancel whatever the engine does."""
        jobs = self.window.session.jobs
        channel = self.dice.choice(["decompose", "prepare", "solve", "apply", "file"])
        self._send(lambda: jobs.cancel(channel))

    def click_somewhere(self) -> None:
        """Click on any visible button, box or list."""
        inside = [
            one
            for one in self.window.body.side.findChildren(QWidget)
            if one.isVisible() and one.isEnabled() and not one.findChildren(QWidget)
        ]
        if inside:
            widget = self.dice.choice(inside)
            self._send(lambda: QTest.mouseClick(widget, Qt.MouseButton.LeftButton))

    def rest(self) -> None:
        """Let the engine work for a while, or until it is done."""
        self._wait(self.dice.choice([0.05, 0.2, 2.0]))

    # ---- how

    def _path(self, view: QWidget) -> list[tuple[float, float]]:
        dice = self.dice
        n = dice.randrange(2, 30)
        x, y = dice.uniform(0, view.width()), dice.uniform(0, view.height())
        match dice.randrange(3):
            case 0:
                radius, start = dice.uniform(2, 200), dice.uniform(0, 6)
                t = np.linspace(start, start + dice.uniform(4, 7), n)
                points = np.column_stack([x + radius * np.cos(t), y + radius * np.sin(t)])
            case 1:
                end = np.array([dice.uniform(0, view.width()), dice.uniform(0, view.height())])
                points = np.linspace((x, y), end, n)
            case _:
                steps = np.array([[dice.gauss(0, 15), dice.gauss(0, 15)] for _ in range(n)])
                points = np.array([x, y]) + np.cumsum(steps, axis=0)
        return [tuple(map(float, point)) for point in points]

    def _button(self, view: QWidget, kind: QEvent.Type, at: list[int]) -> None:
        middle, none = Qt.MouseButton.MiddleButton, Qt.MouseButton.NoButton
        held = none if kind == QEvent.Type.MouseButtonRelease else middle
        button = none if kind == QEvent.Type.MouseMove else middle
        place = QPointF(*at)
        event = QMouseEvent(
            kind, place, QPointF(view.mapToGlobal(place)), button, held, MODIFIERS[0]
        )
        self._send(lambda: QCoreApplication.sendEvent(view, event))

    def _send(self, event: Callable[[], object]) -> None:
        self.walk.events += 1
        pump(event)

    def _wait(self, seconds: float) -> None:
        limit = time.monotonic() + seconds
        done = settled(self.window)
        pump(None)
        while time.monotonic() < limit and not (done() and not self._files_busy()):
            pump(None, 10)

    def _files_busy(self) -> bool:
        jobs = self.window.session.jobs
        return jobs.busy("file") or self.window.session.writing.busy

    def _note_problem(self) -> None:
        problem = self.window.session.problems.sentence
        if problem:
            self.walk.problems[problem] += 1
            if "in Eigenform itself" in problem or "failed and was stopped" in problem:
                raise AssertionError(problem)

    def _go_back(self) -> None:
        """Undo to the first document and compare it with what it was, bit for bit."""
        session = self.window.session
        self.window.toolhost.cancel()
        for channel in ("file", "apply", "solve", "decompose"):
            session.jobs.cancel(channel)
        self._wait(30)
        root = next(m for m in session.history.moments.values() if m.parent is None)
        while session.history.can_undo:
            session.undo()
        self._wait(30)
        session.jobs.cancel("solve")
        pump(None, 50)
        first: Document = root.document
        same = session.document is first
        if first.draft.roi is None:
            shown = self.window.viewport.vertices
            same = same and shown.tobytes() == first.mesh.vertices.tobytes()
        self.walk.back_at_the_start = same


def pump(event: Callable[[], object] | None, milliseconds: int = 0) -> None:
    """Send an event and process what follows; all calls into the program come from here."""
    if event is not None:
        event()
    if milliseconds:
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.WaitForMoreEvents, milliseconds)
    QCoreApplication.processEvents()


def close_what_waits() -> None:
    """Close menus and dialogs that the walk has opened, so that it goes on."""
    popup = QApplication.activePopupWidget()
    if popup is not None:
        popup.close()
    modal = QApplication.activeModalWidget()
    if isinstance(modal, QDialog):
        modal.reject()
    elif modal is not None:
        modal.close()


class answered_dialogs:
    """File dialogs answer at once: with a file of the monkey's, or with none."""

    def __init__(self, monkey: Monkey) -> None:
        self._monkey = monkey
        self._kept: list[tuple[type, str, object]] = []

    def __enter__(self) -> None:
        monkey = self._monkey

        def chosen(*_given: object, **_named: object) -> tuple[str, str]:
            path = monkey.dice.choice([*monkey.files, None])
            return ("" if path is None else str(path)), ""

        def saved(*given: object, **_named: object) -> tuple[str, str]:
            kinds = " ".join(str(one) for one in given[3:])
            ending = next((e for e in (".eigenform", ".ply", ".json", ".png") if e in kinds), "")
            name = monkey.folder / f"saved {monkey.dice.randrange(3)}{ending or '.ply'}"
            return ("" if monkey.dice.random() < 0.3 else str(name)), "PLY (*.ply)"

        self._replace(QFileDialog, "getOpenFileName", chosen)
        self._replace(QFileDialog, "getSaveFileName", saved)
        self._replace(QInputDialog, "getText", lambda *_a, **_k: ("name", True))
        self._replace(QMessageBox, "exec", lambda *_a, **_k: 0)

    def _replace(self, owner: type, name: str, by: object) -> None:
        self._kept.append((owner, name, getattr(owner, name)))
        setattr(owner, name, by)

    def __exit__(self, *_: object) -> None:
        for owner, name, was in self._kept:
            setattr(owner, name, was)


def memory_mb() -> float:
    """Resident memory of this process after everything that can go has gone."""
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.collect()
    with suppress(OSError, AttributeError):  # what was freed and not given back is no leak
        ctypes.CDLL(None).malloc_trim(0)
    return psutil.Process().memory_info().rss / 2**20


def main(arguments: list[str] | None = None) -> int:
    """Walk in a window of its own and print the figures."""
    parser = argparse.ArgumentParser(prog="monkey", description=__doc__)
    parser.add_argument("--events", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)

    from PySide6.QtCore import QSettings

    from app.look import Appearance
    from app.start import application
    from engine import save
    from tests.app.driving import bumpy_sphere

    raised: list[str] = []

    def note(kind: type[BaseException], error: BaseException, trace: object) -> None:
        raised.append(repr(error))
        sys.__excepthook__(kind, error, trace)  # type: ignore[arg-type]

    sys.excepthook = note
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        QSettings.setDefaultFormat(QSettings.Format.IniFormat)
        QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(folder / "s"))
        app = application()
        window = Window(Appearance(app, "dark"))
        window.keep_safe(folder / "state")
        sys.excepthook = note
        window.show()
        QTest.qWaitForWindowExposed(window)
        files = [folder / "sphere.ply", folder / "small.obj"]
        save(bumpy_sphere(), files[0])
        save(bumpy_sphere(900), files[1])
        window.session.start(Document.open(bumpy_sphere(), "sphere.ply"))
        monkey = Monkey(window, given.seed, folder, files)
        monkey._wait(10)
        monkey.walk.memory.append(memory_mb())
        walk = monkey.play(given.events, lambda line: print(line, len(raised), flush=True))
        walk.memory.append(memory_mb())
        window.safety.leave()
        window.close()
        pump(None)
    print("\n".join(walk.lines()))
    print(f"{len(raised)} exceptions")
    good = not raised and walk.back_at_the_start and walk.longest_stall < 0.05
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
