"""Pictures off screen: they show what the view says, where it says."""

from __future__ import annotations

import numpy as np
import pytest

from app.charts import curve, histogram, ticks
from app.demo_plate import diverging
from app.look.colours import REGION, ROLE_COLOURS, TARGET, rgb8
from app.pictures import Curve, Ink, Studio, sheet
from engine import Mesh, View
from engine.view import look_at

SIZE = (320.0, 240.0)


def ball(n: int = 24) -> Mesh:
    """Sphere of radius 30 about (100, -50, 20), without its poles."""
    t, p = np.meshgrid(
        np.linspace(0.15, np.pi - 0.15, n), np.linspace(0, 2 * np.pi, 2 * n, endpoint=False),
        indexing="ij",
    )  # fmt: skip
    unit = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(2 * n), indexing="ij")
    a, b = i * 2 * n + j, (i + 1) * 2 * n + j
    c, d = (i + 1) * 2 * n + (j + 1) % (2 * n), i * 2 * n + (j + 1) % (2 * n)
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Mesh(30 * unit.reshape(-1, 3) + (100, -50, 20), faces)


def parallel_view() -> View:
    """Front view without perspective, 100 units high, of the ball's middle."""
    matrix = np.zeros((4, 4))
    matrix[0, [0, 3]] = np.array([1, -100]) / (50 * SIZE[0] / SIZE[1])
    matrix[1, [2, 3]] = np.array([1, -20]) / 50
    matrix[2, [1, 3]] = 1 / 1000, 0
    matrix[3, 3] = 1
    return View(matrix, SIZE)


VIEWS = {
    "perspective": look_at([100, -50, 20], 160, 35, 22, SIZE),
    "aside": look_at([110, -40, 5], 200, -70, -30, SIZE),
    "parallel": parallel_view(),
}


@pytest.mark.parametrize("name", VIEWS)
def test_the_camera_is_the_view(name: str) -> None:
    view, mesh = VIEWS[name], ball()
    with Studio(mesh) as studio:
        sight = studio.sight(view)
    seen = np.unique(sight.ids[sight.ids >= 0])
    middles = mesh.vertices[mesh.faces[seen]].mean(axis=1)
    places = view.project(middles)
    found = sight.faces_at(places).tolist()
    a, b, c = (view.project(mesh.vertices[mesh.faces[seen, i]]) for i in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    # At the silhouette triangles are thinner than a pixel.
    large = np.abs(ux * vy - uy * vx) / 2 > 12
    assert large.sum() > 200
    assert np.mean(np.array(found)[large] == seen[large]) > 0.99


def test_ink_and_tint_are_where_they_were_put() -> None:
    view, mesh = VIEWS["perspective"], ball()
    line = Ink(np.array([[20.0, 30.0], [120.0, 30.0]]), "target")
    with Studio(mesh) as studio:
        bare = np.asarray(studio.picture(view), dtype=int)
        tinted = np.asarray(studio.picture(view, region=np.arange(mesh.n // 2)), dtype=int)
        inked = np.asarray(studio.picture(view, inks=[line]), dtype=int)
    assert bare.shape == (240, 320, 3)
    assert np.abs(inked[30, 70] - rgb8(ROLE_COLOURS["target"])).max() < 12
    assert (inked[60:] == bare[60:]).all()
    # Violet has more blue than green; clay has not.
    warm = bare[120, 160]
    assert warm[1] > warm[2]
    changed = np.abs(tinted - bare).sum(axis=2) > 30
    assert changed.mean() > 0.03
    assert (tinted[changed][:, 2] > tinted[changed][:, 1]).mean() > 0.5


def test_a_curve_lies_on_the_form_and_is_hidden_behind_it() -> None:
    view, mesh = VIEWS["parallel"], ball(40)
    front = mesh.vertices[np.argsort(np.linalg.norm(mesh.vertices - (100, -80, 20), axis=1))[:2]]
    back = mesh.vertices[np.argsort(np.linalg.norm(mesh.vertices - (100, -20, 20), axis=1))[:2]]
    with Studio(mesh) as studio:
        bare = np.asarray(studio.picture(view), dtype=int)
        shown = np.asarray(studio.picture(view, curves=[Curve(front, "source")]), dtype=int)
        hidden = np.asarray(studio.picture(view, curves=[Curve(back, "source")]), dtype=int)
    x, y = view.project(front[:1])[0]
    assert np.abs(shown - bare)[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4].max() > 60
    assert (hidden == bare).all()


def test_the_same_picture_comes_out_twice() -> None:
    with Studio(ball()) as studio:
        first = np.asarray(studio.picture(VIEWS["aside"]))
        studio.picture(VIEWS["perspective"], region=np.arange(200))
        assert (np.asarray(studio.picture(VIEWS["aside"])) == first).all()


def test_a_sheet_holds_every_picture() -> None:
    with Studio(ball()) as studio:
        picture = studio.picture(VIEWS["aside"])
    whole = sheet([("one", picture), ("two", picture), ("three", picture)], 2, (320, 240), "Fig.")
    assert whole.width > 640
    assert whole.height > 480


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0, 1, [0, 0.2, 0.4, 0.6, 0.8, 1]), (0, 750, [0, 200, 400, 600]), (0, 0.015, None)],
)
def test_ticks_are_round_and_inside(low: float, high: float, expected: list[float] | None) -> None:
    marks = ticks(low, high)
    assert 2 <= len(marks) <= 7
    assert low <= min(marks)
    assert max(marks) <= high
    if expected is not None:
        assert marks == pytest.approx(expected)


def test_charts_draw_their_bars_line_and_cutoff() -> None:
    rng = np.random.default_rng(1)
    values = rng.random(5000) * 0.1
    chart = np.asarray(histogram(values, np.ones(5000), 0.09, 0.15)).reshape(-1, 3)
    for colour in (REGION, TARGET):
        assert (np.abs(chart.astype(int) - rgb8(colour)).max(axis=1) < 40).sum() > 200
    line = np.asarray(curve(np.arange(50), np.sqrt(np.arange(50)), ("k", "h"), [10])).reshape(-1, 3)
    assert (np.abs(line.astype(int) - rgb8(REGION)).max(axis=1) < 40).sum() > 200


def test_mode_colours_tell_the_signs_apart() -> None:
    low, middle, high = diverging(np.array([-1.0, 0.0, 1.0])).astype(int)
    assert low[2] > low[0]
    assert high[0] > high[2]
    assert np.ptp(middle) < 10
