"""Mouse, pen, touchpad and keys: left button and pen tip draw, all else moves the camera."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any, ClassVar, Protocol

from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QGuiApplication, QInputDevice, QPointingDevice

from plugins.api import Pointer

_Key = Qt.Key
_Mod = Qt.KeyboardModifier
_Button = Qt.MouseButton
_Type = QEvent.Type

ORBIT_PER_PIXEL = 0.0087  # radians: half a turn over 360 px
ZOOM_PER_PIXEL = 0.006
ZOOM_PER_NOTCH = 1.15
TAP_PX = 16  # a pen trembles more than a mouse
ARROW_STEP = 0.131  # radians: 7.5 degrees


class Motion(Enum):
    """How the hand moves the camera."""

    ORBIT = "orbit"
    PAN = "pan"
    ZOOM = "zoom"


class Steered(Protocol):
    """What moves the camera."""

    def begin_motion(self, motion: Motion, x: float, y: float) -> None:
        """Take hold of what lies under a pixel."""

    def continue_motion(self, motion: Motion, dx: float, dy: float) -> None:
        """Move the camera by a distance in pixels."""

    def zoom_at(self, x: float, y: float, factor: float) -> None:
        """Zoom to a pixel."""

    def turn_by(self, azimuth: float, elevation: float) -> None:
        """Turn about the middle of the picture."""


class Hands(QObject):
    """The one event filter of the viewport.

    At any time at most one thing is going on: nothing, a tool's gesture ("draw"), or a camera
    motion. What began it decides what it is until that is let go; the pen never draws while it
    navigates.
    """

    def __init__(self, viewport: Any, camera: Steered) -> None:
        super().__init__(viewport)
        self._viewport = viewport
        self._camera = camera
        self._drawing: str | None = None  # "mouse", "pen" or "touch"
        self._held: Any = None  # the button that draws or navigates
        self._motion: Motion | None = None
        self._last = QPointF()
        self._space = False
        self.navigates = False  # the tool in hand moves the camera
        self.counted: Callable[[float], float] = float  # what a pressure of the pen counts, 0..1
        self._tap: tuple[QPointF, int] | None = None  # where and when pen or finger came down
        self._touch: tuple[QPointF, float] | None = None
        viewport.installEventFilter(self)

    @property
    def busy(self) -> bool:
        """Whether a gesture or a camera motion is under way."""
        return self._drawing is not None or self._motion is not None

    @property
    def navigating(self) -> bool:
        """Whether the hand moves the camera."""
        return self._motion is not None or self._touch is not None

    def drop(self) -> None:
        """Give up whatever is going on: focus was lost, or the window was hidden."""
        if self._drawing is not None:
            self._drawing = None
            self._held = None
            self._viewport.cancel_pointer()
        self._end_motion()
        self._space = False
        self._touch = None

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the events that are ours; everything else goes on its way."""
        handle = self._handlers.get(event.type())
        return bool(handle(self, event)) if handle is not None else False

    # Mouse

    def _mouse_press(self, event: Any) -> bool:
        if self._ignored_mouse(event) or self.busy:
            return True
        motion = self._mouse_motion(event.button(), event.modifiers())
        if motion is not None:
            self._begin_motion(motion, event.button(), event.position())
        elif event.button() == _Button.LeftButton:
            self._drawing, self._held = "mouse", event.button()
            self._send("press", event)
        return True

    def _mouse_move(self, event: Any) -> bool:
        if self._ignored_mouse(event):
            return True
        if self._motion is not None:
            self._continue_motion(event.position())
        elif self._drawing == "mouse":
            self._send("move", event)
        elif self._drawing is None:
            self._send("hover", event)
        return True

    def _mouse_release(self, event: Any) -> bool:
        if self._ignored_mouse(event) or event.button() != self._held:
            return True
        if self._motion is not None:
            self._end_motion()
        elif self._drawing == "mouse":
            self._drawing, self._held = None, None
            self._send("release", event)
        return True

    def _mouse_motion(self, button: Any, modifiers: Any) -> Motion | None:
        if button == _Button.LeftButton:
            return _by_modifiers(modifiers) if self._space or self.navigates else None
        if button in (_Button.MiddleButton, _Button.RightButton):
            return _by_modifiers(modifiers)
        return None

    def _ignored_mouse(self, event: Any) -> bool:
        # Some drivers send the pen a second time as a mouse.
        return self._drawing == "pen" or (
            event.pointingDevice() is not None
            and event.pointingDevice().type() == QInputDevice.DeviceType.Stylus
        )

    # Pen

    def _tablet_press(self, event: Any) -> bool:
        event.accept()
        if self.busy:
            return True
        self._viewport.setFocus(Qt.FocusReason.MouseFocusReason)  # Qt gives it to a mouse only
        barrel = _barrel(event.buttons()) or _barrel(event.button())
        if barrel or self._space or self.navigates:
            self._begin_motion(_by_modifiers(event.modifiers()), event.button(), event.position())
        elif event.button() == _Button.LeftButton:
            self._drawing, self._held = "pen", event.button()
            self._send("press", event, pen=True, double=self._again(event, event.position()))
        return True

    def _tablet_move(self, event: Any) -> bool:
        event.accept()
        if self._motion is not None:
            self._continue_motion(event.position())
        elif self._drawing == "pen":
            self._send("move", event, pen=True)
        elif self._drawing is None:
            self._send("hover", event, pen=True)
        return True

    def _tablet_release(self, event: Any) -> bool:
        event.accept()
        if event.button() != self._held:
            return True
        if self._motion is not None:
            self._end_motion()
        elif self._drawing == "pen":
            self._drawing, self._held = None, None
            self._send("release", event, pen=True)
        return True

    def _again(self, event: Any, at: QPointF) -> bool:
        """Whether pen or finger comes down a second time at one place: Qt tells of the mouse only.

        A third time is a first one again.
        """
        before, now = self._tap, int(event.timestamp())
        self._tap = (QPointF(at), now)
        if before is None or not now:
            return False
        place, moment = before
        soon = now - moment <= QGuiApplication.styleHints().mouseDoubleClickInterval()
        double = soon and (at - place).manhattanLength() <= TAP_PX
        if double:
            self._tap = None
        return double

    # Wheel, touchpad, touch screen

    def _wheel(self, event: Any) -> bool:
        event.accept()
        at, pixels, angle = event.position(), event.pixelDelta(), event.angleDelta()
        modifiers = event.modifiers()
        if modifiers & _Mod.AltModifier:
            # With Alt some platforms report the vertical wheel as a horizontal one.
            self._viewport.alt_scroll((angle.y() or angle.x()) / 120.0)
            return True
        device = event.pointingDevice()
        two_fingers = device is not None and device.type() == QInputDevice.DeviceType.TouchPad
        if two_fingers and not pixels.isNull() and not modifiers & _Mod.ControlModifier:
            motion = Motion.PAN if modifiers & _Mod.ShiftModifier else Motion.ORBIT
            if self._motion is None:
                self._camera.begin_motion(motion, at.x(), at.y())
                self._camera.continue_motion(motion, float(pixels.x()), float(pixels.y()))
            return True
        if modifiers & _Mod.ShiftModifier:
            # As with Alt: some platforms turn the wheel sideways.
            self._viewport.shift_scroll((angle.y() or angle.x()) / 120.0)
            return True
        notches = angle.y() / 120.0
        if notches:
            self._camera.zoom_at(at.x(), at.y(), ZOOM_PER_NOTCH**notches)
        return True

    def _native_gesture(self, event: Any) -> bool:
        at = event.position()
        kind = event.gestureType()
        if kind == Qt.NativeGestureType.ZoomNativeGesture:
            self._camera.zoom_at(at.x(), at.y(), max(0.2, 1.0 + event.value()))
        elif kind == Qt.NativeGestureType.PanNativeGesture:
            delta = event.delta()
            self._camera.begin_motion(Motion.PAN, at.x(), at.y())
            self._camera.continue_motion(Motion.PAN, delta.x(), delta.y())
        elif kind == Qt.NativeGestureType.RotateNativeGesture:
            self._camera.turn_by(-0.0175 * event.value(), 0.0)
        else:
            return False
        event.accept()
        return True

    def _touch_event(self, event: Any) -> bool:
        event.accept()
        points = event.points()
        ended = event.type() in (_Type.TouchEnd, _Type.TouchCancel)
        if len(points) >= 2 and not ended:
            self._two_fingers(points[0].position(), points[1].position())
            return True
        if self._touch is not None:
            # The second finger was lifted: nothing more until both are.
            if ended:
                self._touch = None
            return True
        if not points:
            return True
        if event.type() == _Type.TouchBegin and self._drawing is None and self._motion is None:
            self._drawing = "touch"
            at = points[0].position()
            self._send("press", event, at=at, double=self._again(event, at))
        elif self._drawing == "touch":
            if ended:
                self._drawing = None
            self._send("release" if ended else "move", event, at=points[0].position())
        return True

    def _two_fingers(self, first: QPointF, second: QPointF) -> None:
        if self._drawing == "touch":
            self._drawing = None
            self._viewport.cancel_pointer()
        middle = (first + second) / 2
        span = max(1.0, ((second - first).x() ** 2 + (second - first).y() ** 2) ** 0.5)
        if self._touch is None:
            self._camera.begin_motion(Motion.ORBIT, middle.x(), middle.y())
        else:
            before, width = self._touch
            moved = middle - before
            self._camera.continue_motion(Motion.ORBIT, moved.x(), moved.y())
            self._camera.zoom_at(middle.x(), middle.y(), span / width)
        self._touch = (middle, span)

    # Keys

    def _key_press(self, event: Any) -> bool:
        if event.key() == _Key.Key_Space:
            self._space = True
            if not event.isAutoRepeat() and not self.busy:
                self._viewport.set_navigating(True)
            return True
        step = {
            _Key.Key_Left: (-1, 0),
            _Key.Key_Right: (1, 0),
            _Key.Key_Up: (0, 1),
            _Key.Key_Down: (0, -1),
        }.get(event.key())
        if step is None or self._drawing is not None:
            return False
        self._arrow(step, event.modifiers())
        return True

    def _arrow(self, step: tuple[int, int], modifiers: Any) -> None:
        motion = _by_modifiers(modifiers)
        if motion is Motion.ORBIT:
            self._camera.turn_by(ARROW_STEP * step[0], ARROW_STEP * step[1])
            return
        middle = self._viewport.rect().center()
        if motion is Motion.ZOOM:
            self._camera.zoom_at(middle.x(), middle.y(), ZOOM_PER_NOTCH ** (step[0] + step[1]))
            return
        self._camera.begin_motion(motion, middle.x(), middle.y())
        self._camera.continue_motion(motion, 40.0 * step[0], -40.0 * step[1])

    def _key_release(self, event: Any) -> bool:
        if event.key() != _Key.Key_Space:
            return False
        if not event.isAutoRepeat():
            self._space = False
            if self._motion is None:
                self._viewport.set_navigating(False)
        return True

    # Common

    def _focus_out(self, _event: Any) -> bool:
        self._space = False
        if self._motion is None:
            self._viewport.set_navigating(False)
        return False

    def _gone(self, _event: Any) -> bool:
        self.drop()
        return False

    def _begin_motion(self, motion: Motion, button: Any, at: QPointF) -> None:
        self._motion, self._held, self._last = motion, button, QPointF(at)
        self._viewport.set_navigating(True)
        self._camera.begin_motion(motion, at.x(), at.y())

    def _continue_motion(self, at: QPointF) -> None:
        moved, self._last = at - self._last, QPointF(at)
        if self._motion is not None and not moved.isNull():
            self._camera.continue_motion(self._motion, moved.x(), moved.y())

    def _end_motion(self) -> None:
        if self._motion is not None:
            self._motion, self._held = None, None
            self._viewport.set_navigating(self._space or self.navigates)

    def _send(
        self,
        kind: Any,
        event: Any,
        pen: bool = False,
        at: QPointF | None = None,
        double: bool = False,
    ) -> None:
        place = event.position() if at is None else at
        modifiers = event.modifiers()
        self._viewport.emit_pointer(
            Pointer(
                kind,
                place.x(),
                place.y(),
                pressure=self.counted(event.pressure()) if pen else 1.0,
                pen=pen,
                eraser=pen and event.pointerType() == QPointingDevice.PointerType.Eraser,
                shift=bool(modifiers & _Mod.ShiftModifier),
                ctrl=bool(modifiers & _Mod.ControlModifier),
                alt=bool(modifiers & _Mod.AltModifier),
                time=event.timestamp() / 1000.0,
                double=double or event.type() == _Type.MouseButtonDblClick,
            )
        )

    _handlers: ClassVar[dict[Any, Any]] = {
        _Type.MouseButtonPress: _mouse_press,
        _Type.MouseButtonDblClick: _mouse_press,
        _Type.MouseMove: _mouse_move,
        _Type.MouseButtonRelease: _mouse_release,
        _Type.TabletPress: _tablet_press,
        _Type.TabletMove: _tablet_move,
        _Type.TabletRelease: _tablet_release,
        _Type.Wheel: _wheel,
        _Type.NativeGesture: _native_gesture,
        _Type.TouchBegin: _touch_event,
        _Type.TouchUpdate: _touch_event,
        _Type.TouchEnd: _touch_event,
        _Type.TouchCancel: _touch_event,
        _Type.KeyPress: _key_press,
        _Type.KeyRelease: _key_release,
        _Type.FocusOut: _focus_out,
        _Type.Hide: _gone,
    }


def _by_modifiers(modifiers: Any) -> Motion:
    if modifiers & _Mod.ShiftModifier:
        return Motion.PAN
    if modifiers & _Mod.ControlModifier:
        return Motion.ZOOM
    return Motion.ORBIT


def _barrel(buttons: Any) -> bool:
    return bool(buttons & (_Button.RightButton | _Button.MiddleButton))
