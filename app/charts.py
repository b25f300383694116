"""Two plain charts for the figures: a histogram with its cutoff (Fig. 7) and a curve (Fig. 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image, ImageDraw, ImageFont

from app.look.colours import LIGHT, REGION, TARGET, rgb8

SUPERSAMPLING = 2


@dataclass
class Axes:
    """A rectangle to draw in, and the map from values to pixels.

    Parameters
    ----------
    size : of the picture in px.
    x, y : range of values on each axis.
    labels : what stands at the x and the y axis.
    """

    size: tuple[int, int]
    x: tuple[float, float]
    y: tuple[float, float]
    labels: tuple[str, str]

    def __post_init__(self) -> None:
        width, height = (s * SUPERSAMPLING for s in self.size)
        self.image = Image.new("RGB", (width, height), rgb8(LIGHT.field))
        self.brush = ImageDraw.Draw(self.image)
        self._left, self._right = 96 * SUPERSAMPLING, width - 24 * SUPERSAMPLING
        self._top, self._bottom = 44 * SUPERSAMPLING, height - 62 * SUPERSAMPLING

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return the place of a value in picture pixels."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return (
            self._left + across * (self._right - self._left),
            self._bottom - up * (self._bottom - self._top),
        )

    def frame(self) -> None:
        """Draw grid, ticks and labels."""
        font = ImageFont.load_default(15 * SUPERSAMPLING)
        faint, text = rgb8(LIGHT.border), rgb8(LIGHT.text)
        for tick in ticks(*self.x):
            px, _ = self.at(tick, self.y[0])
            self.brush.line([(px, self._top), (px, self._bottom)], fill=faint, width=1)
            below = (px, self._bottom + 8 * SUPERSAMPLING)
            self.brush.text(below, f"{tick:g}", fill=text, font=font, anchor="mt")
        for tick in ticks(*self.y):
            _, py = self.at(self.x[0], tick)
            self.brush.line([(self._left, py), (self._right, py)], fill=faint, width=1)
            beside = (self._left - 8 * SUPERSAMPLING, py)
            self.brush.text(beside, f"{tick:g}", fill=text, font=font, anchor="rm")
        middle = ((self._left + self._right) / 2, self.image.height - 10 * SUPERSAMPLING)
        self.brush.text(middle, self.labels[0], fill=text, font=font, anchor="mb")
        corner = (12 * SUPERSAMPLING, 12 * SUPERSAMPLING)
        self.brush.text(corner, self.labels[1], fill=text, font=font, anchor="lt")

    def finished(self) -> Image.Image:
        """Return the picture in its final size."""
        return self.image.resize(self.size, Image.Resampling.LANCZOS)


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Return some round numbers from `low` to `high`."""
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(s for s in (1, 2, 5, 10) if s * power >= rough * 0.999) * power
    count = math.floor(high / step + 1e-9) - math.ceil(low / step - 1e-9) + 1
    first = math.ceil(low / step - 1e-9)
    return [round((first + i) * step, 12) for i in range(count)]


def histogram(
    values: ArrayLike,
    weights: ArrayLike,
    cutoff: float,
    highest: float,
    size: tuple[int, int] = (620, 420),
) -> Image.Image:
    """Return the share of the area at each curvature, with the cutoff as a line (Fig. 7).

    Parameters
    ----------
    values, weights : (m,) curvature magnitude, 1/mm, and area.
    cutoff : curvature below which 90 % of the area lies.
    highest : right end of the axis, the same for the histograms that are compared.
    """
    share, edges = np.histogram(values, bins=60, range=(0.0, highest), weights=weights)
    share = 100 * share / np.sum(weights)
    # One scale for all; what stands higher (a nearly flat base) leaves through the top.
    axes = Axes(size, (0.0, highest), (0.0, 30.0), ("|H| in 1/mm", "% of the area"))
    axes.frame()
    for low, high, one in zip(edges[:-1], edges[1:], np.minimum(share, 30.0), strict=True):
        left, top = axes.at(low, one)
        right, bottom = axes.at(high, 0.0)
        axes.brush.rectangle((left + 1, top, right - 1, bottom), fill=rgb8(REGION))
    line = [axes.at(min(cutoff, highest), 0.0), axes.at(min(cutoff, highest), 30.0)]
    axes.brush.line(line, fill=rgb8(TARGET), width=3 * SUPERSAMPLING)
    return axes.finished()


def curve(
    x: ArrayLike,
    y: ArrayLike,
    labels: tuple[str, str],
    marks: ArrayLike = (),
    size: tuple[int, int] = (900, 560),
) -> Image.Image:
    """Return y over x as a line, with dots at the places `marks` of the x axis (Fig. 8)."""
    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    axes = Axes(size, (0.0, float(xs.max())), (0.0, 1.08 * float(ys.max())), labels)
    axes.frame()
    places = [axes.at(float(a), float(b)) for a, b in zip(xs, ys, strict=True)]
    axes.brush.line(places, fill=rgb8(REGION), width=3 * SUPERSAMPLING, joint="curve")
    for mark in np.asarray(marks, dtype=float):
        px, py = axes.at(mark, float(np.interp(mark, xs, ys)))
        r = 6 * SUPERSAMPLING
        axes.brush.ellipse((px - r, py - r, px + r, py + r), fill=rgb8(TARGET))
    return axes.finished()
