"""Studio: a real window driven with real events, whose stages are kept as pictures."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QWidget

from app.draw_examples import through_points
from app.window import Window
from engine import source_curve
from resources import sample_path
from tests.app.driving import NONE, Mouse, settled

MIDDLE = Qt.MouseButton.MiddleButton
NO_BUTTON = Qt.MouseButton.NoButton
QUEUED = Qt.ConnectionType.QueuedConnection
MODES = 240
MOST_POINTS = 32  # of a stroke: every one is drawn


class Stage:
    """One window and the folder its pictures go to.

    Parameters
    ----------
    window : a window that is shown.
    folder : where pictures are written.
    kept_as : makes a picture just written the one that is kept, for instance smaller.
    """

    def __init__(
        self, window: Window, folder: Path, kept_as: Callable[[Path], object] | None = None
    ) -> None:
        self.window = window
        self.folder = folder
        self.kept: list[str] = []
        self._kept_as = kept_as
        window.session.decomposition_changed.connect(self._enough, QUEUED)

    def _enough(self) -> None:
        """Stop at as many modes as pictures need, as the cross in the status bar does."""
        known = self.window.session.decomposition
        if known is not None and known.k >= MODES:
            self.window.session.cancel("decompose")

    # ---- hands

    def open(self, sample: str | Path, welcome: bool = False) -> None:
        """Open a sample by name or a file, and wait for it."""
        path = sample if isinstance(sample, Path) else sample_path(sample)
        if welcome:
            self.window.session.opened.connect(
                self.window.welcome.begin, Qt.ConnectionType.SingleShotConnection
            )
        before = self.window.session.document
        self.window.files.open(path)
        self.until(lambda: self.window.session.document is not before)
        self.rest()

    def key(self, action: str) -> None:
        """Trigger an action of the table by its id, as its menu would."""
        self.window.actions_table.trigger(action)
        QCoreApplication.processEvents()

    def press(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = NONE) -> None:
        """Press and let go a key over the form."""
        if QApplication.activePopupWidget() is None and not self.window.isActiveWindow():
            self.window.activateWindow()
            self.until(self.window.isActiveWindow, 10)
        QTest.keyClick(self.window.viewport, key, modifiers)
        QCoreApplication.processEvents()

    def type(self, widget: QWidget, text: str) -> None:
        """Type a text into a field in place of what it holds."""
        widget.setFocus()
        QTest.keyClick(widget, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClicks(widget, text)
        QCoreApplication.processEvents()

    def press_in(self, widget: QWidget, key: Qt.Key) -> None:
        """Press and let go a key in a field."""
        QTest.keyClick(widget, key)
        QCoreApplication.processEvents()

    def option(self, name: str) -> QWidget:
        """Return the control of an option of the tool in hand."""
        found = self.window.strip.findChildren(QWidget, f"option {name}")
        return next(one for one in found if one.isVisible())

    def menu(self, title: str, below: str = "") -> None:
        """Click a menu open, and the menu in it whose title begins with `below`."""
        bar = self.window.menuBar()
        action = next(a for a in bar.actions() if a.text().replace("&", "") == title)
        self.click(bar, bar.actionGeometry(action).center())
        self.wait(0.3)
        menu = action.menu()
        for one in menu.actions() if below else ():
            if one.menu() and below.lower() in one.text().lower():
                QTest.mouseMove(menu, menu.actionGeometry(one).center())
                self.click(menu, menu.actionGeometry(one).center())
        self.wait(0.4)

    def close_menus(self) -> None:
        """Close what was clicked open."""
        while (popup := QApplication.activePopupWidget()) is not None:
            popup.close()
        self.wait(0.1)

    def click(self, widget: QWidget, at: QPoint | None = None) -> None:
        """Click a widget with the left button."""
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton, NONE, at or widget.rect().center())
        QCoreApplication.processEvents()

    def stroke(
        self,
        path: ArrayLike,
        modifiers: Qt.KeyboardModifier = NONE,
        release: bool = True,
        hand: Mouse | None = None,
    ) -> None:
        """Draw in the viewport, with the mouse unless another hand is given."""
        points = np.asarray(path)
        few = np.unique(np.linspace(0, len(points) - 1, MOST_POINTS).round().astype(int))
        (hand or Mouse()).stroke(self.window, points[few], modifiers, release)

    def let_go(self, at: ArrayLike) -> None:
        """End a stroke that was not let go."""
        Mouse().send(self.window.viewport, "release", at, NONE)
        self.rest()

    def turn(self, dx: float, dy: float) -> None:
        """Turn the view by dragging with the middle button, distances in px."""
        view = self.window.viewport
        start = QPointF(view.width() / 2, view.height() / 2)
        for kind, share in (
            (QEvent.Type.MouseButtonPress, 0.0),
            (QEvent.Type.MouseMove, 0.5),
            (QEvent.Type.MouseMove, 1.0),
            (QEvent.Type.MouseButtonRelease, 1.0),
        ):
            place = start + share * QPointF(dx, dy)
            moving = kind == QEvent.Type.MouseMove
            held = NO_BUTTON if kind == QEvent.Type.MouseButtonRelease else MIDDLE
            event = QMouseEvent(
                kind,
                place,
                QPointF(view.mapToGlobal(place)),
                NO_BUTTON if moving else MIDDLE,
                held,
                NONE,
            )
            QCoreApplication.sendEvent(view, event)
            self.wait(0.05)
        self.wait(0.3)

    def seen(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return where points (p, 3) of space are seen, (p, 2) px."""
        return np.asarray(self.window.viewport.view().project(np.asarray(points, float)))

    def shares(
        self, points: Sequence[tuple[float, float]], closed: bool = False
    ) -> NDArray[np.float64]:
        """Return a smooth path through points given as shares of the canvas, px."""
        view = self.window.viewport
        return through_points(np.array(points) * (view.width(), view.height()), closed)

    def bulged(self, dx: float, dy: float) -> NDArray[np.float64]:
        """Return the waiting source as it is seen now, moved by (dx, dy) px in its middle."""
        session = self.window.session
        assert session.document is not None
        assert session.shown is not None
        source = session.document.draft.source
        assert source is not None
        path = self.seen(source_curve(session.shown.vertices[source.anchors], source.closed))
        swell = np.sin(np.linspace(0, np.pi, len(path)))[:, None] ** 2
        return np.asarray(path + swell * (dx, dy))

    # ---- waiting

    def rest(self) -> None:
        """Wait until the engine has answered and nothing moves; modes may still come."""
        check = settled(self.window)
        self.wait(0.1)
        self.until(lambda: check() and not self.window.viewport.moving)
        self.wait(0.3)

    def settle(self) -> None:
        """Wait until all modes are there as well."""
        self.rest()
        self.until(lambda: not self.window.session.jobs.busy("decompose"))
        self.rest()

    def modes(self, count: int) -> None:
        """Wait until so many modes are there."""
        session = self.window.session
        self.until(lambda: session.decomposition is not None and session.decomposition.k >= count)
        self.rest()

    def wait(self, seconds: float) -> None:
        """Let the window work for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            QApplication.processEvents()
            time.sleep(0.004)

    def until(self, done: Callable[[], object], seconds: float = 240.0) -> None:
        """Let the window work until `done()` holds.

        Raises
        ------
        TimeoutError
            It did not within the time.
        """
        end = time.monotonic() + seconds
        while not done():
            if time.monotonic() > end:
                raise TimeoutError(f"the window did not come to rest after “{self.kept[-1:]}”")
            self.wait(0.02)

    # ---- pictures

    def keep_canvas(self, name: str) -> None:
        """Write a picture of the form and the options of the tool above it."""
        self.keep(name, self.window.strip, self.window.body.split)

    def dialog(self, name: str) -> None:
        """Write a picture of the window with the dialog that is open, and close that."""

        def shown() -> list[QDialog]:
            widgets = QApplication.topLevelWidgets()
            return [w for w in widgets if isinstance(w, QDialog) and w.isVisible()]

        self.until(shown)
        self.wait(0.3)
        dialog = shown()[0]
        middle = self.window.viewport.mapToGlobal(self.window.viewport.rect().center())
        dialog.move(middle - dialog.rect().center())
        self.wait(0.3)
        self.keep(name)
        dialog.close()
        self.wait(0.2)

    def keep(self, name: str, *parts: QWidget) -> None:
        """Write a picture of the window, or of some of its parts, as it is on the screen."""
        self.wait(0.2)
        place = QRect()
        for part in parts or (self.window,):
            place = place.united(QRect(part.mapToGlobal(QPoint(0, 0)), part.size()))
        screen = self.window.windowHandle().screen()
        # From the whole screen, so that menus and dialogs over the window are seen as well.
        shot = screen.grabWindow(0, place.x(), place.y(), place.width(), place.height())
        path = self.folder / f"{name}.png"
        if not shot.save(str(path)):
            raise OSError(f"{path} could not be written")
        self.kept.append(name)
        if self._kept_as is not None:
            self._kept_as(path)
