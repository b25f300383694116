"""Thumbnails: a small picture of every step, taken of what is seen when it is there."""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtGui import QPixmap

from app.panels.steps import THUMBNAIL, StepsPanel
from app.session import Session
from app.stage import Stage
from app.viewport import Viewport


class Thumbnails(QObject):
    """Takes a picture for the steps panel whenever the form has come to rest."""

    def __init__(
        self, session: Session, stage: Stage, viewport: Viewport, steps: StepsPanel
    ) -> None:
        super().__init__(steps)
        self._session = session
        self._stage = stage
        self._viewport = viewport
        self._steps = steps
        # Not QTimer.singleShot: it keeps what it has called, and with it the whole window.
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self._take)
        stage.settled.connect(self._take_soon)

    def _take_soon(self) -> None:
        if self._steps.wants_picture():
            self._soon.start()

    def _take(self) -> None:
        """Keep a thumbnail of what is seen for the step that was just made."""
        history = self._session.history
        if history is None or self._stage.flowing or not self._steps.wants_picture():
            return
        seen = self._viewport.grabFramebuffer()
        shape = THUMBNAIL.scaled(seen.size(), Qt.AspectRatioMode.KeepAspectRatio)
        left, top = (seen.width() - shape.width()) // 2, (seen.height() - shape.height()) // 2
        middle = seen.copy(left, top, shape.width(), shape.height())
        ratio = self._viewport.devicePixelRatioF()
        picture = QPixmap.fromImage(
            middle.scaled(
                THUMBNAIL * ratio,
                Qt.AspectRatioMode.IgnoreAspectRatio,
                Qt.TransformationMode.SmoothTransformation,
            )
        )
        picture.setDevicePixelRatio(ratio)
        self._steps.set_picture(history.current_id, picture)
