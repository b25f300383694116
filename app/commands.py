"""What can be done in the window, as the rows of the table of actions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QSettings

from app.actions import Action, with_document, with_region
from app.seeing import seeing
from app.symmetry import AXES, Axis
from app.viewport.shading import Display
from app.walk import walk
from engine import Document, Topology
from engine.arrays import I64
from engine.selection import grown, inverted, seen_through, shrunk, smoothed_border

if TYPE_CHECKING:
    from app.window import Window

LEVEL_STEP = 0.02
UNITS = (("mm", "a millimetre"), ("cm", "a centimetre"), ("m", "a metre"), ("in", "an inch"))


def commands(window: Window) -> list[Action]:
    """Return every action of `window`, in the order of its menus."""
    return without_clashes(
        [
            *_file(window),
            *_edit(window),
            *_level(window),
            *_region(window),
            *_tools(window),
            *_view(window),
            *_help(window),
        ]
    )


def without_clashes(actions: list[Action]) -> list[Action]:
    """Return the actions without the keys of tools that something else has already.

    Two owners would leave the key dead for both. A stranger's tool yields to the window's own keys
    and to the tools before it; the person can give it another key.
    """
    taken = {key for one in actions if not one.id.startswith("tool.") for key in one.shortcuts}
    free = []
    for action in actions:
        if action.id.startswith("tool."):
            own = tuple(key for key in action.shortcuts if key not in taken)
            taken.update(own)
            action = replace(action, shortcuts=own)
        free.append(action)
    return free


def _file(window: Window) -> list[Action]:
    menu, ask = "File", window.file_dialogs

    def unit_is(unit: str) -> bool:
        document = window.session.document
        return document is not None and document.unit == unit

    def restore() -> None:
        if window.safety is not None:
            window.safety.restore_set_aside()

    return [
        Action("file.open", "Open…", ask.open, ("Ctrl+O",), "mdi6.folder-open-outline",
               menu=menu),
        Action("file.save", "Save", window.documents.save, ("Ctrl+S",), "mdi6.content-save-outline",
               with_document, menu, apart=True),
        Action("file.save_as", "Save as…", window.documents.save_as, ("Ctrl+Shift+S",), "",
               with_document, menu),
        Action("file.restore", "Restore unsaved work…", restore, (), "mdi6.history",
               lambda _document: window.safety is not None, menu),
        Action("file.export", "Export mesh…", ask.export, ("Ctrl+E",), "mdi6.export",
               with_document, menu, apart=True),
        Action("file.recipe", "Save recipe…", ask.export_recipe, (), "mdi6.script-text-outline",
               with_document, menu),
        *(
            Action(f"file.unit.{unit}", f"One unit is {words}",
                   partial(window.session.set_unit, unit), enabled=with_document,
                   menu=f"{menu}/One unit is", checked=partial(unit_is, unit))
            for unit, words in UNITS
        ),
        Action("file.quit", "Quit", window.close, ("Ctrl+Q",), menu=menu, apart=True),
    ]  # fmt: skip


def _edit(window: Window) -> list[Action]:
    menu, session = "Edit", window.session

    def can_undo(_document: Document | None) -> bool:
        return session.history is not None and session.history.can_undo

    def can_redo(_document: Document | None) -> bool:
        return session.history is not None and session.history.can_redo

    def can_apply(_document: Document | None) -> bool:
        return window.key_hand.down or window.toolhost.can_enter()

    return [
        Action("edit.undo", "Undo", session.undo, ("Ctrl+Z",), "mdi6.undo", can_undo, menu,
               repeats=True),
        Action("edit.redo", "Redo", session.redo, ("Ctrl+Shift+Z", "Ctrl+Y"), "mdi6.redo",
               can_redo, menu, repeats=True),
        Action("edit.apply", "Apply", window.enter, ("Return", "Enter"), "mdi6.check",
               can_apply, menu),
        Action("edit.back", "One step back", window.escape, ("Esc",), "mdi6.arrow-left",
               with_document, menu),
        Action("edit.name", "Name this variant", window.name_variant, ("F2",), "mdi6.tag-outline",
               with_document, menu, apart=True),
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
    host, keys = window.toolhost, window.key_hand

    def row(name: str) -> Action:
        tool = host.toolbox.tools[name]
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

    def sized(_document: Document | None) -> bool:
        return host.circle.possible

    return [
        *(row(name) for name in host.toolbox.tools),
        Action("tools.keys", "Draw with the keys", keys.switch, ("K",), "", with_document,
               "Tools", checked=lambda: keys.on, apart=True),
        Action("tools.pen", "Pen pressure…", window.show_pen, (), "mdi6.pen", menu="Tools"),
        Action("size.smaller", "Smaller circle", lambda: host.circle.step(-1), (",",), "", sized,
               "Tools", repeats=True),
        Action("size.larger", "Larger circle", lambda: host.circle.step(1), (".",), "", sized,
               "Tools", repeats=True),
    ]  # fmt: skip


def _region(window: Window) -> list[Action]:
    menu, session, symmetry = "Region", window.session, window.symmetry

    def change(made: Callable[[Topology, I64], I64], label: str) -> Callable[[], None]:
        def do() -> None:
            document = session.document
            if document is not None and document.draft.roi is not None:
                roi = made(document.mesh.topology, document.draft.roi)
                session.choose_region(roi, label, curves_stay=True)

        return do

    def take_through() -> None:
        document = session.document
        if document is not None and document.draft.roi is not None:
            roi = seen_through(document.mesh, document.draft.roi, window.viewport.view())
            session.choose_region(roi, "Region through the form", curves_stay=True)

    def take_view() -> None:
        view = window.viewport
        corners = np.array([(0, 0), (view.width(), 0), (view.width(), view.height()),
                            (0, view.height())], dtype=float)  # fmt: skip
        session.choose_region(view.vertices_inside(corners), "Region in view")

    def keep() -> None:
        document = session.document
        if document is not None and document.draft.roi is not None:
            suggestion = f"Region {len(document.regions) + 1}"
            window.ask.ask("Keep this region as", suggestion, session.keep_region)

    def mirrored() -> bool:
        document = session.document
        return document is not None and bool(document.draft.options.mirror)

    def mirror(axis: Axis) -> None:
        symmetry.choose("off" if mirrors(axis) else axis)

    def mirrors(axis: Axis) -> bool:
        return symmetry.which == axis

    return [
        Action("region.grow", "Grow", change(grown, "Region grown"), ("Ctrl++", "Ctrl+="),
               "mdi6.arrow-expand-all", with_region, menu, repeats=True),
        Action("region.shrink", "Shrink", change(shrunk, "Region shrunk"), ("Ctrl+-",),
               "mdi6.arrow-collapse-all", with_region, menu, repeats=True),
        Action("region.smooth", "Smooth the border", change(smoothed_border, "Border smoothed"),
               (), "mdi6.vector-circle", with_region, menu),
        Action("region.through", "Take the back as well", take_through, ("Shift+L",),
               "mdi6.arrow-expand-horizontal", with_region, menu),
        Action("region.view", "All that is in view", take_view, (), "mdi6.image-frame",
               with_document, menu),
        Action("region.invert", "Invert", change(inverted, "Region inverted"), ("Ctrl+I",),
               "mdi6.invert-colors", with_region, menu),
        Action("region.symmetry", "Edit symmetrically",
               lambda: symmetry.choose("off" if mirrored() else "found"),
               ("Y",), "mdi6.reflect-horizontal", with_document, menu, checked=mirrored,
               apart=True),
        *(
            Action(f"region.mirror.{axis}", f"Mirror across {axis.upper()} through the middle",
                   partial(mirror, axis), enabled=with_document, menu=menu,
                   checked=partial(mirrors, axis))
            for axis in AXES
        ),
        Action("region.keep", "Keep this region…", keep, (), "mdi6.bookmark-outline", with_region,
               menu, apart=True),
    ]  # fmt: skip


def _view(window: Window) -> list[Action]:
    menu, viewport, pictures = "View", window.viewport, window.picture_files

    def frame() -> None:
        document = window.session.document
        viewport.frame(None if document is None else document.draft.roi)

    def theme(name: str) -> None:
        QSettings().setValue("look/theme", name)
        window.appearance.choose(name)
        window.refresh()

    def is_theme(name: str) -> bool:
        return window.appearance.choice == name

    def flip_display(name: Display) -> None:
        viewport.set_display("clay" if viewport.display == name else name)
        window.refresh()

    def standard(name: str, keys: str) -> Action:
        title = "Three-quarter" if name == "three-quarter" else f"From the {name}"
        return Action(f"view.{name}", title, lambda: viewport.standard_view(name),
                      (keys,) if keys else (), "", with_document,
                      f"{menu}/Standard views")  # fmt: skip

    def display(name: Display, title: str, keys: str) -> Action:
        return Action(f"view.{name}", title, lambda: flip_display(name), (keys,), "",
                      with_document, menu, checked=lambda: viewport.display == name,
                      apart=name == "zebra")  # fmt: skip

    def flip(set_: Callable[[bool], object], now: Callable[[], bool]) -> Callable[[], None]:
        def do() -> None:
            set_(not now())
            window.refresh()

        return do

    return [
        Action("view.frame", "Frame the region or the model", frame, ("F",),
               "mdi6.fit-to-screen-outline", with_document, menu),
        *(standard(*row) for row in (("three-quarter", "0"), ("front", "1"), ("right", "3"),
                                     ("top", "7"), ("back", ""), ("left", ""), ("bottom", ""))),
        Action("view.perspective", "Perspective",
               flip(viewport.set_perspective, lambda: viewport.perspective), ("5",), "",
               with_document, menu, checked=lambda: viewport.perspective),
        Action("view.up", "Y axis is up",
               lambda: window.set_up_axis("z" if window.up_axis == "y" else "y"), ("U",), "",
               with_document, menu, checked=lambda: window.up_axis == "y"),
        display("zebra", "Zebra stripes", "Z"),
        display("reflection", "Reflection lines", "X"),
        display("curvature", "Mean curvature", "C"),
        display("deviation", "Deviation from the original", "D"),
        Action("view.wireframe", "Wireframe",
               flip(viewport.set_wireframe, lambda: viewport.wireframe), ("W",), "", with_document,
               menu, checked=lambda: viewport.wireframe),
        *seeing(window),
        Action("view.turntable", "Turntable",
               flip(viewport.set_turntable, lambda: viewport.turntable), (), "mdi6.rotate-360",
               with_document, menu, checked=lambda: viewport.turntable, apart=True),
        Action("view.picture", "Save a picture…", pictures.ask_save, (), "mdi6.camera-outline",
               with_document, menu),
        Action("view.turntable_file", "Save a turntable…", window.turntable_file.ask, (),
               "mdi6.movie-open-outline", with_document, menu),
        Action("view.backdrop", "Picture to trace…", pictures.ask_trace, (), "mdi6.image-outline",
               with_document, menu),
        Action("view.panels", "Hide panels", window.toggle_panels, ("Tab",), menu=menu,
               scope="canvas", apart=True),
        Action("view.next", "To the next part of the window", lambda: walk(window, 1), ("F6",),
               menu=menu),
        Action("view.previous", "To the part before", lambda: walk(window, -1), ("Shift+F6",),
               menu=menu),
        *(
            Action(f"view.theme.{name}", f"{name.capitalize()} colours",
                   partial(theme, name), menu=f"{menu}/Colours", checked=partial(is_theme, name))
            for name in ("system", "dark", "light")
        ),
    ]  # fmt: skip


def _help(window: Window) -> list[Action]:
    menu = "Help"
    return [
        Action("help.palette", "Find a command…", lambda: window.palette_box.open(),
               ("Ctrl+Shift+P",), "mdi6.magnify", menu=menu),
        Action("help.keys", "Keys", window.show_keys, ("F1",), "mdi6.keyboard-outline", menu=menu),
        Action("help.plugins", "Plugins", window.show_plugins, (), "mdi6.puzzle-outline",
               menu=menu),
    ]  # fmt: skip
