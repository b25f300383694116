"""The picture as a file: at any size, with many samples, on the gradient or on nothing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderer

LARGEST = 8192
_SAMPLES = 8


def rendered(
    window: Any,
    renderer: vtkRenderer,
    size: tuple[int, int],
    transparent: bool,
) -> NDArray[np.uint8]:
    """Render into the window's own buffer at another size; return (h, w, 4) RGBA, row 0 on top.

    What the window shows is in the picture: one that is narrower for its height is seen from
    farther, one that is wider shows more at its sides.

    The window's buffer is not what is on screen (Qt copies from it), so that nothing flickers.
    """
    width, height = (min(max(1, int(s)), LARGEST) for s in size)
    before = (
        window.GetSize(),
        window.GetMultiSamples(),
        renderer.GetUseFXAA(),
        renderer.GetGradientBackground(),
        window.GetSwapBuffers(),
    )
    window.MakeCurrent()
    window.SetAlphaBitPlanes(1)
    window.SwapBuffersOff()  # this frame is not for the screen
    window.SetMultiSamples(_SAMPLES)
    window.SetSize(width, height)
    renderer.SetUseFXAA(False)
    if transparent:
        renderer.SetGradientBackground(False)
        renderer.SetBackgroundAlpha(0.0)
    else:
        renderer.SetBackgroundAlpha(1.0)
    wide, high = before[0]
    camera, out = renderer.GetActiveCamera(), max(1.0, (wide / max(high, 1)) / (width / height))
    seen = camera.GetViewAngle(), camera.GetParallelScale()
    camera.SetViewAngle(2 * math.degrees(math.atan(out * math.tan(math.radians(seen[0] / 2)))))
    camera.SetParallelScale(out * seen[1])
    interactor = window.GetInteractor()
    interactor.EnableRenderOn()
    try:
        window.Render()
        pixels = vtkUnsignedCharArray()
        window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
        return vtk_to_numpy(pixels).reshape(height, width, 4)[::-1].copy()
    finally:
        interactor.EnableRenderOff()
        camera.SetViewAngle(seen[0])
        camera.SetParallelScale(seen[1])
        window.SetSize(*before[0])
        window.SetMultiSamples(before[1])
        renderer.SetUseFXAA(before[2])
        renderer.SetGradientBackground(before[3])
        renderer.SetBackgroundAlpha(1.0)
        window.SetSwapBuffers(before[4])


def as_image(pixels: NDArray[np.uint8], transparent: bool) -> QImage:
    """Return RGBA pixels (h, w, 4) as a QImage of its own memory."""
    height, width, _ = pixels.shape
    if not transparent:
        pixels = pixels.copy()
        pixels[..., 3] = 255
    # VTK blends onto nothing: its colours are already multiplied by their alpha.
    kind = QImage.Format.Format_RGBA8888_Premultiplied
    image = QImage(pixels.tobytes(), width, height, 4 * width, kind).copy()
    return image.convertToFormat(QImage.Format.Format_RGBA8888)
