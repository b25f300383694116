"""The wavy plate: modes, levels of detail, curvatures, rectification (Figs. 5 to 8 and 11)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.charts import curve, histogram
from app.headless import sketch_figures
from app.pictures import Studio, sheet, write_picture
from engine import F64, Decomposition, Mesh, Run, SketchEdit, View, decompose
from engine.view import look_at

COUNTS = (50, 250, 500, 750)
SIZE = (900.0, 620.0)
# Two colours that everyone can tell apart, over a neutral middle.
LOW, MIDDLE, HIGH = (33, 102, 172), (240, 238, 234), (217, 95, 14)


def plate_figures(
    edit: SketchEdit, mesh: Mesh, folder: Path, report: dict[str, Any], run: Run
) -> Iterator[Path]:
    """Take the pictures of Figs. 5 to 8 and 11; put what was measured into `report`."""
    parts = decompose(mesh, edit.roi, max(COUNTS), run=run)
    view = look_at(mesh.bounds.mean(axis=0), 560, -25, 50, SIZE)
    low = look_at(mesh.bounds.mean(axis=0) + np.array([0, 0, 22]), 480, -8, 14, SIZE)
    with Studio(mesh) as studio:
        yield _modes(parts, mesh, studio, view, folder)
        yield _levels(parts, mesh, studio, view, folder)
        yield _histograms(parts, folder)
        yield _cutoffs(parts, folder)
        yield _rectification(edit, mesh, studio, low, folder, report, run)
    report["modes"] = {
        str(k): {
            "distance_rms": _distance(parts, k),
            "cutoff_curvature": parts.cutoff(k),
            "level": parts.level_of(k),
        }
        for k in (0, *COUNTS, parts.m)
    }


def diverging(values: F64) -> NDArray[np.uint8]:
    """Return a colour (n, 3) for each value (n,) in -1..1: blue, neutral, orange."""
    v = np.clip(values, -1, 1)[:, None]
    ends = np.where(v < 0, np.array(LOW, dtype=float), np.array(HIGH, dtype=float))
    return np.asarray(np.round(MIDDLE + np.abs(v) * (ends - MIDDLE)), dtype=np.uint8)


def _modes(parts: Decomposition, mesh: Mesh, studio: Studio, view: View, folder: Path) -> Path:
    """Fig. 5: the first nine modes, coloured and, as of a plate that swings, bent along it."""
    base = _with(mesh, parts, parts.surface(0))
    normals = mesh.with_vertices(base).vertex_normals[parts.roi]
    pictures = []
    for i in range(9):
        mode = parts.modes[:, i] / np.abs(parts.modes[:, i]).max()
        colours = np.tile(np.array(MIDDLE, dtype=np.uint8), (mesh.n, 1))
        colours[parts.roi] = diverging(mode)
        bent = base.copy()
        bent[parts.roi] += 0.06 * mesh.diagonal * mode[:, None] * normals
        wavelength = 2 * np.pi / np.sqrt(parts.eigenvalues[i])
        caption = f"Mode {i + 1}, wavelength {wavelength:.0f} mm"
        pictures.append((caption, studio.picture(view, bent, colours=colours)))
    return _sheet(folder, "05", "Fig. 5: the first nine mode shapes", pictures, 3)


def _levels(parts: Decomposition, mesh: Mesh, studio: Studio, view: View, folder: Path) -> Path:
    """Fig. 6: base, 50, 250, 500 and 750 modes, original."""
    pictures = [
        (name, studio.picture(view, _with(mesh, parts, parts.surface(k))))
        for name, k in _shown(parts)
    ]
    return _sheet(folder, "06", "Fig. 6: one surface at growing levels of detail", pictures, 3)


def _histograms(parts: Decomposition, folder: Path) -> Path:
    """Fig. 7: curvature histograms of the surfaces of Fig. 6, with their cutoffs."""
    highest = 1.6 * parts.cutoff(parts.m)
    pictures = [
        (
            f"{name}: cutoff {parts.cutoff(k):.3g} / mm",
            histogram(parts.curvature(k), parts.areas, parts.cutoff(k), highest),
        )
        for name, k in _shown(parts)
    ]
    return _sheet(folder, "07", "Fig. 7: curvature histograms with the cutoff", pictures, 3)


def _cutoffs(parts: Decomposition, folder: Path) -> Path:
    """Fig. 8: cutoff curvature against the number of modes."""
    counts = np.unique(np.concatenate([np.arange(0, parts.k + 1, 5), [parts.k]]))
    cutoffs = [parts.cutoff(int(k)) for k in counts]
    path = folder / "figure-08.png"
    labels = ("modes", "cutoff of |H| in 1/mm")
    write_picture(curve(counts, cutoffs, labels, [k for k in COUNTS if k <= parts.k]), path)
    return path


def _rectification(
    edit: SketchEdit,
    mesh: Mesh,
    studio: Studio,
    view: View,
    folder: Path,
    report: dict[str, Any],
    run: Run,
) -> Path:
    """Fig. 11: the details put back without and with turning them."""
    prepared = edit.prepare(mesh, run)
    roi = prepared.decomposition.roi
    bent = prepared.solve(edit.strokes).level_vertices
    base = _with(mesh, prepared.decomposition, prepared.decomposition.base)
    plain = replace(edit, options=replace(edit.options, rectify=False))
    pictures = [
        ("(a) the region", studio.picture(view, mesh.vertices, roi)),
        ("(b) the base shape", studio.picture(view, base, roi)),
        ("(c) deformed", studio.picture(view, bent, roi)),
    ]
    report["rectification"] = {}
    for caption, name, one in (
        ("(d) details without rectification", "without", plain),
        ("(e) details with rectification", "with", edit),
    ):
        changed = one.apply(mesh, run)
        pictures.append((caption, studio.picture(view, changed.vertices)))
        figures = sketch_figures(one, mesh, changed, run)
        report["rectification"][name] = figures["feature_amplitude"]
    return _sheet(folder, "11", "Fig. 11: what turning the details does", pictures, 3)


def _shown(parts: Decomposition) -> list[tuple[str, int]]:
    counts = [(f"{k} modes", k) for k in COUNTS if k < parts.m]
    return [("Base shape", 0), *counts, ("Original", parts.m)]


def _with(mesh: Mesh, parts: Decomposition, surface: F64) -> F64:
    vertices = mesh.vertices.copy()
    vertices[parts.roi] = surface
    return vertices


def _distance(parts: Decomposition, k: int) -> float:
    """Return the area-weighted RMS distance of the surface at k modes from the original, mm."""
    away = ((parts.surface(k) - parts.original) ** 2).sum(axis=1)
    return float(np.sqrt(parts.areas @ away / parts.areas.sum()))


def _sheet(
    folder: Path, number: str, title: str, pictures: list[tuple[str, Image.Image]], columns: int
) -> Path:
    width, height = pictures[0][1].size
    scale = min(1.0, 640 / width)
    cell = (round(width * scale), round(height * scale))
    path = folder / f"figure-{number}.png"
    write_picture(sheet(pictures, columns, cell, title), path)
    return path
