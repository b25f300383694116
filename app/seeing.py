"""Kept views, the base alone, ambient occlusion, a flip between two steps, saving a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSignalBlocker
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QLabel,
    QSpinBox,
    QWidget,
)

from app.actions import Action, with_document
from app.panels.panel import GRID, plain_number

if TYPE_CHECKING:
    from app.viewport import Viewport
    from app.window import Window

LARGEST_PICTURE = 8192
BASE_WORDS = "The base of the region, whatever the level. {view.base} shows your form again"


def seeing(window: Window) -> list[Action]:
    """Return the actions of this file, for the menu View."""
    menu, viewport = "View", window.viewport
    flip = Flip(window)

    def base_shown(on: bool) -> None:
        window.hint.set_said(BASE_WORDS if on else "")
        window.refresh()

    window.stage.base_shown.connect(base_shown)

    def occlusion() -> None:
        wanted = not viewport.renderer.GetUseSSAO()
        if viewport.set_occlusion(wanted) != wanted:
            window.hint.set_notice("Ambient occlusion needs a graphics card", done=False)
        window.refresh()

    def keep() -> None:
        document = window.session.document
        if document is not None:
            suggestion = f"View {len(document.views) + 1}"
            window.ask.ask(
                "Keep this view as",
                suggestion,
                lambda name: window.session.keep_view(name, viewport.view()),
            )

    return [
        Action("view.base", "Base alone",
               lambda: window.stage.show_base(not window.stage.base_alone), ("Shift+B",),
               "", lambda _document: window.session.decomposition is not None,
               menu, checked=lambda: window.stage.base_alone),
        Action("view.occlusion", "Ambient occlusion", occlusion, ("A",), "", with_document, menu,
               checked=lambda: bool(viewport.renderer.GetUseSSAO())),
        Action("view.flip", "Flip to the step looked at before", flip.turn, ("V",),
               "mdi6.flip-horizontal", lambda _document: flip.possible, menu,
               apart=True),
        Action("view.keep", "Keep this view…", keep, (), "mdi6.camera-marker-outline",
               with_document, menu),
    ]  # fmt: skip


class Flip:
    """Remembers the step looked at before, and goes back and forth between it and this one."""

    def __init__(self, window: Window) -> None:
        self._session = window.session
        self._now: int | None = None
        self._before: int | None = None
        self._session.opened.connect(self._forget)
        self._session.document_changed.connect(self._follow)

    @property
    def possible(self) -> bool:
        """Whether there is a step to flip to."""
        history = self._session.history
        return history is not None and self._before in history.moments

    def turn(self) -> None:
        """Go to the step looked at before; again comes back."""
        if self._before is not None and self.possible:
            self._session.go(self._before)

    def _forget(self) -> None:
        self._now = self._before = None
        self._follow()

    def _follow(self) -> None:
        history = self._session.history
        current = None if history is None else history.current_id
        if current != self._now:
            self._now, self._before = current, self._now


class PictureDialog(QDialog):
    """Asks how large a picture shall be and what is behind the form.

    The height follows the width, so that the picture shows what the viewport shows, until the
    person sets the height as well.

    Parameters
    ----------
    largest : side of a picture, px.
    times : how often the viewport's own size it begins with.
    """

    def __init__(
        self,
        viewport: Viewport,
        parent: QWidget,
        title: str = "Save a picture",
        largest: int = LARGEST_PICTURE,
        times: int = 2,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self._follows = True
        self._ratio = viewport.height() / max(viewport.width(), 1)
        self.width_box, self.height_box = QSpinBox(self), QSpinBox(self)
        for box in (self.width_box, self.height_box):
            box.setRange(64, largest)
            box.setSuffix(" px")
            plain_number(box)
            box.setKeyboardTracking(True)  # the height follows every digit of the width
        self.transparent = QCheckBox("Transparent background", self)
        self.transparent.setChecked(True)
        form = QFormLayout(self)
        form.setContentsMargins(2 * GRID, 2 * GRID, 2 * GRID, 2 * GRID)
        form.setHorizontalSpacing(2 * GRID)
        form.setVerticalSpacing(GRID + GRID // 2)
        for words, box in (("Width", self.width_box), ("Height", self.height_box)):
            label = QLabel(words, self)
            label.setBuddy(box)
            label.setMinimumHeight(box.minimumHeight())  # on the digits' line
            form.addRow(label, box)
        form.addRow(self.transparent)
        kinds = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(kinds.Save | kinds.Cancel, self)
        for button in buttons.buttons():
            button.setIcon(QIcon())
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        form.addRow(buttons)
        self.setMinimumWidth(320)
        self.width_box.valueChanged.connect(self._follow)
        self.height_box.valueChanged.connect(self._set_apart)
        self.width_box.setValue(min(largest, times * viewport.width()))
        self._follow()
        self.width_box.selectAll()

    @property
    def size_in_pixels(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return self.width_box.value(), self.height_box.value()

    def _follow(self) -> None:
        if self._follows:
            with QSignalBlocker(self.height_box):
                self.height_box.setValue(round(self.width_box.value() * self._ratio))

    def _set_apart(self) -> None:
        self._follows = False


def picture_file(parent: QWidget, folder: str) -> Path | None:
    """Ask where a picture shall be saved."""
    name, _ = QFileDialog.getSaveFileName(parent, "Save a picture", folder, "PNG (*.png)")
    return Path(name) if name else None
