"""Tool rail on the left and the options of the tool in hand above the viewport."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.look import Theme, icon
from app.panels.options import OptionsRow
from app.panels.panel import GRID
from app.toolhost import ToolHost
from plugins.api import Tool

BUTTON = 44
LEAST_BUTTON = 32  # as small as a pen hits
ICON = 24


class ToolRail(QFrame):
    """One button for every tool that was found, in their order."""

    def __init__(self, host: ToolHost, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._host = host
        self._theme: Theme | None = None
        self._keys_of: Callable[[str], str] = lambda _name: ""
        self.buttons: dict[str, QToolButton] = {}
        self._looks: dict[str, tuple[Theme, bool, str]] = {}
        column = QVBoxLayout(self)
        column.setContentsMargins(GRID // 2, GRID // 2, GRID // 2, GRID // 2)
        column.setSpacing(GRID // 4)
        for name, tool in host.toolbox.tools.items():
            button = QToolButton(self)
            button.setCheckable(True)
            button.setFixedWidth(BUTTON)
            button.setMinimumHeight(LEAST_BUTTON)
            button.setMaximumHeight(BUTTON)
            button.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)
            button.setIconSize(QSize(ICON, ICON))
            button.setAccessibleName(tool.title)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(lambda _on=False, name=name: host.choose(name))
            # In a low window all of them are lower, so that none is out of reach.
            column.addWidget(button, BUTTON)
            self.buttons[name] = button
        column.addStretch(1)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)

    def name_keys(self, keys_of: Callable[[str], str]) -> None:
        """Say with every tool the key that takes it, as `keys_of(name)` knows it, "" for none."""
        self._keys_of = keys_of
        self.refresh()

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self.setStyleSheet(f"ToolRail {{ background: {theme.panel}; }}")
        self.refresh()

    def refresh(self) -> None:
        """Show which tool is in hand and which can be taken."""
        if self._theme is None:
            return
        for name, button in self.buttons.items():
            tool = self._host.toolbox.tools[name]
            held = self._host.active is tool
            looks = (self._theme, held, self._keys_of(name))
            if self._looks.get(name) != looks:
                self._looks[name] = looks
                self._dress_button(button, tool, *looks)
            button.setChecked(held)
            button.setEnabled(held or self._host.available(name))

    def _dress_button(
        self, button: QToolButton, tool: Tool, theme: Theme, held: bool, key: str
    ) -> None:
        button.setIcon(icon(tool.icon, theme, theme.accent_text if held else None))
        key = f" ({key})" if key else ""
        button.setToolTip(f"<b>{tool.title}</b>{key}<br>{tool.tip}")


class ToolStrip(QFrame):
    """Name of the tool in hand and its options.

    Signals
    -------
    left : a control that the keys went to is about to go.
    """

    left = Signal()

    def __init__(self, host: ToolHost, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._host = host
        self._name = QLabel(self)
        self._name.setStyleSheet("font-weight: 600;")
        self._options: OptionsRow | None = None
        self._for = ""
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(GRID * 2, GRID // 2, GRID * 2, GRID // 2)
        self._row.setSpacing(GRID * 2)
        self._row.addWidget(self._name)
        self._row.addStretch(1)
        self.setFixedHeight(44)

    def refresh(self) -> None:
        """Show the tool in hand, how it is set, and lengths in the unit of the model."""
        tool = self._host.active
        if tool is None:
            return
        if tool.id != self._for:
            self._take(tool)
        if self._options is not None:
            self._options.show_options(self._host.toolbox.options_of(tool.id), self._host.unit)

    def _take(self, tool: Tool) -> None:
        """Make the controls of another tool."""
        name = self._for = tool.id
        self._name.setText(tool.title)
        if self._options is not None:
            focus = self._options.focusWidget()
            if focus is not None and focus.hasFocus():
                # It would go on to whatever comes next in the window.
                self.left.emit()
            self._options.hide()
            self._options.deleteLater()
        self._options = OptionsRow(
            self._host.toolbox.options_of(tool.id),
            lambda options: self._host.toolbox.set_options(name, options),
            self,
        )
        self._row.insertWidget(1, self._options)
