"""Menus: the menu bar made from the table of actions, and the lists of what can be chosen again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMainWindow, QMenu

from app.actions import Actions
from app.files import Files
from app.recent import recent
from app.session import Session
from app.viewport import Viewport
from engine.arrays import I64
from engine.files.report import shown
from engine.view import View


class Menus(QObject):
    """Fills the menu bar of a window.

    Attributes
    ----------
    recent, regions, views : menus that are filled when they are opened.
    """

    def __init__(
        self,
        window: QMainWindow,
        actions: Actions,
        session: Session,
        files: Files,
        viewport: Viewport,
    ) -> None:
        super().__init__(window)
        self._window = window
        self._actions = actions
        self._session = session
        self._files = files
        self._viewport = viewport
        self._menus: dict[str, QMenu] = {}
        self.recent = QMenu("Open recent", window)
        self.recent.setToolTipsVisible(True)
        self.recent.aboutToShow.connect(self._fill_recent)
        self.regions = QMenu("Kept regions", window)
        self.regions.aboutToShow.connect(self._fill_regions)
        self.views = QMenu("Kept views", window)
        self.views.aboutToShow.connect(self._fill_views)
        self._fill_bar()

    def _fill_bar(self) -> None:
        lists = {"file.open": self.recent, "region.keep": self.regions, "view.keep": self.views}
        for name, action in self._actions.table.items():
            if not action.menu:
                continue
            menu = self._menu(action.menu)
            if action.apart:
                menu.addSeparator()
            menu.addAction(self._actions.qt[name])
            if name in lists:
                menu.addMenu(lists[name])

    def _menu(self, path: str) -> QMenu:
        """Return the menu of a path like "File" or "File/One unit is", made when it is new."""
        if path not in self._menus:
            above, _, title = path.rpartition("/")
            home = self._menu(above) if above else self._window.menuBar()
            menu = self._menus[path] = home.addMenu(title if above else f"&{title}")
            # A switch may have turned itself off: the turntable does when a hand takes the form.
            menu.aboutToShow.connect(lambda: self._actions.refresh(self._session.document))
        return self._menus[path]

    def _fill_recent(self) -> None:
        self.recent.clear()
        for path in recent():
            action = self.recent.addAction(shown(path.name), self._open(path))
            action.setToolTip(shown(str(path)))
        self.recent.setEnabled(bool(self.recent.actions()))

    def _fill_regions(self) -> None:
        self.regions.clear()
        document = self._session.document
        kept = {} if document is None else document.regions
        for name, roi in kept.items():
            menu = self.regions.addMenu(f"{name}, {len(roi):,} vertices")
            menu.addAction("Choose", self._choose_region(name, roi))
            menu.addAction("Forget", self._forget_region(name))
        if not kept:
            self.regions.addAction("None yet").setEnabled(False)

    def _fill_views(self) -> None:
        self.views.clear()
        document = self._session.document
        kept = {} if document is None else document.views
        for name, view in kept.items():
            menu = self.views.addMenu(name)
            menu.addAction("Look from here", self._recall(view))
            menu.addAction("Forget", self._forget_view(name))
        if not kept:
            self.views.addAction("None yet").setEnabled(False)

    # What an entry does. PySide would fill a free argument of it with whether it is checked.

    def _open(self, path: Path) -> Callable[[], object]:
        return lambda: self._files.open(path)

    def _choose_region(self, name: str, roi: I64) -> Callable[[], object]:
        return lambda: self._session.choose_region(roi, name)

    def _forget_region(self, name: str) -> Callable[[], object]:
        return lambda: self._session.keep_region(name, forget=True)

    def _recall(self, view: View) -> Callable[[], object]:
        return lambda: self._viewport.recall(view)

    def _forget_view(self, name: str) -> Callable[[], object]:
        return lambda: self._session.forget_view(name)
