"""A viewport in a really rendered window, and hands to move over it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QCoreApplication, QElapsedTimer, QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QInputDevice, QMouseEvent, QPointingDevice, QTabletEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMainWindow

from app.viewport import Viewport
from engine import Mesh
from tests.program import PATIENCE

LEFT, MIDDLE, RIGHT = (
    Qt.MouseButton.LeftButton,
    Qt.MouseButton.MiddleButton,
    Qt.MouseButton.RightButton,
)
NONE = Qt.MouseButton.NoButton
PLAIN = Qt.KeyboardModifier.NoModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier
CTRL = Qt.KeyboardModifier.ControlModifier
ALT = Qt.KeyboardModifier.AltModifier


def torus(n: int, bump: float = 0.1, size: float = 40.0, offset: float = 0.0) -> Mesh:
    """A closed torus of about `n` vertices with waves on it, turned outwards."""
    nu = int(np.sqrt(2 * n))
    nv = n // nu
    u, v = np.meshgrid(
        2 * np.pi * np.arange(nu) / nu, 2 * np.pi * np.arange(nv) / nv, indexing="ij"
    )
    r = 0.42 * (1 + bump * np.sin(9 * u) * np.sin(7 * v))
    x = np.stack(
        [(1 + r * np.cos(v)) * np.cos(u), (1 + r * np.cos(v)) * np.sin(u), r * np.sin(v)], axis=-1
    )
    return Mesh(size * x.reshape(-1, 3) + offset, _grid(nu, nv))


def sphere(n: int, radius: float = 10.0) -> Mesh:
    """A sphere of about `n` vertices whose poles are small fans."""
    nv = int(np.sqrt(n / 2))
    nu = 2 * nv
    u, v = np.meshgrid(
        2 * np.pi * np.arange(nu) / nu, np.pi * (np.arange(nv) + 0.5) / nv, indexing="ij"
    )
    x = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(nu), np.arange(nv - 1), indexing="ij")
    a, b = (i * nv + j).ravel(), (((i + 1) % nu) * nv + j).ravel()
    faces = np.concatenate([np.stack([a, a + 1, b + 1], 1), np.stack([a, b + 1, b], 1)])
    ring = np.arange(nu) * nv
    following = np.roll(ring, -1)
    top, bottom = len(x), len(x) + 1
    caps = [
        np.stack([np.full(nu, top), ring, following], 1),
        np.stack([np.full(nu, bottom), following + nv - 1, ring + nv - 1], 1),
    ]
    return Mesh(
        radius * np.concatenate([x, [[0, 0, 1], [0, 0, -1]]]), np.concatenate([faces, *caps])
    )


def _grid(nu: int, nv: int) -> np.ndarray:
    i, j = np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij")
    a, b = (i * nv + j).ravel(), (((i + 1) % nu) * nv + j).ravel()
    c, d = (((i + 1) % nu) * nv + (j + 1) % nv).ravel(), (i * nv + (j + 1) % nv).ravel()
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


class Stage:
    """One window with a viewport, exposed and rendered."""

    def __init__(self, mesh: Mesh | None, size: tuple[int, int] = (500, 400)) -> None:
        self.window = QMainWindow()
        self.viewport = Viewport(self.window)
        self.window.setCentralWidget(self.viewport)
        self.window.resize(*size)
        self.window.show()
        assert QTest.qWaitForWindowExposed(self.window, round(1000 * PATIENCE))
        self.wait(lambda: bool(self.viewport.render_window.GetReadyForRendering()))
        if mesh is not None:
            self.viewport.set_mesh(mesh)
        self.settle()
        self.events: list = []
        self.viewport.pointer.connect(self.events.append)

    def reset(self, mesh: Mesh) -> None:
        """Make everything as it was at first."""
        viewport = self.viewport
        viewport.set_display("clay")
        viewport.set_wireframe(False)
        viewport.set_perspective(True)
        viewport.set_up_axis("z")
        viewport.set_mesh(mesh)
        viewport.overlay.set_invitation(None)
        viewport.set_backdrop(None)
        viewport.clear_ink()
        self.settle()
        self.events.clear()

    def wait(self, met: Callable[[], bool]) -> None:
        """Let Qt work until `met` is."""
        clock = QElapsedTimer()
        clock.start()
        while not met():
            assert clock.elapsed() < 1000 * PATIENCE, "what was waited for did not come"
            QTest.qWait(5)

    def settle(self) -> None:
        """Wait for the frame at rest."""
        self.wait(lambda: not self.viewport.moving)
        before = self.viewport.renders
        self.viewport.update()
        self.wait(lambda: self.viewport.renders > before)

    def close(self) -> None:
        self.viewport.close()
        self.window.close()
        self.window.deleteLater()
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)

    @property
    def kinds(self) -> list[str]:
        return [e.kind for e in self.events]

    @property
    def middle(self) -> np.ndarray:
        return np.array([self.viewport.width() / 2, self.viewport.height() / 2])

    def ellipse(self, share: float = 0.25, at: tuple[float, float] = (0.0, 0.2)) -> np.ndarray:
        """A lasso (60, 2) about the picture's middle, moved by a share of its half size."""
        t = np.linspace(0, 2 * np.pi, 60)
        half = self.middle
        return np.stack(
            [half[0] * (1 + at[0] + share * np.cos(t)), half[1] * (1 + at[1] + share * np.sin(t))],
            1,
        )

    # Hands

    def mouse(self, kind, at, button=NONE, buttons=NONE, modifiers=PLAIN) -> None:
        place = QPointF(float(at[0]), float(at[1]))
        far = self.viewport.mapToGlobal(place)
        event = QMouseEvent(kind, place, far, button, buttons, modifiers)
        QCoreApplication.sendEvent(self.viewport, event)

    def mouse_drag(self, path, button=LEFT, modifiers=PLAIN) -> None:
        self.mouse(QEvent.Type.MouseButtonPress, path[0], button, button, modifiers)
        for at in path[1:]:
            self.mouse(QEvent.Type.MouseMove, at, NONE, button, modifiers)
        self.mouse(QEvent.Type.MouseButtonRelease, path[-1], button, NONE, modifiers)

    def pen(self, kind, at, button=NONE, buttons=NONE, modifiers=PLAIN, device=None, pressure=0.5):
        place = QPointF(float(at[0]), float(at[1]))
        far = self.viewport.mapToGlobal(place)
        event = QTabletEvent(
            kind,
            device or pen_device(),
            place,
            far,
            pressure,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            modifiers,
            button,
            buttons,
        )
        QCoreApplication.sendEvent(self.viewport, event)

    def pen_drag(self, path, button=LEFT, modifiers=PLAIN, device=None) -> None:
        device = device or pen_device()
        self.pen(QEvent.Type.TabletPress, path[0], button, button, modifiers, device)
        for at in path[1:]:
            self.pen(QEvent.Type.TabletMove, at, NONE, button, modifiers, device)
        self.pen(QEvent.Type.TabletRelease, path[-1], button, NONE, modifiers, device)

    def wheel(self, at, notches: float, modifiers=PLAIN, pixels=(0, 0), device=None) -> None:
        place = QPointF(float(at[0]), float(at[1]))
        event = QWheelEvent(
            place,
            self.viewport.mapToGlobal(place),
            QPoint(*pixels),
            QPoint(0, round(120 * notches)),
            NONE,
            modifiers,
            Qt.ScrollPhase.NoScrollPhase,
            False,
            device=device or QPointingDevice.primaryPointingDevice(),
        )
        QCoreApplication.sendEvent(self.viewport, event)


_devices: dict[str, QPointingDevice] = {}


def _device(name: str, kind, pointer) -> QPointingDevice:
    # Qt keeps a pointer to the device of the last event: it must live as long as the process.
    if name not in _devices:
        able = QInputDevice.Capability
        _devices[name] = QPointingDevice(
            name, 7 + len(_devices), kind, pointer, able.Position | able.Pressure, 1, 3
        )
    return _devices[name]


def pen_device() -> QPointingDevice:
    return _device("pen", QInputDevice.DeviceType.Stylus, QPointingDevice.PointerType.Pen)


def eraser_device() -> QPointingDevice:
    return _device("eraser", QInputDevice.DeviceType.Stylus, QPointingDevice.PointerType.Eraser)


def touchpad() -> QPointingDevice:
    return _device("pad", QInputDevice.DeviceType.TouchPad, QPointingDevice.PointerType.Finger)


def check_projection(stage: Stage) -> None:
    """VTK's own projection, its picture, picks and the view agree, in both projections."""
    viewport = stage.viewport
    ratio = viewport.devicePixelRatioF()
    for perspective in (True, False):
        viewport.set_perspective(perspective)
        viewport.turn_by(0.31, 0.17)
        stage.settle()
        view = viewport.view()
        points = viewport.vertices[::37]
        scene = viewport.scene.placement.to_scene(points)
        renderer = viewport.renderer
        vtk_px = []
        for p in scene:
            renderer.SetWorldPoint(*p, 1.0)
            renderer.WorldToDisplay()
            vtk_px.append(renderer.GetDisplayPoint()[:2])
        height = viewport.render_window.GetSize()[1]
        expected = np.array([(x / ratio, (height - y) / ratio) for x, y in vtk_px])
        assert np.abs(view.project(points) - expected).max() < 1e-6
        sight = viewport.sight()
        rows, columns = np.nonzero(sight.ids >= 0)
        for k in range(0, len(rows), len(rows) // 50):
            face = sight.ids[rows[k], columns[k]]
            triangle = view.project(viewport.vertices[viewport.form.faces[face]]) * ratio
            assert _distance_outside(triangle, (columns[k] + 0.5, rows[k] + 0.5)) < 0.05


def _distance_outside(triangle: np.ndarray, point: tuple[float, float]) -> float:
    """How far `point` lies outside a triangle (3, 2), in its units; 0 inside."""
    a, b, c = triangle
    turn = np.sign((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
    worst = 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        along = q - p
        side = turn * (along[0] * (point[1] - p[1]) - along[1] * (point[0] - p[0]))
        worst = max(worst, -side / max(np.linalg.norm(along), 1e-12))
    return worst
