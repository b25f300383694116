"""What several strokes ask of one anchor (Eq. 17): each its due, and nothing far away."""

from __future__ import annotations

import numpy as np
import pytest

from engine.handles import Rows

X, Y, Z = np.eye(3)


def rows(*asked: tuple[int, np.ndarray, float, float]) -> Rows:
    anchors, directions, distances, softness = zip(*asked, strict=True)
    return Rows(np.array(anchors), np.array(directions), np.array(distances), np.array(softness))


def answer(agreed: Rows, anchor: int) -> np.ndarray:
    """Where an anchor goes by its rows, (3,); 0 along what they leave open."""
    own = agreed.anchors == anchor
    return np.linalg.lstsq(agreed.directions[own], agreed.distances[own])[0]


def test_where_one_stroke_asks_its_rows_stay() -> None:
    asked = rows((0, X, 1.0, 0.0), (0, Y, 2.0, 0.5), (1, X, 3.0, 0.0), (1, Z, 4.0, 0.0))
    assert asked.agreed() is asked


def test_two_strokes_that_fix_three_directions_are_both_met() -> None:
    asked = rows(
        (0, X, 1.0, 0.0), (0, Y, 2.0, 0.0), (0, Y, 2.0, 0.0), (0, Z, 3.0, 0.0), (1, X, 9.0, 0.0)
    )
    agreed = asked.agreed()
    assert answer(agreed, 0) == pytest.approx([1, 2, 3])
    assert answer(agreed, 1) == pytest.approx([9, 0, 0]), "another anchor is left alone"
    own = agreed.directions[agreed.anchors == 0]
    assert own @ own.T == pytest.approx(np.eye(3)), "no two rows say the same"


def test_what_two_strokes_ask_differently_is_weighed_by_how_firmly() -> None:
    asked = rows((0, X, 1.0, 0.0), (0, Y, 0.0, 0.0), (0, X, 2.0, 3.0), (0, Y, 0.0, 3.0))
    agreed = asked.agreed()
    # Weights 1 and 1 / (1 + 3).
    assert answer(agreed, 0) == pytest.approx([(1 + 0.25 * 2) / 1.25, 0, 0])
    assert agreed.softness == pytest.approx([1.5, 1.5])


def test_sight_planes_that_are_nearly_parallel_do_not_throw_the_anchor_away() -> None:
    """Taken literally the planes x = 0 and x + 1e-4 z = 0.1 meet at z = 1000."""
    tilted = (X + 1e-4 * Z) / np.hypot(1, 1e-4)
    asked = rows((0, X, 0.0, 0.0), (0, Y, 0.0, 0.0), (0, tilted, 0.1, 0.0), (0, Y, 0.0, 0.0))
    assert answer(asked.agreed(), 0) == pytest.approx([0.05, 0, 0], abs=1e-4)
