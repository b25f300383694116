"""Plugins: what was found, what was left out and why, and the person's own files with a switch."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices, QFont
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from app.toolhost import ToolHost
from engine import EngineError
from plugins.dropin import dropin_folder, dropins, switch
from plugins.registry import STEPS, TOOLS, Failure, find_steps, find_tools, origins

GRID = 8
TRUST = (
    "A plugin is a program: it can do whatever you can do on this computer. Switch on only files "
    "that you trust. One that is changed afterwards is off again."
)


class PluginList(QDialog):
    """The list; it is made anew whenever something in it changed."""

    def __init__(self, host: ToolHost, failures: tuple[Failure, ...], parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Plugins")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(560, 600)
        self._host = host
        self._failures = failures
        self.note = QLabel(self)
        self.note.setWordWrap(True)
        self.note.setObjectName("note")
        self._area = QScrollArea(self)
        self._area.setWidgetResizable(True)
        self._area.setFrameShape(QFrame.Shape.NoFrame)
        self._area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        folder = QPushButton("Open the plugin folder", self)
        folder.setAutoDefault(False)
        folder.clicked.connect(self._open_folder)
        close = QPushButton("Close", self)
        close.clicked.connect(self.accept)
        row = QHBoxLayout()
        row.addWidget(folder)
        row.addStretch(1)
        row.addWidget(close)
        column = QVBoxLayout(self)
        column.setContentsMargins(2 * GRID, 2 * GRID, 2 * GRID, 2 * GRID)
        column.setSpacing(GRID)
        column.addWidget(self._area, 1)
        column.addWidget(self.note)
        column.addLayout(row)
        self.fill()

    def fill(self) -> None:
        """Show how things are now."""
        inside = QWidget(self)
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, GRID, 0)
        column.setSpacing(GRID // 2)
        self._add_failures(column)
        self._add_files(column)
        self._add_tools(column)
        self._add_steps(column)
        column.addStretch(1)
        self._area.setWidget(inside)

    def _add_failures(self, column: QVBoxLayout) -> None:
        if not self._failures:
            return
        column.addWidget(_head("Left out"))
        for failure in self._failures:
            column.addWidget(_line(str(failure)))

    def _add_files(self, column: QVBoxLayout) -> None:
        column.addWidget(_head("Your own files"))
        column.addWidget(_line(TRUST))
        files = dropins()
        if not files:
            where = from_home(dropin_folder())
            column.addWidget(_line(f"There is no .py file in {where}", faint=True))
        for one in files:
            words = f"{one.path.name}, changed since it was switched on" if one.changed else (
                one.path.name
            )  # fmt: skip
            box = QCheckBox(words, self)
            box.setObjectName(f"file {one.name}")
            box.setChecked(one.on)
            box.toggled.connect(lambda on, name=one.name: self._switch(name, on))
            column.addWidget(box)

    def _add_tools(self, column: QVBoxLayout) -> None:
        column.addWidget(_head("Tools"))
        offered = origins(TOOLS)
        for name, tool in self._host.toolbox.tools.items():
            line = QHBoxLayout()
            line.addWidget(_line(tool.title), 1)
            line.addWidget(_line(offered.get(name, ""), faint=True), 1)
            column.addLayout(line)
            if name in self._host.toolbox.switched_off:
                off = QHBoxLayout()
                off.addWidget(_line(f"Switched off: {self._host.toolbox.reasons.get(name, '')}"), 1)
                again = QPushButton("Try again", self)
                again.setObjectName(f"again {name}")
                again.setAutoDefault(False)
                again.clicked.connect(lambda _on=False, name=name: self._try_again(name))
                off.addWidget(again)
                column.addLayout(off)

    def _add_steps(self, column: QVBoxLayout) -> None:
        column.addWidget(_head("Steps of recipes"))
        offered = origins(STEPS)
        for name, kind in find_steps().items.items():
            line = QHBoxLayout()
            line.addWidget(_line(getattr(kind, "label", "") or name.capitalize()), 1)
            line.addWidget(_line(offered.get(name, ""), faint=True), 1)
            column.addLayout(line)

    def _try_again(self, name: str) -> None:
        self._host.toolbox.switch_on(name)
        self.fill()

    def _switch(self, name: str, on: bool) -> None:
        try:
            switch(name, on)
        except EngineError as error:
            self.note.setText(str(error))
            return
        self.note.setText(f"{name}.py is {'on' if on else 'off'} from the next start.")

    def _open_folder(self) -> None:
        folder = dropin_folder()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            self.note.setText(f"{folder} cannot be made ({error.strerror}). Make it yourself.")
            return
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))


def from_home(path: Path) -> str:
    """Return a path as people write it: what lies in their own folder begins with ~."""
    try:
        return str(Path("~") / path.relative_to(Path.home()))
    except ValueError:
        return str(path)


def all_failures() -> tuple[Failure, ...]:
    """Return every tool and step that could not be used."""
    return find_tools().failures + find_steps().failures


def _head(text: str) -> QLabel:
    label = QLabel(text)
    # Not by a style sheet: with one a label's words begin two pixels further in than others do.
    font = label.font()
    font.setWeight(QFont.Weight.DemiBold)
    label.setFont(font)
    label.setContentsMargins(0, GRID, 0, 0)
    return label


def _line(text: str, faint: bool = False) -> QLabel:
    label = QLabel(text)
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    if faint:
        label.setEnabled(False)
    return label
