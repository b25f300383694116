"""Canvas: OpenGL in the window, rendered once for each frame that Qt paints."""

from __future__ import annotations

import time
from typing import Any

from PySide6.QtCore import QSize
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget
from pyvistaqt import QtInteractor

from app.look import DARK, Theme
from app.viewport.picture import as_image, rendered
from app.viewport.scene import Scene

_SAMPLES = 8


class Canvas(QtInteractor):
    """The scene on screen, at the cost that this machine's OpenGL allows.

    Attributes
    ----------
    scene : all that is drawn.
    renders : frames so far.
    frame_ms : what the last one took.
    render_window : VTK's own window; it is there until this one is closed.
    """

    render_window: Any

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, auto_update=False, multi_samples=0, lighting="none")
        # VTK renders when Qt paints, and never else: one render for each frame.
        interactor = self.render_window.GetInteractor()
        interactor.EnableRenderOff()
        interactor.AddObserver("RenderEvent", self._render_wanted)
        self.disable_picking()  # type: ignore[call-arg]  # pyvista hides that it is a method
        self.renders = 0
        self.frame_ms = 0.0
        self._full_frame_ms = 0.0
        self._software: bool | None = None
        self._only_show = False
        self.scene = Scene(self.renderer, theme)

    def _render_wanted(self, *_: Any) -> None:
        if not self._in_paint:
            self.update()

    def render(self, *_: Any, **__: Any) -> None:
        """Ask for a frame; whoever asks ten times before it comes gets one."""
        self._rendered = True
        self.update()

    def paintGL(self) -> None:
        """Render the scene, once; or show what was rendered into the window's buffer before."""
        window = self._RenderWindow
        interactor = window.GetInteractor() if window is not None else None
        if interactor is not None and not self._only_show:
            interactor.EnableRenderOn()
        begin = time.perf_counter()
        try:
            super().paintGL()
        finally:
            if interactor is not None:
                interactor.EnableRenderOff()
        self.renders += 1
        self.frame_ms = 1e3 * (time.perf_counter() - begin)
        if self.scene.surface is not None and self.scene.surface.actor.GetVisibility():
            self._full_frame_ms = self.frame_ms

    def initializeGL(self) -> None:
        """Prepare OpenGL: many samples on a graphics card, a cheap filter on a processor."""
        super().initializeGL()
        name = str(self.context().functions().glGetString(0x1F01) or "").lower()
        self._software = any(word in name for word in ("llvmpipe", "softpipe", "swrast"))
        self.render_window.SetMultiSamples(0 if self._software else _SAMPLES)
        self.renderer.SetUseFXAA(self._software)

    def resizeGL(self, width: int, height: int) -> None:
        """Follow the widget's size."""
        super().resizeGL(width, height)
        # pyvistaqt 0.13 rounds half a pixel to even where Qt rounds up: a dark line would stay.
        interactor = self.render_window.GetInteractor()
        if interactor is not None and self.render_window.GetSize() != self.device_size():
            interactor.UpdateSize(*self.device_size())
        self.scene.scale = self.devicePixelRatioF()

    @property
    def software(self) -> bool:
        """Whether OpenGL runs on the processor; known once the window has been shown."""
        return bool(self._software)

    def device_size(self) -> tuple[int, int]:
        """Width and height in device pixels, as VTK renders."""
        ratio = self.devicePixelRatioF()
        return max(1, int(self.width() * ratio + 0.5)), max(1, int(self.height() * ratio + 0.5))

    def view_height(self) -> float:
        """Height of the view in logical pixels."""
        return self.device_size()[1] / self.devicePixelRatioF()

    @property
    def occlusion_available(self) -> bool:
        """Whether soft shadows in grooves are affordable: on a graphics card only."""
        return self._software is False

    def set_occlusion(self, wanted: bool) -> bool:
        """Darken grooves by ambient occlusion; return whether it is on now."""
        on = wanted and self.occlusion_available
        self.renderer.SetUseSSAO(on)
        self.renderer.SetSSAORadius(6.0)
        self.renderer.SetSSAOBias(0.15)
        self.renderer.SetSSAOKernelSize(64)
        self.renderer.SetSSAOBlur(True)
        # Its passes know no multisampling: edges are smoothed by the filter instead.
        self.render_window.SetMultiSamples(0 if on or self._software else _SAMPLES)
        self.renderer.SetUseFXAA(self._filtered)
        self.scene.set_theme(self.scene.theme)
        self.update()
        return on

    @property
    def _filtered(self) -> bool:
        """Whether edges are smoothed by a filter over the picture, at rest."""
        return self.software or bool(self.renderer.GetUseSSAO())

    def render_image(self, size: tuple[int, int], transparent: bool = False) -> QImage:
        """Return the form as a picture of `size` device pixels, smooth, without ink over it.

        Parameters
        ----------
        transparent : on nothing instead of the gradient.
        """
        self._ensure_initialized()
        with self.scene.whole():
            pixels = rendered(self.render_window, self.renderer, size, transparent)
        self.update()
        return as_image(pixels, transparent)

    def sizeHint(self) -> QSize:
        """A canvas wants room."""
        return QSize(960, 720)
