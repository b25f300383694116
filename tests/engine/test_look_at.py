"""The camera that `look_at` sets up."""

from __future__ import annotations

import math

import numpy as np
import pytest

from engine import SketchError, View
from engine.view import look_at

SIZE = (800.0, 600.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_camera_that_is_none_is_refused(bad: float) -> None:
    one_bad = np.eye(4)
    one_bad[2, 1] = bad
    for matrix in (one_bad, np.eye(3)):
        with pytest.raises(SketchError, match="4 by 4 finite numbers"):
            View(matrix, SIZE)
    for size in ((0.0, 600.0), (800.0, -1.0), (bad, 600.0)):
        with pytest.raises(SketchError, match="positive numbers of pixels"):
            View(np.eye(4), size)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (35, 22), (-120, 70), (180, -30)])
def test_the_target_is_in_the_middle_and_at_its_distance(azimuth: float, elevation: float) -> None:
    view = look_at([3, -2, 5], 40, azimuth, elevation, SIZE)
    assert np.allclose(view.project([3, -2, 5]), [[400, 300]])
    assert view.depth([3, -2, 5]) == pytest.approx(40)


def test_the_front_view_has_x_to_the_right_and_z_up() -> None:
    view = look_at([0, 0, 0], 10, 0, 0, SIZE)
    right, up, near = view.project([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert right[0] > 400
    assert right[1] == pytest.approx(300)
    assert up[1] < 300
    assert np.allclose(near, (400, 300))
    assert view.depth([0, -1, 0]) == pytest.approx(9)


def test_the_angle_is_that_of_the_height() -> None:
    view = look_at([0, 0, 0], 10, 0, 0, SIZE, angle=40)
    top = 10 * math.tan(math.radians(20))
    assert np.allclose(view.project([0, 0, top]), (400, 0))
    assert np.allclose(view.project([top * 800 / 600, 0, 0]), (800, 300))
