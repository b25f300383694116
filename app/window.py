"""The window: layout only. What happens is in the session, the tool host and the actions."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import psutil
from PySide6.QtCore import QByteArray, QEvent, QObject, QSettings, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QImage, QKeyEvent, QPixmap
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QApplication,
    QFileDialog,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QMainWindow,
    QMenu,
    QScrollArea,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from app.actions import Actions
from app.ask import Ask
from app.commands import commands
from app.compare import Compare
from app.documents import Documents
from app.files import Files
from app.hint import HintLine
from app.keys import Keys
from app.look import Appearance, Theme
from app.modes import ModesViewer
from app.palette import Palette
from app.panels.edit import EditPanel
from app.panels.level import LevelPanel
from app.panels.steps import THUMBNAIL, StepsPanel
from app.panels.toolbar import ToolRail, ToolStrip
from app.places import state_folder
from app.plate import Plate
from app.plugin_list import PluginList, all_failures
from app.safety import Safety
from app.seeing import (
    UNIT_WORDS,
    PictureDialog,
    TraceBar,
    likely_unit,
    picture_file,
    unit_question,
)
from app.session import Session
from app.stage import Stage
from app.status import Status
from app.symmetry import Symmetry
from app.toolbox import Toolbox
from app.toolhost import ToolHost
from app.viewport import Viewport
from app.welcome import Welcome
from engine import Document, ImportReport, start_worker
from plugins.registry import Failure, find_tools

PANEL_WIDTH = 304
FIRST_SIZE = (1280, 860)
RECENT = 8
Y_UP = (".obj", ".glb", ".gltf", ".dae")  # formats whose models mostly stand along y
OPENS = "Meshes and documents (*.eigenform *.obj *.ply *.stl *.off *.3mf);;All files (*)"
EXPORTS = "PLY, exact (*.ply);;Wavefront OBJ (*.obj);;STL (*.stl);;OFF (*.off);;3MF (*.3mf)"


class Window(QMainWindow):
    """Tool rail on the left, the viewport in the middle, panels on the right."""

    def __init__(self, appearance: Appearance) -> None:
        super().__init__()
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setAcceptDrops(True)
        self.appearance = appearance
        self.session = Session(self)
        self.files = Files(self.session, self)
        self.symmetry = Symmetry(self.session)
        self.viewport = Viewport(self)
        found = find_tools()
        self.failures: tuple[Failure, ...] = found.failures
        self.toolbox = Toolbox(found.items, self)
        self.toolhost = ToolHost(self.session, self.viewport, self.toolbox, self)
        self.stage = Stage(self.session, self.viewport, self)
        self.documents = Documents(self.session, self.files, self.viewport, self)
        self.safety: Safety | None = None
        self.actions_table = Actions(self, self.viewport)
        self.hint = HintLine(self.viewport)
        self.trace_bar = TraceBar(self.viewport)
        self.modes = ModesViewer(self.session, self.stage, self.viewport)
        self.compare: Compare | None = None
        self.welcome = Welcome(self.session, self.viewport)
        self.level = LevelPanel(self.session, self)
        self.edit = EditPanel(self.session, self.symmetry, self)
        self.steps = StepsPanel(self.session, self)
        self.rail = ToolRail(self.toolhost, self)
        self.strip = ToolStrip(self.toolhost, self)
        self.status = Status(self.session, self)
        self.ask = Ask(self)
        self.plate = Plate(self.viewport)
        self._keys: Keys | None = None
        self._lay_out()
        self.actions_table.add(commands(self))
        self._make_menus()
        self.rail.name_keys(lambda name: self.actions_table.key_shown(f"tool.{name}"))
        self.palette_box = Palette(self.actions_table, self)
        self._connect()
        self._dress(appearance.theme)
        self.refresh()
        self.resize(*FIRST_SIZE)
        geometry = QSettings().value("window/geometry")
        if isinstance(geometry, QByteArray):
            self.restoreGeometry(geometry)

    # ---- layout

    def _lay_out(self) -> None:
        column = QVBoxLayout()
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(self.level)
        column.addWidget(_rule())
        column.addWidget(self.edit)
        column.addWidget(_rule())
        column.addWidget(self.steps, 1)
        inside = QWidget()
        inside.setLayout(column)
        self.side = QScrollArea(self)
        self.side.setWidget(inside)
        self.side.setWidgetResizable(True)
        self.side.setFrameShape(QFrame.Shape.NoFrame)
        self.side.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.side.setFixedWidth(PANEL_WIDTH)
        middle = QVBoxLayout()
        middle.setContentsMargins(0, 0, 0, 0)
        middle.setSpacing(0)
        middle.addWidget(self.strip)
        self.split = QSplitter(Qt.Orientation.Horizontal, self)
        self.split.setChildrenCollapsible(False)
        self.split.addWidget(self.viewport)
        middle.addWidget(self.split, 1)
        row = QHBoxLayout()
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(self.rail)
        row.addLayout(middle, 1)
        row.addWidget(self.side)
        central = QWidget(self)
        central.setLayout(row)
        self.setCentralWidget(central)
        self.setStatusBar(self.status)

    def _make_menus(self) -> None:
        self.recent_menu = QMenu("Open recent", self)
        self.recent_menu.setToolTipsVisible(True)
        self.recent_menu.aboutToShow.connect(self._fill_recent)
        self.regions_menu = QMenu("Kept regions", self)
        self.regions_menu.aboutToShow.connect(self._fill_regions)
        self.views_menu = QMenu("Kept views", self)
        self.views_menu.aboutToShow.connect(self._fill_views)
        menus: dict[str, QMenu] = {}
        for name, action in self.actions_table.table.items():
            if not action.menu:
                continue
            menu = self._menu(menus, action.menu)
            if action.apart:
                menu.addSeparator()
            menu.addAction(self.actions_table.qt[name])
            if name == "file.open":
                menu.addMenu(self.recent_menu)
            elif name == "region.keep":
                menu.addMenu(self.regions_menu)
            elif name == "view.keep":
                menu.addMenu(self.views_menu)

    def _menu(self, menus: dict[str, QMenu], path: str) -> QMenu:
        """Return the menu of a path like "File" or "File/One unit is", made when it is new."""
        if path not in menus:
            above, _, title = path.rpartition("/")
            home = self._menu(menus, above) if above else self.menuBar()
            menus[path] = home.addMenu(title if above else f"&{title}")
            # A switch may have turned itself off: the turntable does when a hand takes the form.
            menus[path].aboutToShow.connect(self.refresh)
        return menus[path]

    def _connect(self) -> None:
        session, host = self.session, self.toolhost
        session.document_changed.connect(self.refresh)
        session.opened.connect(self._opened)
        session.problems.changed.connect(self.hint.set_problem)
        session.noticed.connect(self.hint.set_notice)
        self.files.imported.connect(self._show_report)
        self.files.heavy.connect(self._ask_heavy)
        session.busy_changed.connect(self.refresh)
        host.tool_changed.connect(self.refresh)
        host.gesture_changed.connect(self.refresh)
        host.context.said.connect(self.hint.set_said)
        self.viewport.pointer.connect(host.pointer)
        self.viewport.cancelled.connect(host.cancel)
        self.viewport.alt_scrolled.connect(self._level_by_wheel)
        self.edit.apply_asked.connect(host.enter)
        self.edit.plane_pointed.connect(self.stage.point_out_plane)
        self.steps.compare_asked.connect(self.compare_with)
        self.level.set_viewer(self.modes)
        self.modes.changed.connect(self.refresh)
        self.actions_table.remapped.connect(self.rail.refresh)
        self.stage.settled.connect(self._picture_soon)
        self.documents.pictures = self.steps.pictures
        self.documents.saved.connect(self._saved)
        self.files.unpacked.connect(
            lambda archive: self.steps.take_pictures(dict(archive.pictures))
        )
        self.appearance.changed.connect(self._dress)
        application = QApplication.instance()
        assert application is not None
        application.installEventFilter(self)

    def _dress(self, theme: Theme) -> None:
        self.viewport.set_theme(theme)
        if self.compare is not None:
            self.compare.viewport.set_theme(theme)
        self.actions_table.dress(theme)
        for part in (
            self.level,
            self.edit,
            self.steps,
            self.rail,
            self.status,
            self.hint,
            self.welcome,
        ):
            part.dress(theme)

    # ---- keeping in step

    def refresh(self) -> None:
        """Show what the session and the tool host say."""
        document = self.session.document
        self.actions_table.refresh(document)
        self.rail.refresh()
        self.strip.refresh()
        self.edit.set_ready(self.toolhost.can_enter())
        tool = self.toolhost.active
        self.viewport.set_tool_navigates(tool is not None and tool.navigates)
        self.hint.set_hint(self._hint(document))
        if document is not None and self.viewport.unit != document.unit:
            self.viewport.set_unit(document.unit)
        file = self.documents.path
        name = "" if document is None else document.name if file is None else file.name
        self.setWindowTitle(f"{name}[*] – Eigenform" if document else "Eigenform")

    def _hint(self, document: Document | None) -> str:
        if document is None:
            busy = self.session.jobs.busy("file")
            return "Opening…" if busy else "Open a mesh with Ctrl+O, or drop a file here"
        if self.session.applying:
            return "Putting the details back…"
        if self.modes.mode is not None:
            return "This is one building block alone; the waves in the panel show the form again"
        return self.toolhost.hint()

    def _picture_soon(self) -> None:
        if self.steps.wants_picture():
            QTimer.singleShot(0, self, self._take_picture)

    def _take_picture(self) -> None:
        """Keep a thumbnail of what is seen for the step that was just made."""
        history = self.session.history
        if history is None or self.stage.flowing or not self.steps.wants_picture():
            return
        seen = self.viewport.grabFramebuffer()
        shape = THUMBNAIL.scaled(seen.size(), Qt.AspectRatioMode.KeepAspectRatio)
        left, top = (seen.width() - shape.width()) // 2, (seen.height() - shape.height()) // 2
        middle = seen.copy(left, top, shape.width(), shape.height())
        ratio = self.devicePixelRatioF()
        picture = QPixmap.fromImage(
            middle.scaled(
                THUMBNAIL * ratio,
                Qt.AspectRatioMode.IgnoreAspectRatio,
                Qt.TransformationMode.SmoothTransformation,
            )
        )
        picture.setDevicePixelRatio(ratio)
        self.steps.set_picture(history.current_id, picture)

    def _opened(self) -> None:
        document = self.session.document
        self.plate.hide()
        self.end_compare()
        if document is not None:
            self.viewport.set_unit(document.unit)
            self.viewport.set_reference(document.original.vertices)
            suffix = Path(document.name).suffix.lower()
            self.set_up_axis("y" if suffix in Y_UP else "z")
            self._ask_unit()
        path = self.session.path
        if path is not None:
            remember(path)

    def _saved(self, path: Path) -> None:
        remember(path)
        self.refresh()

    def set_up_axis(self, axis: str) -> None:
        """Take "y" or "z" as upright, and frame the form again."""
        if self.up_axis != axis:
            self.viewport.set_up_axis(axis)
            self.viewport.frame(animate=False)
            self.refresh()

    @property
    def up_axis(self) -> str:
        """The axis that is upright on screen."""
        return {1: "y", 2: "z"}[self.viewport.eye.up]

    def _level_by_wheel(self, notches: float) -> None:
        self.nudge_level(0.02 * notches)

    def nudge_level(self, by: float) -> None:
        """Move the level by a share of its range."""
        document = self.session.document
        if document is not None:
            self.session.slide_level(document.draft.level + by)

    def keep_safe(self, folder: Path) -> None:
        """Keep a journal in `folder`, catch crashes, and offer what earlier runs left there."""
        self.safety = Safety(self, folder)
        self.safety.watch.start()
        self.safety.look_for_work()

    # ---- comparing

    def compare_with(self, moment_id: int) -> None:
        """Show a moment of the history beside the current one."""
        history = self.session.history
        if history is None or moment_id not in history.moments:
            return
        if self.compare is None:
            self.compare = Compare(self.session, self.viewport, self.appearance.theme, self)
            self.compare.closed.connect(self.end_compare)
            self.split.addWidget(self.compare)
            half = self.split.width() // 2
            self.split.setSizes([half, half])
        self.compare.show_moment(history.moments[moment_id])

    def end_compare(self) -> None:
        """Show the current one alone."""
        if self.compare is not None:
            compare, self.compare = self.compare, None
            compare.end()
            compare.setParent(None)
            compare.deleteLater()

    # ---- files

    def ask_open(self) -> None:
        """Let the person choose a file to open."""
        name, _ = QFileDialog.getOpenFileName(self, "Open", _folder(), OPENS)
        if name:
            self.files.open(Path(name))

    def ask_export(self) -> None:
        """Let the person choose where the mesh goes."""
        name, chosen = QFileDialog.getSaveFileName(self, "Export mesh", _folder(), EXPORTS)
        if name:
            path = Path(name)
            if not path.suffix:
                path = path.with_suffix("." + chosen.split("*.")[1].rstrip(")"))
            self.files.export(path)

    def ask_recipe(self) -> None:
        """Let the person choose where the recipe goes."""
        name, _ = QFileDialog.getSaveFileName(self, "Save recipe", _folder(), "Recipe (*.json)")
        if name:
            path = Path(name)
            self.files.export_recipe(path if path.suffix else path.with_suffix(".json"))

    def _fill_recent(self) -> None:
        self.recent_menu.clear()
        for path in recent():
            action = self.recent_menu.addAction(path.name)
            action.setToolTip(str(path))
            action.triggered.connect(lambda _checked=False, p=path: self.files.open(p))
        self.recent_menu.setEnabled(bool(self.recent_menu.actions()))

    def _fill_regions(self) -> None:
        self.regions_menu.clear()
        document = self.session.document
        kept = {} if document is None else document.regions
        for name, roi in kept.items():
            menu = self.regions_menu.addMenu(f"{name}, {len(roi):,} vertices")
            menu.addAction("Choose", lambda r=roi, n=name: self.session.choose_region(r, n))
            menu.addAction("Forget", lambda n=name: self.session.keep_region(n, forget=True))
        if not kept:
            self.regions_menu.addAction("None yet").setEnabled(False)

    def _fill_views(self) -> None:
        self.views_menu.clear()
        document = self.session.document
        kept = {} if document is None else document.views
        for name, view in kept.items():
            menu = self.views_menu.addMenu(name)
            menu.addAction("Look from here", lambda v=view: self.viewport.recall(v))
            menu.addAction("Forget", lambda n=name: self.session.forget_view(n))
        if not kept:
            self.views_menu.addAction("None yet").setEnabled(False)

    def ask_picture(self) -> None:
        """Let the person choose a picture's size and background, and where it goes."""
        dialog = PictureDialog(self.viewport, self)
        if dialog.exec() and (path := picture_file(self, _folder())) is not None:
            self.save_picture(path, dialog.size_in_pixels, dialog.transparent.isChecked())

    def save_picture(self, path: Path, size: tuple[int, int], transparent: bool = True) -> None:
        """Write a picture of the form of `size` pixels, on nothing or on the ground."""
        image = self.viewport.render_image(size, transparent)
        target = path if path.suffix else path.with_suffix(".png")
        if image.save(str(target)):
            self.session.noticed.emit(f"Picture saved to {target.name}")
        else:
            self.session.problems.say(f"{target.name} could not be written. Choose another folder.")

    def ask_backdrop(self) -> None:
        """Let the person choose a picture to trace; the same again takes it away."""
        if self.viewport.overlay.backdrop is not None:
            self.trace_bar.remove()
            return
        name, _ = QFileDialog.getOpenFileName(
            self, "Picture to trace", _folder(), "Pictures (*.png *.jpg *.jpeg *.bmp *.webp)"
        )
        if name:
            self.trace(Path(name))

    def trace(self, path: Path) -> None:
        """Lay the picture in a file over the form, to trace it."""
        image = QImage(str(path))
        if image.isNull():
            self.session.problems.say(f"{path.name} is not a picture. Choose a PNG or JPEG file.")
            return
        self.trace_bar.trace(image)

    def show_keys(self) -> None:
        """Show every action with its keys."""
        if self._keys is None:
            self._keys = Keys(self.actions_table, self)
        self._keys.fill()
        self._keys.show()
        self._keys.raise_()

    def show_plugins(self) -> None:
        """List what was found, what failed to load and why, and the person's own files."""
        PluginList(self.toolhost, all_failures(), self).show()

    def _ask_heavy(self, path: Path, clean: bool, needed: int) -> None:
        """Ask before a file is opened that takes much memory."""
        free = psutil.virtual_memory().available
        words = (
            f"It needs about {needed / 2**30:.1f} GiB of memory; {free / 2**30:.1f} GiB are free."
        )
        self.plate.say(
            f"Open {path.name}?",
            [words],
            {
                "Open": lambda: self.files.open(path, clean=clean, sure=True),
                "Leave it": lambda: None,
            },
        )

    def _show_report(self, report: ImportReport) -> None:
        """Say what was done to a file, and offer to take it as it is."""
        path = self.session.path
        buttons: dict[str, Callable[[], object]] = {}
        if report.repairs and path is not None:
            buttons["Open without repairs"] = lambda: self.files.open(path, clean=False)
        document = self.session.document
        doubtful = document is not None and likely_unit(document) is not None
        question = [unit_question(document)] if document is not None and doubtful else []
        buttons |= self._unit_buttons() if doubtful else {"Good": lambda: None}
        self.plate.say(f"Opened {report.name}", [*report.lines(), *question], buttons)

    def _ask_unit(self) -> None:
        """Ask what one unit is when the model would be oddly small or large."""
        document = self.session.document
        if document is not None and likely_unit(document) is not None:
            self.plate.say(
                f"Opened {document.name}", [unit_question(document)], self._unit_buttons()
            )

    def _unit_buttons(self) -> dict[str, Callable[[], object]]:
        return {
            words.capitalize(): lambda unit=unit: self.session.set_unit(unit)
            for unit, words in UNIT_WORDS.items()
        }

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take a dropped file."""
        if any(url.isLocalFile() for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the first file that was dropped."""
        files = [url.toLocalFile() for url in event.mimeData().urls() if url.isLocalFile()]
        if files:
            event.acceptProposedAction()
            self.files.open(Path(files[0]))

    # ---- keys that are held, and Escape

    def escape(self) -> None:
        """Close the gesture under way, or go one step back."""
        if not self.toolhost.cancel():
            self.session.step_back()

    def toggle_panels(self) -> None:
        """Hide or show everything but the form."""
        shown = self.side.isVisible()
        for part in (self.side, self.rail, self.strip, self.status, self.menuBar()):
            part.setVisible(not shown)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """B held shows the original, wherever the focus is outside a text."""
        if event.type() in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            assert isinstance(event, QKeyEvent)
            typing = isinstance(QApplication.focusWidget(), (QLineEdit, QAbstractSpinBox))
            if event.key() == Qt.Key.Key_B and not event.modifiers() and not typing:
                if self.isActiveWindow() and not event.isAutoRepeat():
                    self.stage.show_original(event.type() == QEvent.Type.KeyPress)
                return False
        elif event.type() == QEvent.Type.WindowDeactivate and watched is self:
            self.stage.show_original(False)
        return super().eventFilter(watched, event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop the engine before the viewport goes."""
        application = QApplication.instance()
        if application is not None:
            application.removeEventFilter(self)
        QSettings().setValue("window/geometry", self.saveGeometry())
        self.toolhost.cancel()
        self.toolbox.stop()
        self.end_compare()
        self.modes.stop()
        self.stage.stop()
        self.session.close()
        self.viewport.close()
        super().closeEvent(event)


def _rule() -> QFrame:
    rule = QFrame()
    rule.setFrameShape(QFrame.Shape.HLine)
    rule.setFrameShadow(QFrame.Shadow.Plain)
    rule.setFixedHeight(1)
    rule.setStyleSheet("color: palette(mid);")
    return rule


def recent() -> list[Path]:
    """Files opened lately that are still there, the latest first."""
    names = QSettings().value("files/recent", [])
    names = [names] if isinstance(names, str) else list(names or [])
    return [path for path in map(Path, names) if path.is_file()]


def remember(path: Path) -> None:
    """Put a file first among the recent ones."""
    resolved = path.resolve()
    others = [one for one in recent() if one != resolved]
    QSettings().setValue("files/recent", [str(p) for p in (resolved, *others)][:RECENT])


def _folder() -> str:
    files = recent()
    return str(files[0].parent if files else Path.home())


def application() -> QApplication:
    """Return the Qt application, made the way the viewport needs it."""
    existing = QApplication.instance()
    if isinstance(existing, QApplication):
        return existing
    # Every point that mouse and pen report is wanted: strokes are drawn with them.
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressTabletEvents, False)
    made = QApplication(sys.argv[:1])
    made.setApplicationName("Eigenform")
    made.setOrganizationName("Eigenform")
    return made


def main(path: Path | None = None) -> int:
    """Open the window on a file, or on the sample vase, and run until it is closed."""
    from resources import sample_path

    app = application()
    choice = QSettings().value("look/theme", "system")
    window = Window(Appearance(app, str(choice)))
    window.keep_safe(state_folder())
    start_worker()
    window.show()
    if path is None:
        window.session.opened.connect(window.welcome.begin, Qt.ConnectionType.SingleShotConnection)
    QTimer.singleShot(0, lambda: window.files.open(path or sample_path("vase")))
    return app.exec()
