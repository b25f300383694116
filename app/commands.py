"""What can be done in the window, as the rows of the table of actions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QSettings

from app.actions import Action, with_document, with_region
from engine import Document

if TYPE_CHECKING:
    from app.window import Window

LEVEL_STEP = 0.02


def commands(window: Window) -> list[Action]:
    """Return every action of `window`, in the order of its menus."""
    return [
        *_file(window),
        *_edit(window),
        *_level(window),
        *_tools(window),
        *_view(window),
        *_help(window),
    ]


def _file(window: Window) -> list[Action]:
    menu = "File"

    def restore() -> None:
        if window.safety is not None:
            window.safety.restore_set_aside()

    return [
        Action("file.open", "Open…", window.ask_open, ("Ctrl+O",), "mdi6.folder-open-outline",
               menu=menu),
        Action("file.save", "Save", window.documents.save, ("Ctrl+S",), "mdi6.content-save-outline",
               with_document, menu),
        Action("file.save_as", "Save as…", window.documents.save_as, ("Ctrl+Shift+S",), "",
               with_document, menu),
        Action("file.restore", "Restore unsaved work…", restore, (), "mdi6.history",
               lambda _document: window.safety is not None, menu),
        Action("file.export", "Export mesh…", window.ask_export, ("Ctrl+E",), "mdi6.export",
               with_document, menu),
        Action("file.recipe", "Save recipe…", window.ask_recipe, (), "mdi6.script-text-outline",
               with_document, menu),
        Action("file.quit", "Quit", window.close, ("Ctrl+Q",), menu=menu),
    ]  # fmt: skip


def _edit(window: Window) -> list[Action]:
    menu, session = "Edit", window.session

    def can_undo(_document: Document | None) -> bool:
        return session.history is not None and session.history.can_undo

    def can_redo(_document: Document | None) -> bool:
        return session.history is not None and session.history.can_redo

    def can_apply(document: Document | None) -> bool:
        return document is not None and document.draft.edit() is not None

    return [
        Action("edit.undo", "Undo", session.undo, ("Ctrl+Z",), "mdi6.undo", can_undo, menu,
               repeats=True),
        Action("edit.redo", "Redo", session.redo, ("Ctrl+Shift+Z", "Ctrl+Y"), "mdi6.redo",
               can_redo, menu, repeats=True),
        Action("edit.apply", "Apply", window.toolhost.enter, ("Return", "Enter"), "mdi6.check",
               can_apply, menu),
        Action("edit.back", "One step back", window.escape, ("Esc",), "mdi6.arrow-left",
               with_document, menu),
    ]  # fmt: skip


def _level(window: Window) -> list[Action]:
    menu, session = "Level", window.session
    return [
        Action("level.less", "Less detail", lambda: window.nudge_level(-LEVEL_STEP), ("[",),
               "mdi6.minus", with_region, menu, repeats=True),
        Action("level.more", "More detail", lambda: window.nudge_level(LEVEL_STEP), ("]",),
               "mdi6.plus", with_region, menu, repeats=True),
        Action("level.base", "Base shape", lambda: session.slide_level(0.0), ("Shift+[", "{"),
               "", with_region, menu),
        Action("level.full", "Full detail", lambda: session.slide_level(1.0), ("Shift+]", "}"),
               "", with_region, menu),
    ]  # fmt: skip


def _tools(window: Window) -> list[Action]:
    host = window.toolhost

    def row(name: str) -> Action:
        tool = host.tools[name]
        return Action(
            f"tool.{name}",
            tool.title,
            lambda: host.choose(name),
            (tool.shortcut,) if tool.shortcut else (),
            tool.icon,
            lambda _document: host.available(name),
            "Tools",
            checked=lambda: host.active is tool,
        )

    return [row(name) for name in host.tools]


def _view(window: Window) -> list[Action]:
    menu, viewport = "View", window.viewport

    def frame() -> None:
        document = window.session.document
        viewport.frame(None if document is None else document.draft.roi)

    def theme(name: str) -> None:
        QSettings().setValue("look/theme", name)
        window.appearance.choose(name)
        window.refresh()

    return [
        Action("view.frame", "Frame the region or the model", frame, ("F",),
               "mdi6.fit-to-screen-outline", with_document, menu),
        Action("view.panels", "Hide panels", window.toggle_panels, ("Tab",), menu=menu,
               scope="canvas"),
        *(
            Action(f"view.theme.{name}", f"{name.capitalize()} colours",
                   lambda name=name: theme(name), menu=menu,
                   checked=lambda name=name: window.appearance.choice == name)
            for name in ("system", "dark", "light")
        ),
    ]  # fmt: skip


def _help(window: Window) -> list[Action]:
    menu = "Help"
    return [
        Action("help.palette", "Find a command…", lambda: window.palette_box.open(),
               ("Ctrl+Shift+P",), "mdi6.magnify", menu=menu),
    ]  # fmt: skip
