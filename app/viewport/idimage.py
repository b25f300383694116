"""Which triangle is seen at every pixel: one hardware-selector capture as a numpy image."""

from __future__ import annotations

import ctypes
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer, vtkRenderWindow
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLHardwareSelector

_ACTOR_PASS, _LOW_PASS, _HIGH_PASS = 0, 5, 6


def _pass_image(selector: Any, which: int, width: int, height: int) -> NDArray[Any] | None:
    pointer = selector.GetPixelBuffer(which)
    if pointer is None:
        return None
    found = re.match(r"_([0-9a-fA-F]+)_p_", pointer)
    if found is None:
        return None
    raw = (ctypes.c_ubyte * (width * height * 3)).from_address(int(found.group(1), 16))
    return np.ctypeslib.as_array(raw).reshape(height, width, 3)


def capture(window: vtkRenderWindow, renderer: vtkRenderer, actor: vtkActor) -> NDArray[np.int32]:
    """Return the ids of the triangles of `actor` that are seen, (height, width), -1 for none.

    Row 0 is the bottom, as VTK counts. Nothing but `actor` takes part: other props neither hide it
    nor answer.
    """
    width, height = window.GetSize()
    window.MakeCurrent()
    others = []
    props = renderer.GetViewProps()
    props.InitTraversal()
    while (prop := props.GetNextProp()) is not None:
        if prop is not actor and prop.GetVisibility():
            prop.VisibilityOff()
            others.append(prop)
    shown = actor.GetVisibility()
    actor.VisibilityOn()
    selector = vtkOpenGLHardwareSelector()
    selector.SetRenderer(renderer)
    selector.SetFieldAssociation(vtkDataObject.FIELD_ASSOCIATION_CELLS)
    selector.SetArea(0, 0, width - 1, height - 1)
    try:
        captured = selector.CaptureBuffers()
        if not captured:
            raise RuntimeError("The graphics driver could not tell which triangles are seen.")
        return _decoded(selector, width, height)
    finally:
        selector.ClearBuffers()
        actor.SetVisibility(shown)
        for prop in others:
            prop.VisibilityOn()


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
