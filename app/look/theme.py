"""The theme of the whole application: palette and a small style sheet, following the system."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QDir, QObject, Qt, Signal
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication, QStyleFactory

from app.look.colours import DARK, LIGHT, Theme
from app.look.restyle import Restyle

# Colours are roles of the palette only, so that another theme needs no other sheet.
_SHEET = """
QToolTip { background: palette(alternate-base); color: palette(text);
    border: 1px solid palette(mid); padding: 4px 8px; }
QMainWindow::separator { background: palette(mid); width: 1px; height: 1px; }
QToolBar { background: palette(alternate-base); border: 0; padding: 4px; spacing: 4px; }
QStatusBar { background: palette(window); color: palette(placeholder-text); }
QStatusBar::item { border: 0; }
QDockWidget { titlebar-close-icon: none; }
QToolButton { border: 1px solid transparent; border-radius: 6px; padding: 4px;
    min-width: 24px; min-height: 24px; }
QToolButton:hover { background: palette(midlight); }
QToolButton:checked { background: palette(highlight); color: palette(highlighted-text); }
QToolButton:focus { border: 1px solid palette(highlight); }
QPushButton { background: palette(base); border: 1px solid palette(mid); border-radius: 6px;
    padding: 4px 12px; min-height: 22px; }
QPushButton:hover { background: palette(midlight); }
QPushButton:pressed { background: palette(mid); }
QPushButton:focus { border: 1px solid palette(highlight); }
QPushButton:default { background: palette(highlight); color: palette(highlighted-text);
    border: 1px solid palette(highlight); }
QPushButton:disabled { color: palette(placeholder-text); }
QLineEdit, QSpinBox, QDoubleSpinBox, QComboBox { background: palette(base); color: palette(text);
    border: 1px solid palette(mid); border-radius: 6px; padding: 2px 8px; min-height: 26px;
    selection-background-color: palette(highlight); selection-color: palette(highlighted-text); }
QCheckBox::indicator { width: 14px; height: 14px; }
QCheckBox::indicator:unchecked { background: palette(base);
    border: 1px solid palette(placeholder-text); border-radius: 3px; }
QCheckBox::indicator:checked { background: palette(highlight); image: url(look:tick.svg);
    border: 1px solid palette(highlight); border-radius: 3px; }
QCheckBox::indicator:checked:disabled { background: palette(mid); border-color: palette(mid); }
QCheckBox { outline: 0; border-bottom: 2px solid transparent; }
QCheckBox:focus { border-bottom: 2px solid palette(highlight); }
QLineEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus, QComboBox:focus {
    border: 1px solid palette(highlight); }
QLineEdit:disabled, QSpinBox:disabled, QDoubleSpinBox:disabled, QComboBox:disabled {
    color: palette(placeholder-text); }
QListView, QTreeView, QTableView { background: palette(base); border: 1px solid palette(mid);
    border-radius: 6px; selection-background-color: palette(highlight);
    selection-color: palette(highlighted-text); }
QMenu { background: palette(alternate-base); border: 1px solid palette(mid); padding: 4px; }
QMenu::item { padding: 6px 24px 6px 16px; border-radius: 4px; }
QMenu::item:selected { background: palette(highlight); color: palette(highlighted-text); }
QMenu::item:disabled { color: palette(placeholder-text); }
QMenu::separator { height: 1px; background: palette(mid); margin: 4px 8px; }
QMenuBar { background: palette(window); }
QMenuBar::item:selected { background: palette(midlight); }
QProgressBar { background: palette(base); border: 0; border-radius: 2px; max-height: 4px; }
QProgressBar::chunk { background: palette(highlight); border-radius: 2px; }
QSlider { min-height: 32px; }
QSlider::groove:horizontal { height: 4px; background: palette(mid); border-radius: 2px; }
QSlider::sub-page:horizontal { background: palette(highlight); border-radius: 2px; }
QSlider::sub-page:horizontal:disabled { background: palette(mid); }
QSlider::handle:horizontal { background: palette(link-visited); border: 1px solid palette(mid);
    width: 16px; height: 16px; margin: -7px 0; border-radius: 9px; }
QSlider::handle:horizontal:hover, QSlider::handle:horizontal:focus {
    border: 2px solid palette(highlight); width: 14px; height: 14px; }
QSlider::handle:horizontal:disabled { background: palette(alternate-base); }
QScrollBar:vertical { background: transparent; width: 10px; margin: 0; }
QScrollBar:horizontal { background: transparent; height: 10px; margin: 0; }
QScrollBar::handle { background: palette(mid); border-radius: 4px; margin: 1px;
    min-height: 24px; min-width: 24px; }
QScrollBar::handle:hover { background: palette(placeholder-text); }
QScrollBar::add-line, QScrollBar::sub-line { width: 0; height: 0; }
QScrollBar::add-page, QScrollBar::sub-page { background: transparent; }
"""


def _mixed(first: str, second: str, share: float) -> str:
    a, b = QColor(first), QColor(second)
    return QColor.fromRgbF(
        a.redF() + (b.redF() - a.redF()) * share,
        a.greenF() + (b.greenF() - a.greenF()) * share,
        a.blueF() + (b.blueF() - a.blueF()) * share,
    ).name()


def palette(theme: Theme) -> QPalette:
    """Return the Qt palette of `theme`."""
    colours = QPalette()
    role = QPalette.ColorRole
    for which, colour in (
        (role.Window, theme.window),
        (role.WindowText, theme.text),
        (role.Base, theme.field),
        (role.AlternateBase, theme.panel),
        (role.Text, theme.text),
        (role.PlaceholderText, theme.faint),
        (role.Button, theme.panel),
        (role.ButtonText, theme.text),
        (role.BrightText, theme.accent_text),
        (role.ToolTipBase, theme.panel),
        (role.ToolTipText, theme.text),
        (role.Highlight, theme.accent),
        (role.HighlightedText, theme.accent_text),
        (role.Link, theme.accent),
        # Nothing shows visited links: the handles of sliders are drawn in their colour.
        (role.LinkVisited, _mixed(theme.panel, "#ffffff", 0.75 if theme.name == "dark" else 1.0)),
        (role.Light, _mixed(theme.panel, "#ffffff", 0.12)),
        (role.Midlight, _mixed(theme.panel, theme.text, 0.10)),
        (role.Mid, theme.border),
        (role.Dark, _mixed(theme.border, "#000000", 0.3)),
        (role.Shadow, "#000000"),
        (role.Accent, theme.accent),
    ):
        colours.setColor(which, QColor(colour))
    for which in (role.Text, role.WindowText, role.ButtonText):
        colours.setColor(
            QPalette.ColorGroup.Disabled, which, QColor(_mixed(theme.faint, theme.panel, 0.35))
        )
    return colours


class Appearance(QObject):
    """The application's theme: "dark", "light", or "system" to follow the desktop.

    Signals
    -------
    changed : the `Theme` that holds from now on.
    """

    changed = Signal(object)

    def __init__(self, application: QApplication, choice: str = "system") -> None:
        super().__init__(application)
        self._application = application
        self._choice = choice
        self.theme = DARK
        self._restyle = Restyle(application)
        application.setStyle(QStyleFactory.create("Fusion"))
        QDir.setSearchPaths("look", [str(Path(__file__).parent)])
        application.setStyleSheet(_SHEET)
        application.styleHints().colorSchemeChanged.connect(self._system_changed)
        self.choose(choice)

    @property
    def choice(self) -> str:
        """What was asked for: "dark", "light" or "system"."""
        return self._choice

    @property
    def restyling(self) -> bool:
        """Whether the window is still taking the theme, and shows the one before."""
        return self._restyle.under_way

    def choose(self, choice: str) -> Theme:
        """Take a theme by name, or "system"; return the theme that results."""
        self._choice = choice
        self.theme = self._resolved(choice)
        # setColorScheme() does nothing on plain xcb: the palette carries the theme.
        self._application.setPalette(palette(self.theme))
        self.changed.emit(self.theme)
        self._restyle.begin()
        return self.theme

    def _resolved(self, choice: str) -> Theme:
        if choice == "light":
            return LIGHT
        if choice == "dark":
            return DARK
        scheme = self._application.styleHints().colorScheme()
        return LIGHT if scheme == Qt.ColorScheme.Light else DARK

    def _system_changed(self) -> None:
        if self._choice == "system":
            self.choose("system")
