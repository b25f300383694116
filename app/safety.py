"""Safety: what keeps work from being lost, plugged into a window."""

from __future__ import annotations

import logging
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, Qt, Signal, Slot
from PySide6.QtGui import QGuiApplication, QIcon
from PySide6.QtWidgets import QMessageBox

from app.autosave import Autosave
from app.crash import CrashDialog, CrashWatch, native_crashes
from app.opening_plate import form_seen
from app.recovery_bar import RecoveryBar, RecoveryOffers
from engine.files.place import sweep_strays
from engine.files.report import shown
from engine.journal import Recoverable, Why, recover
from plugins.registry import kinds

if TYPE_CHECKING:
    from app.window import Window

log = logging.getLogger(__name__)


class Safety(QObject):
    """Journal, recovery, crash window, and the question on closing.

    Parameters
    ----------
    window : it is watched; nothing in it needs to know of this.
    folder : the state folder.

    Signals
    -------
    looked : everything left by earlier runs has been looked at.
    """

    looked = Signal()
    _found = Signal(object, object)

    def __init__(self, window: Window, folder: Path) -> None:
        super().__init__(window)
        self._window = window
        self._folder = folder
        self._leaving = self._left = self._asked_for = False
        self._waits_for_files = self._unasked = False
        self._dialog: CrashDialog | None = None
        self._question: QMessageBox | None = None
        self._search: threading.Thread | None = None
        self.autosave = Autosave(window.session, folder, self)
        self.autosave.problem.connect(self._journal_fails)
        self.autosave.set_aside.connect(self._was_set_aside)
        self.autosave.unsaved_changed.connect(self._mark)
        window.documents.saved.connect(self.autosave.saved)
        self.bar = RecoveryBar(window.viewport, lambda: form_seen(window.session, window.viewport))
        window.session.opened.connect(self.bar.settle)
        self.offers = RecoveryOffers(self.bar, self.autosave.restore, self)
        self.watch = CrashWatch(folder, self)
        self.watch.crashed.connect(self._crashed)
        window.session.problems.bug.connect(self.watch.note)
        self._found.connect(self._offer, Qt.ConnectionType.QueuedConnection)
        window.installEventFilter(self)
        application = QGuiApplication.instance()
        if isinstance(application, QGuiApplication):
            application.commitDataRequest.connect(
                self._system_ends, Qt.ConnectionType.DirectConnection
            )

    # ---- what earlier runs left

    def look_for_work(self, *, set_aside: bool = False) -> None:
        """Look for what can be restored, in the background, and offer it.

        Parameters
        ----------
        set_aside : also what the person once chose not to save.
        """
        if self._search is not None and self._search.is_alive():
            return
        self.offers.release()
        from app.recent import recent

        folders = {path.parent for path in recent()}

        def search() -> None:
            for folder in folders:
                sweep_strays(folder)
            crashes = native_crashes(self._folder)
            offered: list[Recoverable] = []
            for found in recover(self.autosave.folder, kinds()):
                if found.why == "set aside" and not set_aside:
                    found.release()
                else:
                    offered.append(found)
            self._found.emit(offered, crashes)

        self._search = threading.Thread(target=search, name="recovery", daemon=True)
        self._search.start()

    def restore_set_aside(self) -> None:
        """Offer everything that was not saved, asked for by the person."""
        self._asked_for = True
        self._window.session.noticed.emit("Looking for unsaved work…")
        self.look_for_work(set_aside=True)

    @Slot(object, object)
    def _offer(self, found: list[Recoverable], crashes: list[str]) -> None:
        if self._leaving:
            for one in found:
                one.release()
            return
        self.offers.offer(found, crashes)
        if self._asked_for:
            self._asked_for = False
            nothing = not found and not crashes
            words = "There is no unsaved work to restore" if nothing else ""
            self._window.session.noticed.emit(words)
        self.looked.emit()

    # ---- while it runs

    def _crashed(self, report: str) -> None:
        if self._dialog is not None:
            self._dialog.add(report)
            return
        open_document = self._window.session.document is not None
        save = self._window.documents.save_copy if open_document else None
        self._dialog = CrashDialog(report, save, self._window)
        self._dialog.destroyed.connect(self._forget_dialog)
        self._dialog.show()

    def _forget_dialog(self) -> None:
        self._dialog = None

    def _journal_fails(self, sentence: str) -> None:
        if sentence:
            self._window.session.problems.say(sentence)

    def _was_set_aside(self, name: str) -> None:
        self._window.session.noticed.emit(
            f"Your changes to “{name}” are kept: File, Restore unsaved work"
        )

    def _mark(self) -> None:
        self._window.setWindowModified(self.autosave.worth_asking)

    # ---- closing

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Ask before unsaved work is closed; a draft alone is kept without a word."""
        if watched is self._window and event.type() == QEvent.Type.Close:
            if self._window.session.writing.busy and not self._waits_for_files:
                event.ignore()
                self._close_when_written()
                return True
            if self.autosave.worth_asking and not (self._leaving or self._unasked):
                event.ignore()
                self._ask()
                return True
            self.leave()
        return super().eventFilter(watched, event)

    def _close_when_written(self) -> None:
        """Close once everything is written; whoever closes again meanwhile does not wait."""
        writing = self._window.session.writing
        self._waits_for_files = True
        writing.settled.connect(self._written, Qt.ConnectionType.SingleShotConnection)
        self._window.session.noticed.emit(
            f"The window closes when {writing.names} is written. Close again to leave it unwritten."
        )

    def _written(self, well: bool) -> None:
        self._waits_for_files = False
        if well:
            self._window.close()
        else:
            self._unasked = False

    def leave(self) -> None:
        """End the journal and let go of everything; what is unsaved is set aside."""
        self._end("set aside")
        if not self._left:
            self._left = True
            self.offers.release()
            self.watch.stop()
            if self._search is not None:
                self._search.join(10)

    def _end(self, keep: Why) -> None:
        if not self._leaving:
            self._leaving = True
            self.autosave.end(keep if self.autosave.unsaved else None)

    def _ask(self) -> None:
        if self._question is not None:
            self._question.raise_()
            return
        document = self._window.session.document
        name = document.name if document is not None else ""
        question = QMessageBox(self._window)
        question.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        question.setIcon(QMessageBox.Icon.NoIcon)
        # A document's name may look like markup.
        question.setTextFormat(Qt.TextFormat.PlainText)
        question.setText(f"Save your changes to “{shown(name)}”?")
        question.setInformativeText(
            "Without saving they stay for a week under File, Restore unsaved work."
        )
        standard = QMessageBox.StandardButton
        question.setStandardButtons(standard.Save | standard.Discard | standard.Cancel)
        question.setDefaultButton(standard.Save)
        question.button(standard.Discard).setText("Don't save")
        for button in question.buttons():
            button.setIcon(QIcon())
        question.finished.connect(self._answered)
        self._question = question
        question.open()

    def _answered(self, answer: int) -> None:
        self._question = None
        standard = QMessageBox.StandardButton
        if answer == standard.Save:
            self._window.documents.save(then=self._close_unasked)
        elif answer == standard.Discard:
            self._close_unasked()

    def _close_unasked(self) -> None:
        self._unasked = True
        self._window.close()

    def _system_ends(self) -> None:
        """The person logs out: nobody can answer now, so the next start offers the work."""
        self._end("closed")
