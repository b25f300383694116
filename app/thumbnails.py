"""Thumbnails: a small picture of every step, taken of what is seen when it is there.

What was restored after a crash brings its steps without pictures: those are made one by one, in
idle moments, of the forms as they were.
"""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtGui import QImage, QPixmap

from app.panels.steps import THUMBNAIL, StepsPanel
from app.session import Session
from app.stage import Stage
from app.viewport import Viewport
from app.viewport.heavy import is_heavy
from app.viewport.portrait import portrait

IDLE_MS = 60  # between two pictures that are made


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
        self._idle = QTimer(self)
        self._idle.setSingleShot(True)
        self._idle.setInterval(IDLE_MS)
        self._idle.timeout.connect(self._make_one)

    def _take_soon(self) -> None:
        if self._steps.wants_picture():
            self._soon.start()
        elif self._steps.without_picture():
            self._idle.start()

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
        small = middle.scaled(
            THUMBNAIL * ratio,
            Qt.AspectRatioMode.IgnoreAspectRatio,
            Qt.TransformationMode.SmoothTransformation,
        )
        self._keep(history.current_id, small)
        self._take_soon()

    def _make_one(self) -> None:
        """Make the picture of a step that has none, as if it was seen from here."""
        history, missing = self._session.history, self._steps.without_picture()
        if history is None or not missing:
            return
        if self._viewport.moving or self._stage.flowing:
            self._idle.start()
            return
        moment = missing[0]
        mesh = history.moments[moment].document.mesh
        if is_heavy(mesh):
            return  # it would hold up the window: its picture comes when one goes there
        size = THUMBNAIL * self._viewport.devicePixelRatioF()
        self._keep(moment, portrait(self._viewport, mesh, (size.width(), size.height())))
        self._take_soon()

    def _keep(self, moment: int, image: QImage) -> None:
        picture = QPixmap.fromImage(image)
        picture.setDevicePixelRatio(self._viewport.devicePixelRatioF())
        self._steps.set_picture(moment, picture)

    def stop(self) -> None:
        """Make no more pictures, for closing."""
        self._soon.stop()
        self._idle.stop()
