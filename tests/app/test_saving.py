"""Saving documents, opening them again, and closing with work unsaved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox

from app.recent import recent
from app.window import Window
from engine import Draft, open_archive
from engine.journal import recover
from plugins.registry import kinds
from tests.app.driving import settled
from tests.app.safe import work
from tests.engine.histories import fingerprint


def test_save_and_open_again(safe_window, qtbot, tmp_path: Path, monkeypatch) -> None:
    window = safe_window()
    state = work(window, qtbot)
    assert window.isWindowModified()
    path = tmp_path / "mein Käfer"
    monkeypatch.setattr(
        "app.documents.QFileDialog.getSaveFileName", lambda *_given: (str(path), "")
    )
    with qtbot.waitSignal(window.documents.saved):
        window.actions_table.trigger("file.save")
    written = path.with_name("mein Käfer.eigenform")
    assert window.documents.path == written
    assert not window.isWindowModified()
    assert not window.safety.autosave.unsaved
    assert window.windowTitle().startswith("mein Käfer.eigenform")
    assert recent() == [written]
    eye = window.viewport.eye
    window.viewport.turn_by(0.7, 0.1)
    window.session.undo()
    window.session.undo()
    with qtbot.waitSignal(window.files.unpacked):
        window.files.open(written)
    qtbot.waitUntil(settled(window))
    assert fingerprint(window.session.history.state()) == fingerprint(state)
    assert window.viewport.eye.same_as(eye)
    assert not window.safety.autosave.unsaved
    with qtbot.waitSignal(window.documents.saved):
        window.actions_table.trigger("file.save")
    assert window.session.problems.sentence == ""


def test_a_damaged_document_is_not_saved_over(safe_window, qtbot, tmp_path: Path) -> None:
    window = safe_window()
    work(window, qtbot)
    path = tmp_path / "a.eigenform"
    with qtbot.waitSignal(window.documents.saved):
        window.documents.save_to(path)
    path.write_bytes(path.read_bytes()[:-2000])
    with qtbot.waitSignal(window.files.unpacked):
        window.files.open(path)
    assert "damaged" in window.session.problems.sentence
    assert window.documents.path is None


def test_a_document_that_cannot_be_opened_leaves_the_old_one(
    safe_window, qtbot, tmp_path: Path
) -> None:
    window = safe_window()
    document = window.session.document
    path = tmp_path / "a.eigenform"
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    window.files.open(path)
    qtbot.waitUntil(lambda: bool(window.session.problems.sentence))
    assert "a.eigenform" in window.session.problems.sentence
    assert window.session.document is document


def answer(window: Window, qtbot, button: QMessageBox.StandardButton) -> None:
    qtbot.waitUntil(lambda: window.safety._question is not None)
    question = window.safety._question
    qtbot.mouseClick(question.button(button), Qt.MouseButton.LeftButton)


def test_closing_with_work_asks_and_cancel_stays(safe_window, qtbot, artefacts: Path) -> None:
    window = safe_window()
    work(window, qtbot)
    assert not window.close()
    window.safety._question.grab().save(str(artefacts / "question.png"))
    answer(window, qtbot, QMessageBox.StandardButton.Cancel)
    assert window.isVisible()
    window.session.undo()
    window.session.redo()


def test_not_saving_sets_the_work_aside(safe_window, qtbot, sphere) -> None:
    window = safe_window()
    state = work(window, qtbot)
    folder = window.safety.autosave.folder
    assert not window.close()
    answer(window, qtbot, QMessageBox.StandardButton.Discard)
    (aside,) = recover(folder, kinds())
    aside.release()
    assert aside.why == "set aside"
    after = safe_window()
    with qtbot.waitSignal(after.safety.looked):
        after.safety.look_for_work()  # as the start does; that one may be over already
    assert not after.safety.bar.isVisible(), "the next start says nothing of it"
    after.actions_table.trigger("file.restore")
    qtbot.waitUntil(lambda: after.safety.bar.isVisible())
    assert "closed without saving" in after.safety.bar.text
    after.safety.bar.buttons["Restore"].click()
    assert fingerprint(after.session.history.state()) == fingerprint(state)


def test_saving_on_closing_closes_afterwards(safe_window, qtbot, tmp_path: Path) -> None:
    window = safe_window()
    state = work(window, qtbot)
    path = tmp_path / "a.eigenform"
    window.documents.ask_path = lambda: path
    assert not window.close()
    closed: list[int] = []
    window.destroyed.connect(lambda: closed.append(1))
    answer(window, qtbot, QMessageBox.StandardButton.Save)
    qtbot.waitUntil(lambda: bool(closed))
    assert fingerprint(open_archive(path, kinds()).state) == fingerprint(state)
    assert recover(tmp_path / "state" / "journals", kinds()) == []


def test_a_draft_alone_is_closed_without_a_word(safe_window, qtbot, tmp_path: Path) -> None:
    window = safe_window()
    session = window.session
    session.change(session.document.with_draft(Draft(np.arange(200, 420), 0.3)), "Region")
    assert window.safety.autosave.unsaved
    assert window.close()
    (aside,) = recover(tmp_path / "state" / "journals", kinds())
    assert aside.why == "set aside"
    aside.release()
