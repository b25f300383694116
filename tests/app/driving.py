"""Real events for the window: mouse and pen strokes, keys, waiting."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QImage, QInputDevice, QMouseEvent, QPointingDevice, QTabletEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QDialog,
    QLabel,
    QMenu,
    QMenuBar,
    QWidget,
)

from app.window import Window
from engine import Mesh
from tests.program import PATIENCE

NONE = Qt.KeyboardModifier.NoModifier
LEFT = Qt.MouseButton.LeftButton
NO_BUTTON = Qt.MouseButton.NoButton
POINTS_A_FRAME = 4
Places = tuple[QPointF, QPointF]
Buttons = tuple[Qt.MouseButton, Qt.MouseButton]


def bumpy_sphere(n: int = 3000, bumps: float = 0.04) -> Mesh:
    """A sphere of 50 mm with bumps, from points spread evenly and their convex hull."""
    from scipy.spatial import ConvexHull

    i = np.arange(n) + 0.5
    z = 1 - 2 * i / n
    angle = np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z * z)
    x = np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    faces = ConvexHull(x).simplices
    a, b, c = (x[faces[:, k]] for k in range(3))
    outside = (np.cross(b - a, c - a) * a).sum(axis=1) > 0
    faces = np.where(outside[:, None], faces, faces[:, ::-1])
    height = 1 + bumps * np.sin(9 * x[:, 0]) * np.sin(9 * x[:, 1]) * np.sin(9 * x[:, 2])
    return Mesh(50 * x * height[:, None], faces.astype(np.int64))


def circle(view: QWidget, x: float, y: float, radius: float, n: int = 48) -> NDArray[np.float64]:
    """A closed path around a point; x, y and radius as shares of the viewport's height."""
    t = np.linspace(0, 2 * np.pi, n)
    centre = np.array([view.width() / 2, view.height() / 2])
    shares = np.column_stack([x + radius * np.cos(t), y + radius * np.sin(t)])
    return centre + view.height() * shares


def bow(
    view: QWidget, left: ArrayLike, right: ArrayLike, sag: float = 0.0, n: int = 30
) -> NDArray[np.float64]:
    """A bowed line between two points given as shares of the height from the viewport's middle."""
    t = np.linspace(0, 1, n)[:, None]
    a, b = np.asarray(left, float), np.asarray(right, float)
    across = np.array([-(b - a)[1], (b - a)[0]])
    centre = np.array([view.width() / 2, view.height() / 2])
    return centre + view.height() * (a + t * (b - a) + sag * 4 * t * (1 - t) * across)


class Mouse:
    """The left mouse button."""

    name = "mouse"
    kinds: ClassVar[dict[str, QEvent.Type]] = {
        "press": QEvent.Type.MouseButtonPress,
        "move": QEvent.Type.MouseMove,
        "release": QEvent.Type.MouseButtonRelease,
    }

    def send(self, view: QWidget, kind: str, at: ArrayLike, modifiers: Qt.KeyboardModifier) -> None:
        """Send one event at a position in logical pixels."""
        place = QPointF(*map(float, np.asarray(at)))
        places = place, QPointF(view.mapToGlobal(place))
        pressed = NO_BUTTON if kind == "move" else LEFT
        held = NO_BUTTON if kind == "release" else LEFT
        event = self.event(self.kinds[kind], places, (pressed, held), modifiers)
        QCoreApplication.sendEvent(view, event)

    def event(
        self, kind: QEvent.Type, places: Places, buttons: Buttons, modifiers: Qt.KeyboardModifier
    ) -> QEvent:
        """Make one event: where in the widget and on the screen, which button, which are held."""
        return QMouseEvent(kind, *places, *buttons, modifiers)

    def stroke(
        self,
        window: Window,
        path: Iterable[ArrayLike],
        modifiers: Qt.KeyboardModifier = NONE,
        release: bool = True,
    ) -> None:
        """Draw a whole stroke; as with a fast hand, several points come to a frame."""
        points = list(path)
        view = window.viewport
        self.send(view, "press", points[0], modifiers)
        for number, point in enumerate(points[1:], 1):
            self.send(view, "move", point, modifiers)
            if number % POINTS_A_FRAME == 0 or number == len(points) - 1:
                QCoreApplication.processEvents()
        if release:
            self.send(view, "release", points[-1], modifiers)
            QCoreApplication.processEvents()


class Pen(Mouse):
    """The tip, or the eraser end, of a tablet's pen, at the pressure of now."""

    name = "pen"
    kinds: ClassVar[dict[str, QEvent.Type]] = {
        "press": QEvent.Type.TabletPress,
        "move": QEvent.Type.TabletMove,
        "release": QEvent.Type.TabletRelease,
    }

    def __init__(self, eraser: bool = False, pressure: float = 0.5) -> None:
        self.pressure = pressure
        kind = QPointingDevice.PointerType
        self.device = QPointingDevice(
            "test pen",
            1,
            QInputDevice.DeviceType.Stylus,
            kind.Eraser if eraser else kind.Pen,
            QInputDevice.Capability.Position | QInputDevice.Capability.Pressure,
            1,
            2,
        )

    def event(
        self, kind: QEvent.Type, places: Places, buttons: Buttons, modifiers: Qt.KeyboardModifier
    ) -> QEvent:
        """Make one event as a tablet's driver has Qt make it."""
        force, upright = self.pressure, (0.0, 0.0, 0.0, 0.0, 0.0)
        return QTabletEvent(kind, self.device, *places, force, *upright, modifiers, *buttons)


def soon(done: Callable[[], bool]) -> bool:
    """Let the window work until `done()` holds; return whether it ever does."""
    end = time.monotonic() + PATIENCE
    while not done() and time.monotonic() < end:
        QTest.qWait(5)
    return done()


def awake(window: QWidget) -> None:
    """Give the keys back to a window when a menu or a dialog had them."""
    QCoreApplication.processEvents()
    if not window.isActiveWindow():
        window.activateWindow()
        assert soon(window.isActiveWindow), "the window does not get the keys"
        QCoreApplication.processEvents()


def through_menus(window: Window, *titles: str) -> None:
    """Click through the menus: "View", "Standard views", "From the back"."""
    awake(window)
    bar = window.menuBar()
    shown: QMenuBar | QMenu = bar
    for depth, title in enumerate(titles):
        rows = shown.actions()
        action = next(one for one in rows if one.text().replace("&", "").rstrip("…") == title)
        assert action.isEnabled(), f"{title} cannot be done"
        place = shown.actionGeometry(action).center()
        # As a hand does: a click where the pointer was when the menu came only closes it again.
        for at in (place - QPoint(3, 0), place):
            QTest.mouseMove(shown, at)
            QTest.qWait(10)
        QTest.mouseClick(shown, LEFT, NONE, place)
        if depth + 1 < len(titles):
            shown = action.menu()
            assert shown is not None, f"{title} is no menu"
            assert soon(shown.isVisible), f"the menu {title} does not open"
    assert soon(lambda: not isinstance(QApplication.activePopupWidget(), QMenu))


def press(widget: QWidget, key: Qt.Key, modifiers: Qt.KeyboardModifier = NONE) -> None:
    """Press and let go a key in a window that has the keys."""
    awake(widget.window())
    QTest.keyClick(widget, key, modifiers)
    QCoreApplication.processEvents()


@contextmanager
def in_dialog(kind: type[QDialog], act: Callable[[Any], object]) -> Iterator[None]:
    """Act in a dialog as soon as it is there, while whoever opened it waits for its end."""
    failures: list[Exception] = []

    def look() -> None:
        widgets = QApplication.topLevelWidgets()
        dialog = next((w for w in widgets if isinstance(w, kind) and w.isVisible()), None)
        if dialog is None:
            return
        clock.stop()
        try:
            act(dialog)
        except Exception as error:  # noqa: BLE001 (it belongs to the test, not to the timer)
            failures.append(error)
            dialog.reject()

    clock = QTimer()
    clock.setInterval(20)
    clock.timeout.connect(look)
    clock.start()
    yield
    waiting = clock.isActive()
    clock.stop()
    if failures:
        raise failures[0]
    assert not waiting, f"no {kind.__name__} was opened"


def pixels(widget: QWidget) -> NDArray[np.int64]:
    """What is seen of a widget and what lies over it, (h, w, 3) in device pixels, 0 to 255."""
    widget.repaint()
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    wide = rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)
    return wide.astype(np.int64)


def cut(window: Window) -> list[str]:
    """What has less room than its words need."""
    found: list[str] = []
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or not isinstance(widget, (QLabel, QAbstractButton)):
            continue
        text = widget.text() if not isinstance(widget, QLabel) or not widget.wordWrap() else ""
        wide = widget.fontMetrics().horizontalAdvance(text.replace("&", ""))
        if text and not text.startswith("<") and wide > widget.width() + 1:
            found.append(f"{text!r} has {widget.width()} of {wide} px")
        if widget.height() < widget.fontMetrics().height() and text:
            found.append(f"{text!r} is {widget.height()} px high")
    return found


def settled(window: Window) -> Callable[[], bool]:
    """Whether the engine rests, apart from modes, nothing moves by itself, and all of it is shown.

    The window looks at what has changed in an event of its own, which a timer of 0 ms brings.
    """

    def due(timer: QTimer) -> bool:
        return timer.isActive() and timer.isSingleShot() and timer.interval() == 0

    def check() -> bool:
        jobs = window.session.jobs
        busy = any(jobs.busy(one) for one in ("file", "apply", "solve"))
        document = window.session.document
        waits = (
            document is not None
            and document.draft.roi is not None
            and window.session.decomposition is None
        )
        if busy or waits or window.stage.flowing:
            return False
        return not any(due(timer) for timer in window.findChildren(QTimer))

    return check


def picture(window: Window, folder: Path, name: str) -> None:
    """Keep a picture of the whole window as an artefact."""
    window.viewport.repaint()
    window.grab().save(str(folder / f"{name}.png"))
