"""Moving the camera: by hand, in flights that a hand interrupts, and on a turntable."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QElapsedTimer, QObject, Qt, QTimer, Signal
from vtkmodules.vtkCommonCore import vtkFloatArray

from app.viewport.camera import STANDARD_VIEWS, Eye
from app.viewport.hands import ORBIT_PER_PIXEL, ZOOM_PER_PIXEL, Motion
from engine.arrays import F64

if TYPE_CHECKING:
    from app.viewport.canvas import Canvas

FLIGHT_MS = 220
TURNTABLE_PER_SECOND = math.radians(36.0)


class Navigation(QObject):
    """Where one looks from, and how that changes.

    Signals
    -------
    moved : `eye` is another one.
    """

    moved = Signal()

    def __init__(self, viewport: Canvas) -> None:
        super().__init__(viewport)
        self._viewport = viewport
        self._pivot: F64 = np.zeros(3)
        self._flight: tuple[Eye, Eye] | None = None
        self._clock = QElapsedTimer()
        self._frames = self._timer(self._fly)
        self._turns = self._timer(self._turn_a_little)
        azimuth, elevation = _direction("three-quarter")
        self.eye = Eye(np.zeros(3), 200.0, azimuth, elevation)

    def _timer(self, slot: Any) -> QTimer:
        timer = QTimer(self)
        timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.setInterval(15)
        timer.timeout.connect(slot)
        return timer

    @property
    def flying(self) -> bool:
        """Whether the camera moves by itself."""
        return self._flight is not None or self.turning

    @property
    def turning(self) -> bool:
        """Whether the form is on the turntable."""
        return self._turns.isActive()

    # By itself

    def look(self, eye: Eye, animate: bool = True) -> None:
        """Look from `eye`, flying there."""
        self.stop()
        if not animate or not self._viewport.isVisible():
            self._set(eye)
            return
        self._flight = (self.eye, eye)
        self._clock.start()
        self._frames.start()

    def stop(self) -> None:
        """End a flight or the turntable where they are."""
        self._flight = None
        self._frames.stop()
        self._turns.stop()

    def standard_view(self, name: str, animate: bool = True) -> None:
        """Look from one of `STANDARD_VIEWS`, keeping the middle of the picture."""
        azimuth, elevation = _direction(name)
        self.look(replace(self._goal, azimuth=azimuth, elevation=elevation), animate)

    def frame(self, points: NDArray[Any], animate: bool = True) -> None:
        """Bring `points` (p, 3), scene units, into the picture."""
        width, height = self._viewport.device_size()
        self.look(self._goal.framing(points, width / height), animate)

    def turn(self, wanted: bool) -> None:
        """Turn the form slowly about its up axis until somebody takes hold of it."""
        self.stop()
        if wanted:
            self._clock.start()
            self._turns.start()

    @property
    def _goal(self) -> Eye:
        return self._flight[1] if self._flight is not None else self.eye

    def _fly(self) -> None:
        if self._flight is None:
            self._frames.stop()
            return
        start, goal = self._flight
        share = min(1.0, self._clock.elapsed() / FLIGHT_MS)
        if share >= 1.0:
            self.stop()
            self._set(goal)
        else:
            self._set(start.towards(goal, 1.0 - (1.0 - share) ** 3))

    def _turn_a_little(self) -> None:
        seconds = min(0.25, self._clock.restart() / 1e3)
        self._set(self.eye.orbited(np.zeros(3), TURNTABLE_PER_SECOND * seconds, 0.0))

    def _set(self, eye: Eye) -> None:
        if not eye.same_as(self.eye):
            self.eye = eye
            self.moved.emit()

    # By hand

    def begin_motion(self, motion: Motion, x: float, y: float) -> None:
        """Take hold of the point of the form under a pixel."""
        self.stop()
        self._pivot = self._under(x, y, turning=motion is Motion.ORBIT)

    def continue_motion(self, motion: Motion, dx: float, dy: float) -> None:
        """Move the camera by a distance in pixels."""
        if motion is Motion.ORBIT:
            angles = -ORBIT_PER_PIXEL * dx, ORBIT_PER_PIXEL * dy
            self._set(self.eye.orbited(self._pivot, *angles))
        elif motion is Motion.PAN:
            height = self._viewport.view_height()
            unit = float(self.eye.unit_per_pixel(self._pivot[None], height)[0])
            self._set(self.eye.panned(unit * dx, -unit * dy))
        else:
            self._set(self.eye.zoomed(self._pivot, math.exp(-ZOOM_PER_PIXEL * dy)))

    def zoom_at(self, x: float, y: float, factor: float) -> None:
        """Zoom so that what is under a pixel stays there."""
        self.stop()
        self._set(self.eye.zoomed(self._under(x, y), factor))

    def turn_by(self, azimuth: float, elevation: float) -> None:
        """Turn about the middle of the picture, by angles in radians."""
        self.stop()
        self._set(self.eye.orbited(self.eye.centre, azimuth, elevation))

    def _under(self, x: float, y: float, turning: bool = False) -> F64:
        """Return the scene point under a pixel.

        Over the background it is the point as deep as the centre; for `turning` rather the middle
        of the form, if that is in the picture, so that turning never throws it out of sight.
        """
        to_clip = self._to_clip()
        depth = self._depth_at(x, y)
        if depth is not None:
            return self._unprojected(x, y, depth, to_clip)
        if not turning:
            centre = to_clip @ (*self.eye.centre, 1.0)
            return self._unprojected(x, y, (centre[2] / centre[3] + 1) / 2, to_clip)
        middle = to_clip @ (0.0, 0.0, 0.0, 1.0)
        inside = middle[3] > 0 and bool((np.abs(middle[:2]) < middle[3]).all())
        return np.zeros(3) if inside else self.eye.centre

    def _to_clip(self) -> F64:
        width, height = self._viewport.device_size()
        camera = self._viewport.renderer.GetActiveCamera()
        m = camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
        return np.array([[m.GetElement(i, j) for j in range(4)] for i in range(4)])

    def _depth_at(self, x: float, y: float) -> float | None:
        """Return the depth buffer's value 0..1 at a logical pixel, None over the background.

        Reading one value costs nothing, where the image of triangles costs a render.
        """
        window = self._viewport.render_window
        if not window.GetReadyForRendering():
            return None
        width, height = self._viewport.device_size()
        ratio = self._viewport.devicePixelRatioF()
        i, j = math.floor(x * ratio), height - 1 - math.floor(y * ratio)
        if not (0 <= i < width and 0 <= j < height):
            return None
        window.MakeCurrent()
        values = vtkFloatArray()
        window.GetZbufferData(i, j, i, j, values)
        depth = values.GetValue(0) if values.GetNumberOfValues() else 1.0
        return depth if 0.0 < depth < 1.0 else None

    def _unprojected(self, x: float, y: float, depth: float, to_clip: F64) -> F64:
        width, height = self._viewport.device_size()
        ratio = self._viewport.devicePixelRatioF()
        clip = (2 * x * ratio / width - 1, 1 - 2 * y * ratio / height, 2 * depth - 1, 1.0)
        h = np.linalg.solve(to_clip, clip)
        return np.asarray(h[:3] / h[3])


def _direction(name: str) -> tuple[float, float]:
    azimuth, elevation = STANDARD_VIEWS[name]
    return math.radians(azimuth), math.radians(elevation)
