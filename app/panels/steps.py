"""Steps panel: the tree of everything applied since opening, with thumbnails; variants by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from PySide6.QtCore import QBuffer, QEvent, QIODevice, QPoint, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QMenu,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from app.panels.panel import GRID, Panel
from app.session import Session
from engine import History, Moment

THUMBNAIL = QSize(64, 48)
ID = Qt.ItemDataRole.UserRole


@dataclass(frozen=True)
class Row:
    """One line of the tree: a moment, how deep it stands, and its words."""

    moment: int
    parent: int | None
    words: str
    resting: bool


def rows(history: History) -> list[Row]:
    """Return the moments worth showing, parents before children.

    These are the first one, every step applied, every moment with a name, and the current one.
    A chain without branches stands on one line each at the same depth; only branches indent.
    """
    moments = history.moments
    resting = {one for one, moment in moments.items() if _rests(history, moment)}
    shown = resting | {history.current_id}
    made: list[Row] = []
    for one in sorted(shown):
        moment = moments[one]
        parent = moment.parent
        while parent is not None and parent not in shown:
            parent = moments[parent].parent
        made.append(Row(one, parent, moment.name or moment.label, one in resting))
    return made


def _rests(history: History, moment: Moment) -> bool:
    """Whether a moment has a line of its own, also when it is not the current one."""
    if moment.parent is None or moment.name:
        return True
    return moment.document.recipe is not history.moments[moment.parent].document.recipe


class StepsPanel(Panel):
    """The tree of steps. A click goes there; going back and working on makes a branch.

    Signals
    -------
    compare_asked(id) : the person wants to see a moment beside the current one.
    """

    compare_asked = Signal(int)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__("Steps", parent)
        self._session = session
        self._icons: dict[int, QIcon] = {}
        self._pictures: dict[int, QPixmap] = {}
        self._shown: list[tuple[Row, QIcon | None]] = []
        self._items: dict[int, QTreeWidgetItem] = {}
        self.tree = QTreeWidget(self)
        self.tree.setAccessibleName("Steps and variants")
        self.tree.setHeaderHidden(True)
        self.tree.setIconSize(THUMBNAIL)
        self.tree.setIndentation(16)
        self.tree.setRootIsDecorated(False)
        self.tree.setMinimumHeight(2 * THUMBNAIL.height() + 8)
        self.tree.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.tree.header().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.tree.setEditTriggers(
            QAbstractItemView.EditTrigger.EditKeyPressed
            | QAbstractItemView.EditTrigger.SelectedClicked
        )
        self.tree.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.tree.customContextMenuRequested.connect(self._menu)
        self.tree.itemClicked.connect(lambda item, _column: self._go(item))
        self.tree.itemActivated.connect(lambda item, _column: self._go(item))
        self.tree.itemChanged.connect(self._renamed)
        self.name = QPushButton("Name this variant", self)
        self.name.setToolTip("Give the current step a name, to find it again and compare it")
        self.name.clicked.connect(self.name_current)
        self.compare = QPushButton("Compare…", self)
        self.compare.setToolTip("See another step beside this one")
        self.compare.clicked.connect(self._compare_menu)
        buttons = QHBoxLayout()
        buttons.setSpacing(GRID)
        buttons.addWidget(self.name, 1)
        buttons.addWidget(self.compare)
        self.body.addWidget(self.tree, 1)
        self.body.addLayout(buttons)
        session.opened.connect(self._icons.clear)
        session.opened.connect(self._pictures.clear)
        session.document_changed.connect(self._keep_up)

    # ---- thumbnails

    def wants_picture(self) -> bool:
        """Whether the current moment is shown here and has no thumbnail yet."""
        history = self._session.history
        if history is None or history.current_id in self._icons:
            return False
        return _rests(history, history.moments[history.current_id])

    def without_picture(self) -> list[int]:
        """Return the moments with a line of their own that have no thumbnail, but the current."""
        history = self._session.history
        if history is None:
            return []
        return [
            one
            for one, moment in history.moments.items()
            if one not in self._icons and one != history.current_id and _rests(history, moment)
        ]

    def set_picture(self, moment: int, picture: QPixmap) -> None:
        """Give a moment its thumbnail."""
        self._pictures[moment] = picture
        self._icons[moment] = _icon(picture)
        self.refresh()

    def pictures(self) -> dict[int, bytes]:
        """Return the thumbnails as PNG files, for the document file."""
        return {moment: _png(picture) for moment, picture in self._pictures.items()}

    def take_pictures(self, files: dict[int, bytes]) -> None:
        """Show thumbnails that came with a document file."""
        for moment, data in files.items():
            picture = QPixmap()
            if picture.loadFromData(data):
                self._pictures[moment] = picture
                self._icons[moment] = _icon(picture)
        self._keep_up()

    # ---- the tree

    def _keep_up(self) -> None:
        self._session.turn.once(self.refresh)

    def refresh(self) -> None:
        """Show the history as it is now."""
        history = self._session.history
        made = [] if history is None else rows(history)
        self.name.setEnabled(history is not None)
        self.compare.setEnabled(len(made) > 1)
        count = sum(1 for row in made if row.resting) - 1
        self.set_note(f"{count}" if count > 0 else "")
        shown = [(row, self._icons.get(row.moment)) for row in made]
        if shown != self._shown:
            self._shown = shown
            self._fill(made)
        current = None if history is None else self._items.get(history.current_id)
        if current is not None:
            with QSignalBlocker(self.tree):
                self.tree.setCurrentItem(current)
                self.tree.scrollToItem(current)

    def _fill(self, made: list[Row]) -> None:
        """Make the tree anew: it has other lines, words or pictures."""
        with QSignalBlocker(self.tree):
            self.tree.clear()
            items: dict[int, QTreeWidgetItem] = {}
            homes: dict[int, QTreeWidgetItem] = {}
            children: dict[int | None, int] = {}
            for row in made:
                children[row.parent] = children.get(row.parent, 0) + 1
            root = self.tree.invisibleRootItem()
            for row in made:
                home = root
                if row.parent is not None:
                    # Only where the way forks does the tree grow to the right.
                    forks = children[row.parent] > 1
                    home = items[row.parent] if forks else homes[row.parent]
                item = QTreeWidgetItem(home, [row.words])
                item.setData(0, ID, row.moment)
                item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
                icon = self._icons.get(row.moment)
                if icon is not None:
                    item.setIcon(0, icon)
                item.setSizeHint(0, QSize(0, THUMBNAIL.height() + 8 if icon else 32))
                tip = "Click to go here, F2 to name it, right-click for more"
                item.setToolTip(0, tip)
                items[row.moment], homes[row.moment] = item, home
            self.tree.expandAll()
        self._items = items

    def name_current(self) -> None:
        """Let the person type a name for the current moment."""
        item = self.tree.currentItem()
        if item is not None:
            self.tree.setFocus()
            self.tree.editItem(item, 0)

    def _go(self, item: QTreeWidgetItem) -> None:
        moment, history = int(item.data(0, ID)), self._session.history
        if history is not None and moment != history.current_id:
            self._session.go(moment)

    def _renamed(self, item: QTreeWidgetItem) -> None:
        history = self._session.history
        if history is not None:
            self._shown = []  # the line shows what was typed, whether it becomes the name or not
            self._session.rename(int(item.data(0, ID)), item.text(0).strip())
            self._keep_up()

    def _menu(self, at: QPoint) -> None:
        item, history = self.tree.itemAt(at), self._session.history
        if item is None or history is None:
            return
        moment = int(item.data(0, ID))
        menu = QMenu(self)
        menu.addAction("Go here", lambda: self._go(item))
        menu.addAction("Name…", lambda: self.tree.editItem(item, 0))
        compare = menu.addAction(
            "Compare with the current one", lambda: self.compare_asked.emit(moment)
        )
        compare.setEnabled(moment != history.current_id)
        menu.popup(self.tree.viewport().mapToGlobal(at))

    def _compare_menu(self) -> None:
        history = self._session.history
        if history is None:
            return
        menu = QMenu(self)
        for row in rows(history):
            if row.moment != history.current_id:
                action = menu.addAction(row.words, self._ask_to_compare(row.moment))
                icon = self._icons.get(row.moment)
                if icon is not None:
                    action.setIcon(icon)
        menu.setStyleSheet("QMenu { icon-size: 40px; }")
        menu.ensurePolished()
        # The button is at the foot of the window: below it there is no room.
        corner = QPoint(self.compare.width() - menu.sizeHint().width(), -menu.sizeHint().height())
        menu.popup(self.compare.mapToGlobal(corner))

    def _ask_to_compare(self, moment: int) -> Callable[[], None]:
        return lambda: self.compare_asked.emit(moment)

    def changeEvent(self, event: QEvent) -> None:
        """Rows are as high as the font asks for."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._shown = []
            self.refresh()


def _icon(picture: QPixmap) -> QIcon:
    """An icon that is not tinted when its row is selected."""
    icon = QIcon(picture)
    icon.addPixmap(picture, QIcon.Mode.Selected)
    return icon


def _png(picture: QPixmap) -> bytes:
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    picture.save(buffer, "PNG")
    return bytes(buffer.data().data())
