"""One table of actions: menus, shortcuts, buttons and the command palette are made from it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from PySide6.QtCore import QObject, QSettings, Qt, Signal
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QWidget

from app.look import Theme, icon
from engine import Document

NATIVE = QKeySequence.SequenceFormat.NativeText

Enabled = Callable[[Document | None], bool]


def always(_document: Document | None) -> bool:
    """For what can be done at any time."""
    return True


def with_document(document: Document | None) -> bool:
    """For what needs an open mesh."""
    return document is not None


def with_region(document: Document | None) -> bool:
    """For what needs a region."""
    return document is not None and document.draft.roi is not None


@dataclass(frozen=True)
class Action:
    """Something the person can do.

    Parameters
    ----------
    id : unique and stable, "menu.name"; shortcuts are remapped under it.
    title : what menus and the palette show.
    shortcuts : key sequences, the first is shown.
    icon : Material Design icon, or "".
    callback : does it.
    enabled : whether it can be done on a document.
    menu : title of the menu it stands in, "Menu/Menu in it", or "" for none.
    checked : for a switch: tells whether it is on.
    repeats : whether holding the key does it again and again.
    scope : "window", or "canvas" for keys that mean something else inside panels.
    apart : whether a line stands above it in its menu.
    """

    id: str
    title: str
    callback: Callable[[], object]
    shortcuts: tuple[str, ...] = ()
    icon: str = ""
    enabled: Enabled = always
    menu: str = ""
    checked: Callable[[], bool] | None = None
    repeats: bool = False
    scope: str = "window"
    apart: bool = False

    @property
    def group(self) -> str:
        """Title of the menu in the menu bar that it is found in."""
        return self.menu.partition("/")[0]

    @property
    def row(self) -> str:
        """What its menu shows: a menu's own title is not said again in it."""
        rest = self.title.removeprefix(self.menu.rpartition("/")[2] + " ")
        return rest[:1].upper() + rest[1:]


class Actions(QObject):
    """The table: every action once, with the `QAction` made from it.

    Signals
    -------
    remapped : an action has other keys.
    """

    remapped = Signal()

    def __init__(self, window: QWidget, canvas: QWidget) -> None:
        super().__init__(window)
        self._window = window
        self._canvas = canvas
        self.table: dict[str, Action] = {}
        self.qt: dict[str, QAction] = {}

    def add(self, actions: Iterable[Action]) -> None:
        """Put actions into the table and make their keys work."""
        for action in actions:
            assert action.id not in self.table, action.id
            self.table[action.id] = action
            self.qt[action.id] = self._made(action)

    def trigger(self, name: str) -> None:
        """Do an action by its id, if it is enabled."""
        self.qt[name].trigger()

    def refresh(self, document: Document | None) -> None:
        """Enable what can be done on `document`, and set the switches."""
        for name, action in self.table.items():
            qt = self.qt[name]
            qt.setEnabled(action.enabled(document))
            if action.checked is not None:
                qt.setChecked(action.checked())

    def dress(self, theme: Theme) -> None:
        """Give every action its icon in the colours of `theme`."""
        for name, action in self.table.items():
            if action.icon:
                self.qt[name].setIcon(icon(action.icon, theme))

    def keys(self, name: str) -> tuple[str, ...]:
        """Key sequences of an action: the person's own, else those of the table."""
        own = QSettings().value(f"keys/{name}")
        if isinstance(own, str):
            return tuple(one for one in own.split(" ; ") if one)
        return self.table[name].shortcuts

    def remap(self, name: str, shortcuts: tuple[str, ...] | None) -> None:
        """Give an action other keys and remember them; None brings the table's back."""
        key = f"keys/{name}"
        if shortcuts is None:
            QSettings().remove(key)
        else:
            QSettings().setValue(key, " ; ".join(shortcuts))
        self._set_keys(name)
        self.remapped.emit()

    def key_shown(self, name: str) -> str:
        """The first key of an action as a person reads it, or ""."""
        return self.qt[name].shortcut().toString(NATIVE)

    def named(self, name: str) -> str:
        """What a sentence calls an action: its key, else its title; "" for no action."""
        if name not in self.table:
            return ""
        # Qt calls the large key Return; what is printed on it is Enter.
        return self.key_shown(name).replace("Return", "Enter") or self.table[name].title

    def owner_of(self, sequence: str) -> str | None:
        """Id of the action that a key sequence belongs to."""
        wanted = QKeySequence(sequence)
        for name in self.table:
            if any(QKeySequence(own) == wanted for own in self.keys(name)):
                return name
        return None

    def _made(self, action: Action) -> QAction:
        qt = QAction(action.row, self)
        qt.setObjectName(action.id)
        qt.setAutoRepeat(action.repeats)
        qt.setCheckable(action.checked is not None)
        # In a menu an icon would stand where the tick does.
        qt.setIconVisibleInMenu(action.checked is None)
        qt.triggered.connect(lambda _checked=False: action.callback())
        if action.scope == "canvas":
            qt.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            self._canvas.addAction(qt)
        else:
            self._window.addAction(qt)
        self.qt[action.id] = qt
        self._set_keys(action.id)
        return qt

    def _set_keys(self, name: str) -> None:
        keys = self.keys(name)
        qt, action = self.qt[name], self.table[name]
        qt.setShortcuts([QKeySequence(one) for one in keys])
        shown = QKeySequence(keys[0]).toString(NATIVE) if keys else ""
        title = action.title.rstrip("…")
        qt.setToolTip(f"{title} ({shown})" if keys else title)
