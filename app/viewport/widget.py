"""Viewport: the form on screen, and the hands on it.

It knows no document and no tool. Pixels at its public interface are logical pixels from the top
left corner; positions are in mesh units.

Its ideas stand one on the other, each in a file of its own: canvas (OpenGL), moving (rest and
motion), looking (the camera), inking (what lies over the picture), layers (the form and what lies
on it), sighting (what is seen under pixels), and here the hands.
"""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QEvent, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractSpinBox, QApplication, QComboBox, QLineEdit, QWidget

from app.look import DARK, Theme
from app.viewport.hands import Hands
from app.viewport.sighting import Sighting
from plugins.api import Pointer

MOST_WAIT_MS = 5000
_TYPED_INTO = (QLineEdit, QAbstractSpinBox, QComboBox)


class Viewport(Sighting):
    """The form on screen.

    Signals
    -------
    pointer : `plugins.api.Pointer` of the left button, the pen tip, or hovering.
    cancelled : the gesture under way will have no release.
    selecting(on) : a stroke is over, and what it means waits for what is seen of a heavy form.
    alt_scrolled, shift_scrolled : notches of the wheel turned with Alt or Shift held.
    """

    pointer = Signal(object)
    cancelled = Signal()
    selecting = Signal(bool)
    alt_scrolled = Signal(float)
    shift_scrolled = Signal(float)

    def __init__(self, parent: QWidget | None = None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self.setAcceptDrops(False)
        self.setTabletTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_AcceptTouchEvents)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumSize(160, 120)
        self._tool_cursor: Any = None
        self._held: list[Pointer] = []
        self._form_at_press: object = None
        self._stroking = False
        self._patience = QTimer(self)
        self._patience.setSingleShot(True)
        self._patience.setInterval(MOST_WAIT_MS)
        self._patience.timeout.connect(self._let_go)
        # What a stroke means is asked when it ends: what is seen is worked out while it is drawn.
        self._foresee = QTimer(self)
        self._foresee.setSingleShot(True)
        self._foresee.timeout.connect(self.foresee)
        self.sighted.connect(self._let_go)
        self.hands = Hands(self, self.navigation)
        self._apply_eye()

    def _held_in_motion(self) -> bool:
        return self.hands.navigating or super()._held_in_motion()

    def emit_pointer(self, pointer: Pointer) -> None:
        """Hand an event to whoever holds the tool."""
        if pointer.kind == "press":
            self.navigation.stop()
            self.overlay.set_invitation(None)
            self._form_at_press = self._form_now()
            self._stroking = True
            self._foresee.start()
        if self._held or (pointer.kind == "release" and self._waits()):
            self._hold(pointer)
        else:
            self._hand_on(pointer)

    def cancel_pointer(self) -> None:
        """Say that the gesture under way will have no release."""
        self._held.clear()
        self._let_go()
        self._stroking = False
        self.cancelled.emit()

    def _form_now(self) -> object:
        return self.scene.surface and self.scene.surface.stamp

    def _waits(self) -> bool:
        """Whether a stroke's end has to wait; not after a drag that the form followed."""
        return self.sight_comes and self._form_now() == self._form_at_press

    def _hold(self, pointer: Pointer) -> None:
        if not self._held:
            self._patience.start()
            self.selecting.emit(True)
        if pointer.kind != "hover":
            self._held.append(pointer)

    def _let_go(self) -> None:
        """Hand on what was held back."""
        waited = self._patience.isActive() or bool(self._held)
        self._patience.stop()
        held, self._held = self._held, []
        if waited:
            self.selecting.emit(False)
        for pointer in held:
            self._hand_on(pointer)

    def _hand_on(self, pointer: Pointer) -> None:
        self.pointer.emit(pointer)
        if pointer.kind == "release":
            self._stroking = False

    def _stroke_under_way(self) -> bool:
        return self._stroking

    def alt_scroll(self, notches: float) -> None:
        """Say that the wheel was turned with Alt held."""
        self.alt_scrolled.emit(notches)

    def shift_scroll(self, notches: float) -> None:
        """Say that the wheel was turned with Shift held."""
        self.shift_scrolled.emit(notches)

    def set_tool_navigates(self, navigates: bool) -> None:
        """Let strokes of the main button and the pen's tip move the camera, or draw again."""
        if navigates != self.hands.navigates:
            self.hands.navigates = navigates
            self.set_navigating(navigates)

    def set_navigating(self, navigating: bool) -> None:
        """Show by the cursor that the hand moves the camera, not the tool."""
        if navigating and self._tool_cursor is None:
            self._tool_cursor = self.cursor()
            self.setCursor(Qt.CursorShape.SizeAllCursor)
        elif not navigating and self._tool_cursor is not None:
            self.setCursor(self._tool_cursor)
            self._tool_cursor = None

    def enterEvent(self, event: Any) -> None:
        """Take the keys when the pointer comes, unless somebody is typing."""
        if not isinstance(QApplication.focusWidget(), _TYPED_INTO):
            self.setFocus(Qt.FocusReason.MouseFocusReason)
        event.accept()

    def leaveEvent(self, event: Any) -> None:
        """Hide the brush when the pointer leaves."""
        self.overlay.set_brush(None)
        event.accept()

    def keyPressEvent(self, event: Any) -> None:
        """Leave the key to the window: VTK's own keys would close it."""
        event.ignore()

    def keyReleaseEvent(self, event: Any) -> None:
        """Leave the key to the window."""
        event.ignore()

    def dragEnterEvent(self, event: Any) -> None:
        """Leave files to the window."""
        event.ignore()

    def dropEvent(self, event: Any) -> None:
        """Leave files to the window."""
        event.ignore()

    def event(self, event: QEvent) -> bool:
        """Handle what Qt sends."""
        asks = event.type() == QEvent.Type.ShortcutOverride
        if asks and isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Space:
            event.accept()
        return bool(super().event(event))

    def close(self) -> None:  # type: ignore[override]  # its two bases, Qt and pyvista, disagree
        """Free everything of OpenGL; call it before the window goes."""
        if getattr(self, "_closed", True):
            return
        for other in list(self._linked):
            self.unlink(other)
        self._rest_timer.stop()
        self._patience.stop()
        self._foresee.stop()
        self._held.clear()
        self.gradual.give_up()
        self.aside.clear()
        self.navigation.stop()
        self._sight = None
        self.scene.clear()
        super().close()
