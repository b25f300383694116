"""Which triangle is seen at every pixel, as a numpy image, from one render.

VTK's own hardware selector answers the same in four to five renders and rebuilds its buffers each
time; here the fragment shader writes the triangle's number as its colour. Where that cannot be, the
selector does it.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLHardwareSelector

_MOST = 1 << 24  # triangles that three bytes of colour can tell apart
_TAG = "//VTK::Picking::Impl"
_NUMBER_AS_COLOUR = """//VTK::Picking::Impl
  int seenId = gl_PrimitiveID + firstNumber;
  gl_FragData[0] = vec4(float(seenId & 255), float((seenId >> 8) & 255),
      float((seenId >> 16) & 255), 255.0) / 255.0;
"""
_ACTOR_PASS, _LOW_PASS, _HIGH_PASS = 0, 5, 6


def capture(window: Any, renderer: vtkRenderer, actor: vtkActor) -> NDArray[np.int32]:
    """Return the ids of the triangles of `actor` that are seen, (height, width), -1 for none.

    Row 0 is the bottom, as VTK counts. Nothing but `actor` takes part: other props neither hide it
    nor answer.
    """
    if actor.GetMapper().GetInput().GetNumberOfCells() >= _MOST:
        return captured_by_selector(window, renderer, actor)
    window.MakeCurrent()
    with alone(renderer, [actor]), bare(window, renderer), numbered(actor):
        interactor = window.GetInteractor()
        interactor.EnableRenderOn()
        window.Render()
        interactor.EnableRenderOff()
        return read(window)


def read(window: Any) -> NDArray[np.int32]:
    """Return the numbers (height, width) that were drawn as colours, -1 for none."""
    width, height = window.GetSize()
    pixels = vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
    seen = vtk_to_numpy(pixels).reshape(height, width, 4)
    ids = np.ascontiguousarray(seen).view("<i4")[..., 0] & (_MOST - 1)
    return np.where(seen[..., 3] == 255, ids, np.int32(-1))


@contextmanager
def alone(renderer: vtkRenderer, actors: Sequence[vtkActor]) -> Iterator[None]:
    """Show `actors` and nothing else."""
    others = []
    props: Any = renderer.GetViewProps()  # the last is None, of which VTK's stubs know nothing
    props.InitTraversal()
    while (prop := props.GetNextProp()) is not None:
        if prop not in actors and prop.GetVisibility():
            prop.VisibilityOff()
            others.append(prop)
    shown = [actor.GetVisibility() for actor in actors]
    for actor in actors:
        actor.VisibilityOn()
    try:
        yield
    finally:
        for actor, visible in zip(actors, shown, strict=True):
            actor.SetVisibility(visible)
        for prop in others:
            prop.VisibilityOn()


@contextmanager
def bare(window: Any, renderer: vtkRenderer) -> Iterator[None]:
    """Render onto nothing, mixing no neighbouring pixels, and not to the screen."""
    samples, swap = window.GetMultiSamples(), window.GetSwapBuffers()
    smooth, gradient = renderer.GetUseFXAA(), renderer.GetGradientBackground()
    occlusion = renderer.GetUseSSAO()
    window.SetMultiSamples(0)
    window.SwapBuffersOff()
    renderer.SetUseFXAA(False)
    renderer.SetUseSSAO(False)
    renderer.SetGradientBackground(False)
    renderer.SetBackgroundAlpha(0.0)
    try:
        yield
    finally:
        window.SetMultiSamples(samples)
        window.SetSwapBuffers(swap)
        renderer.SetUseFXAA(smooth)
        renderer.SetUseSSAO(occlusion)
        renderer.SetGradientBackground(gradient)
        renderer.SetBackgroundAlpha(1.0)


@contextmanager
def numbered(actor: vtkActor, first: int = 0) -> Iterator[None]:
    """Let `actor` be drawn in the colours of its triangles' numbers, from `first` on."""
    shader, look = actor.GetShaderProperty(), actor.GetProperty()
    edges = look.GetEdgeVisibility()
    look.SetEdgeVisibility(False)  # edges come from a geometry shader, which loses the numbers
    shader.AddFragmentShaderReplacement(_TAG, True, _NUMBER_AS_COLOUR, False)
    shader.GetFragmentCustomUniforms().SetUniformi("firstNumber", first)
    try:
        yield
    finally:
        shader.ClearFragmentShaderReplacement(_TAG, True)
        look.SetEdgeVisibility(edges)


def captured_by_selector(window: Any, renderer: vtkRenderer, actor: vtkActor) -> NDArray[np.int32]:
    """Return what `capture` returns, by VTK's own hardware selector: slower, for any number."""
    width, height = window.GetSize()
    window.MakeCurrent()
    selector = vtkOpenGLHardwareSelector()
    selector.SetRenderer(renderer)
    selector.SetFieldAssociation(vtkDataObject.FIELD_ASSOCIATION_CELLS)
    selector.SetArea(0, 0, width - 1, height - 1)
    with alone(renderer, [actor]):
        try:
            if not selector.CaptureBuffers():
                raise RuntimeError("The graphics driver could not tell which triangles are seen.")
            return _decoded(selector, width, height)
        finally:
            selector.ClearBuffers()


def _decoded(selector: Any, width: int, height: int) -> NDArray[np.int32]:
    actors = _pass_image(selector, _ACTOR_PASS, width, height)
    low = _pass_image(selector, _LOW_PASS, width, height)
    high = _pass_image(selector, _HIGH_PASS, width, height)
    if actors is None or low is None:
        raise RuntimeError("The graphics driver could not tell which triangles are seen.")
    # The cell passes hold plain ids; only the actor pass knows the background (0).
    ids = low[..., 0].astype(np.int32)
    ids |= low[..., 1].astype(np.int32) << 8
    ids |= low[..., 2].astype(np.int32) << 16
    if high is not None:
        ids |= high[..., 0].astype(np.int32) << 24
    ids[~actors.any(axis=2)] = -1
    return ids


def _pass_image(selector: Any, which: int, width: int, height: int) -> NDArray[Any] | None:
    pointer = selector.GetPixelBuffer(which)
    found = re.match(r"_([0-9a-fA-F]+)_p_", pointer) if pointer is not None else None
    if found is None:
        return None
    raw = (ctypes.c_ubyte * (width * height * 3)).from_address(int(found.group(1), 16))
    return np.ctypeslib.as_array(raw).reshape(height, width, 3)
