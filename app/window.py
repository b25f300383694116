"""The window: its parts, and who listens to whom. What happens is in the parts."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QByteArray, QEvent, QObject, QSettings, QSize, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QKeyEvent
from PySide6.QtWidgets import QApplication, QLineEdit, QMainWindow

from app.actions import Actions
from app.ask import Ask
from app.body import Body
from app.commands import commands
from app.compare import Compare
from app.documents import Documents
from app.file_dialogs import FileDialogs
from app.files import Files
from app.held_key import HeldKey
from app.hint import HintLine
from app.key_hand import KeyHand
from app.keys import Keys
from app.look import Appearance, Theme
from app.menus import Menus
from app.modes import ModesViewer
from app.opening_plate import OpeningPlate, form_seen
from app.palette import Palette
from app.panels.edit import EditPanel
from app.panels.level import LevelPanel
from app.panels.steps import StepsPanel
from app.panels.toolbar import ToolRail, ToolStrip
from app.pen_pressure import PenPressure, counted, remembered
from app.picture_files import PictureFiles
from app.plate import Plate
from app.plugin_list import PluginList, all_failures
from app.recent import remember
from app.region_wheel import RegionWheel
from app.safety import Safety
from app.session import Session
from app.stage import Stage
from app.start_level import StartLevel
from app.status import Status
from app.stripes_bar import StripesBar
from app.symmetry import Symmetry
from app.thumbnails import Thumbnails
from app.toolbox import Toolbox
from app.toolhost import ToolHost
from app.trace_bar import TraceBar
from app.turntable_file import TurntableFile
from app.viewport import Viewport
from app.welcome import Welcome
from engine import Document
from engine.files.report import shown
from plugins.registry import Failure, find_tools

FIRST_SIZE = QSize(1280, 860)
FRAME = QSize(16, 48)  # a desktop's title bar and edges; how large they are is known only later
Y_UP = (".obj", ".glb", ".gltf", ".dae")  # formats whose models mostly stand along y


def first_size(free: QSize) -> QSize:
    """Return how large the window opens the first time where a screen has so much room, in px."""
    return FIRST_SIZE.boundedTo(free - FRAME)


class Window(QMainWindow):
    """Tool rail on the left, the viewport in the middle, panels on the right."""

    def __init__(self, appearance: Appearance) -> None:
        super().__init__()
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setAcceptDrops(True)
        self.installEventFilter(self)
        self.appearance = appearance
        self.session = Session(self)
        self.files = Files(self.session, self)
        self.symmetry = Symmetry(self.session, lambda: self.toolhost.in_gesture)
        self.viewport = Viewport(self)
        found = find_tools()
        self.failures: tuple[Failure, ...] = found.failures
        self.toolbox = Toolbox(found.items, self)
        self.toolhost = ToolHost(self.session, self.viewport, self.toolbox, self)
        self.key_hand = KeyHand(self.viewport, self.toolhost, self)
        self.stage = Stage(self.session, self.viewport, self)
        self.region_wheel = RegionWheel(self.session, self.viewport, self)
        self.documents = Documents(self.session, self.files, self.viewport, self)
        self.safety: Safety | None = None
        self.actions_table = Actions(self, self.viewport)
        self.hint = HintLine(self.viewport, self.actions_table.named)
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
        self.ask = Ask(self, self.viewport)
        self.stripes_bar = StripesBar(self.viewport)
        self.plate = Plate(self.viewport, lambda: form_seen(self.session, self.viewport))
        StartLevel(self.session, lambda: self.toolhost.in_gesture, self)
        self.opening = OpeningPlate(self.session, self.files, self.plate)
        self._thumbnails = Thumbnails(self.session, self.stage, self.viewport, self.steps)
        self.file_dialogs = FileDialogs(self.session, self.files, self)
        self.picture_files = PictureFiles(self.session, self.viewport, self.trace_bar, self)
        self.turntable_file = TurntableFile(self.session, self.viewport, self)
        self._held_key = HeldKey(self.stage, self)
        self._keys: Keys | None = None
        panels = (self.level, self.edit, self.steps)
        self.body = Body(self.rail, self.strip, self.viewport, self.trace_bar, panels)
        self.setCentralWidget(self.body)
        self.setStatusBar(self.status)
        self.actions_table.add(commands(self))
        self.menus = Menus(self, self.actions_table, self.session, self.files, self.viewport)
        self.rail.name_keys(lambda name: self.actions_table.key_shown(f"tool.{name}"))
        self.palette_box = Palette(self.actions_table, self)
        self._name_keys()
        self._connect()
        self._dress(appearance.theme)
        self._take_pen(remembered())
        self.refresh()
        self.resize(first_size(self.screen().availableSize()))
        self.viewport.setFocus()  # keys mean the form until a part is given them
        self.strip.left.connect(self.viewport.setFocus)
        geometry = QSettings().value("window/geometry")
        if isinstance(geometry, QByteArray):
            self.restoreGeometry(geometry)

    # ---- wiring

    def _connect(self) -> None:
        session, host = self.session, self.toolhost
        # Work begins and ends several times in a stroke: one look at it afterwards is enough.
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self.refresh)
        session.document_changed.connect(self._keep_up)
        session.opened.connect(self._opened)
        session.problems.changed.connect(self.hint.set_problem)
        session.noticed.connect(self.hint.set_notice)
        session.told.connect(lambda text: self.hint.set_notice(text, done=False))
        session.busy_changed.connect(self._soon.start)
        host.tool_changed.connect(self._keep_up)
        self.key_hand.changed.connect(self._keep_up)
        host.gesture_changed.connect(self.symmetry.settle)
        host.gesture_changed.connect(self._gesture_changed)
        host.context.said.connect(self.hint.set_said)
        self.viewport.pointer.connect(host.pointer)
        self.viewport.cancelled.connect(host.cancel)
        self.viewport.selecting.connect(lambda on: self.hint.set_said("Selecting…" if on else ""))
        self.viewport.alt_scrolled.connect(self._level_by_wheel)
        self.viewport.rested.connect(self.plate.settle)
        self.status.size_asked.connect(self.opening.tell)
        self.edit.apply_asked.connect(self.enter)
        self.edit.plane_pointed.connect(self.stage.point_out_plane)
        self.steps.compare_asked.connect(self.compare_with)
        self.level.set_viewer(self.modes)
        self.modes.changed.connect(self.refresh)
        self.actions_table.remapped.connect(self._name_keys)
        self.hint.asked.connect(self.actions_table.trigger)
        self.documents.pictures = self.steps.pictures
        self.documents.saved.connect(self._saved)
        self.files.unpacked.connect(
            lambda archive: self.steps.take_pictures(dict(archive.pictures))
        )
        self.appearance.changed.connect(self._dress)

    def _dress(self, theme: Theme) -> None:
        self.viewport.set_theme(theme)
        if self.compare is not None:
            self.compare.dress(theme)
        self.actions_table.dress(theme)
        for part in (
            self.level,
            self.edit,
            self.steps,
            self.rail,
            self.body.shelf,
            self.status,
            self.hint,
            self.welcome,
        ):
            part.dress(theme)

    def _name_keys(self) -> None:
        """Let every part say the keys that actions have now."""
        for part in (self.level, self.edit):
            part.name_keys(self.actions_table.named)
        self.rail.refresh()
        self.hint.reread()

    # ---- keeping in step

    def _keep_up(self) -> None:
        self.session.turn.once(self.refresh)

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
        self.setWindowTitle(f"{shown(name)}[*] – Eigenform" if document else "Eigenform")

    def _hint(self, document: Document | None) -> str:
        if document is None:
            busy = self.session.jobs.busy("file")
            return "Opening…" if busy else "Open a mesh with {file.open}, or drop a file here"
        if self.session.applying:
            return "Putting the details back…"
        if self.modes.mode is not None:
            return "This is one building block alone; the waves in the panel show the form again"
        hint, keys = self.toolhost.hint(), self.key_hand.words()
        return keys if keys and self.key_hand.down else ". ".join(filter(None, (hint, keys)))

    def _opened(self) -> None:
        document = self.session.document
        self.end_compare()
        if document is not None:
            self.viewport.set_unit(document.unit)
            self.viewport.set_reference(document.original.vertices)
            suffix = Path(document.name).suffix.lower()
            self.set_up_axis("y" if suffix in Y_UP else "z")
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
            self._keep_up()

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
            self.body.put_beside(self.compare, self.compare.morph)
        self.compare.show_moment(history.moments[moment_id])

    def end_compare(self) -> None:
        """Show the current one alone."""
        if self.compare is not None:
            compare, self.compare = self.compare, None
            compare.end()
            compare.setParent(None)
            compare.deleteLater()

    # ---- what is asked for by keys and menus

    def show_keys(self) -> None:
        """Show every action with its keys."""
        if self._keys is None:
            self._keys = Keys(self.actions_table, self)
        self._keys.fill()
        self._keys.show()
        self._keys.raise_()

    def show_pen(self) -> None:
        """Show how hard the pen has to press, and let it be set."""
        dialog = PenPressure(self.appearance.theme, self)
        dialog.chosen.connect(self._take_pen)
        self.appearance.changed.connect(dialog.dress)
        dialog.show()

    def _take_pen(self, firmness: float) -> None:
        self.viewport.hands.counted = partial(counted, firmness=firmness)

    def show_plugins(self) -> None:
        """List what was found, what failed to load and why, and the person's own files."""
        PluginList(self.toolhost, all_failures(), self).show()

    def _gesture_changed(self) -> None:
        if self.toolhost.in_gesture:
            # What was said about the last stroke is no longer of use.
            self.hint.set_notice("")
        self._soon.start()

    def enter(self) -> None:
        """End the curve that keys draw, or apply what the tool in hand has to apply."""
        if self.key_hand.down:
            self.key_hand.end()
        else:
            self.toolhost.enter()

    def escape(self) -> None:
        """Close the gesture under way, or go one step back."""
        self.session.problems.clear()
        if not self.toolhost.cancel():
            self.session.step_back()

    def toggle_panels(self) -> None:
        """Hide or show everything but the form."""
        shown = self.body.side.isVisible()
        for part in (self.body.side, self.rail, self.strip, self.status, self.menuBar()):
            part.setVisible(not shown)

    def name_variant(self) -> None:
        """Let the current step be named in its row, wherever the panels are."""
        if not self.body.side.isVisible():
            self.toggle_panels()
        self.steps.unfold()
        self.steps.name_current()

    # ---- events

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Leave Enter and Esc to a line that is typed into: they take or leave what it says."""
        # A filter, not `event`: that one would run all that the window does inside of it.
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.ShortcutOverride:
            keys = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape)
            if event.key() in keys and isinstance(QApplication.focusWidget(), QLineEdit):
                event.accept()
                return True
        return super().eventFilter(watched, event)

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

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop the engine before the viewport goes."""
        self._soon.stop()
        self._held_key.stop()
        self.region_wheel.stop()
        self._thumbnails.stop()
        QSettings().setValue("window/geometry", self.saveGeometry())
        self.toolhost.cancel()
        self.toolbox.stop()
        self.end_compare()
        self.modes.stop()
        self.turntable_file.stop()
        self.stage.stop()
        self.session.close()
        self.viewport.close()
        super().closeEvent(event)
