"""Take a region apart: base shape at once, then modes band by band, then the rest (Section 5.1)."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import count

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from engine.arrays import F64
from engine.base import Rim, base_shape
from engine.detail import CHUNK, Anchor, Decomposition
from engine.errors import EngineError, RegionError, SolveError
from engine.lanczos import shift_at
from engine.level import Curve, cutoff_curvature, next_knot
from engine.lowpass import lowpass
from engine.mesh import Mesh
from engine.region import Region
from engine.run import Run
from engine.slicing import FIRST_COUNT
from engine.solve import factorise
from engine.spectrum import DENSE_LIMIT, bands
from engine.threads import two_at_a_time, while_polling

# A region's size whose square and curvature still are numbers.
SMALLEST = 1e-100
# Cutoffs of the low-passed surfaces beyond the modes: this factor apart in lambda.
REST_RATIO = 1.5
# The last of them holds at least this share of all modes.
REST_SHARE = 0.8


def decompose_stream(
    mesh: Mesh,
    roi: ArrayLike,
    modes: int | None = None,
    rim: Rim = "smooth",
    run: Run | None = None,
    free_borders: bool = False,
) -> Iterator[Decomposition]:
    """Yield the decomposition with the base and no modes first, then with more and more modes.

    Parameters
    ----------
    mesh : the mesh.
    roi : vertex ids of the region.
    modes : how many to compute; None for a sensible number (see `default_modes`), followed by
        low-passed surfaces that carry the slider on to level 1.
    rim : "smooth" or "paper" (see `engine.base`).
    run : progress and cancel.
    free_borders : let open borders inside the region move.

    Raises
    ------
    EngineError
        The rim rule is unknown, or the number of modes is below 0 or out of reach.
    RegionError
        The region cannot be taken apart: it is empty, or nothing holds it.
    SolveError
        The base shape cannot be computed.
    Cancelled

    Notes
    -----
    Every item shares its arrays with the next and is a prefix of it to the last bit. Where a mesh
    is so broken that modes beyond some number cannot be computed, that number is kept, the report
    says so, and low-passed surfaces carry on.
    """
    run = run or Run()
    if rim not in ("smooth", "paper"):
        raise EngineError(f"The rim rule {rim!r} is unknown. Use “smooth” or “paper”.")
    if modes is not None and modes < 0:
        raise EngineError(f"{modes} modes were asked for. Ask for 0 or more.")
    run.tick(0.0, "Base shape")
    parts = while_polling(run, lambda: with_base(Region(mesh, roi, free_borders), rim))
    m = parts.m
    wanted = default_modes(m) if modes is None else min(int(modes), m)
    parts = replace(parts, complete=wanted == 0)
    run.tick(0.02, "Base shape")
    yield parts
    if wanted == 0:
        return
    go_on = modes is None and wanted < m
    try:
        for richer in with_modes(parts, wanted, run):
            parts = replace(richer, complete=richer.k >= wanted and not go_on)
            run.tick(0.02 + 0.88 * parts.k / wanted, f"{parts.k} of {wanted} modes")
            yield parts
    except SolveError:
        parts, go_on = with_fewer(parts, wanted), True
    if not go_on:
        return
    try:
        for finer in with_rest(parts, run):
            parts = finer
            run.tick(0.9 + 0.1 * parts.rest[-1].count / m if parts.rest else 1.0, "Finest details")
            yield parts
    except SolveError:
        yield finished(parts)


def decompose(
    mesh: Mesh,
    roi: ArrayLike,
    modes: int | None = None,
    rim: Rim = "smooth",
    run: Run | None = None,
    free_borders: bool = False,
) -> Decomposition:
    """Return the last item of `decompose_stream`: all that was asked for."""
    *_, last = decompose_stream(mesh, roi, modes, rim, run, free_borders)
    return last


def decompose_until(
    mesh: Mesh, roi: ArrayLike, level: float, rim: Rim = "smooth", run: Run | None = None
) -> Decomposition:
    """Return the decomposition with just the modes that the level 0..1 needs (none for 0)."""
    for parts in decompose_stream(mesh, roi, None, rim, run):
        if parts.reaches(level):
            break
    return parts


def default_modes(m: int) -> int:
    """Return how many modes are computed unless told: all of a small region, else 100 to 500."""
    if m <= DENSE_LIMIT:
        return m
    return int(np.clip(10_000_000 // m, 100, 500))


def with_base(region: Region, rim: Rim) -> Decomposition:
    """Return the decomposition that has a base shape and no modes (Eqs. 9-11)."""
    m, s = region.m, region.scale
    if not SMALLEST < s < 1 / SMALLEST:
        raise RegionError(
            f"The region measures {s:.0e} units across, and nothing can be computed with its area. "
            "Scale the model to a usual size first."
        )
    k, areas = region.stiffness_roi, region.areas_roi
    with ThreadPoolExecutor(1, thread_name_prefix="engine") as beside:
        factor_job = beside.submit(factorise, k)
        offset = base_shape(region, factor_job.result, rim) - region.x[:m]
        factor = factor_job.result()
    full = (region.laplacian.stiffness[:m] @ region.x) / areas[:, None] / s
    residual = -(k @ offset) / areas[:, None] / s
    base = region.mesh.vertices[region.roi] + offset * s
    area = areas * s * s
    curve = Curve.start(cutoff_curvature(full - residual, area), cutoff_curvature(full, area), m)
    return Decomposition(
        region=region,
        factor=factor,
        rim=rim,
        base=base,
        original=region.mesh.vertices[region.roi],
        areas=area,
        delta_base=full - residual,
        delta_residual=residual,
        eigenvalues=np.zeros(0),
        modes=np.zeros((m, 0), order="F"),
        eta=np.zeros((0, 3)),
        partial=(Anchor(0, 0.0, base, full - residual),),
        rest=(),
        curve=curve,
        complete=False,
        report=region.report,
    )


def with_modes(parts: Decomposition, wanted: int, run: Run) -> Iterator[Decomposition]:
    """Yield the decomposition with more and more modes until `wanted` are there (Eq. 12)."""
    m, s = parts.m, parts.region.scale
    modes = np.empty((m, wanted), order="F")
    values, eta = np.empty(wanted), np.empty((wanted, 3))
    load = parts.areas[:, None] * parts.delta_residual
    done = 0
    for local_values, local_modes in bands(
        parts.region.stiffness_roi, parts.region.areas_roi, wanted, run
    ):
        # Lengths in the region's frame are s times shorter; lambda ~ 1/length^2, phi ~ 1/length.
        whole_band = local_modes
        whole_band /= s
        # From the whole band, even if only a part is wanted: so the bits do not depend on `wanted`.
        whole_eta = whole_band.T @ load
        b = min(len(local_values), wanted - done)
        new = slice(done, done + b)
        modes[:, new] = whole_band[:, :b]
        values[new] = local_values[:b] / s**2
        eta[new] = whole_eta[:b]
        done += b
        parts = replace(
            parts,
            eigenvalues=_read_only(values[:done]),
            modes=_read_only(modes[:, :done]),
            eta=_read_only(eta[:done]),
        )
        parts = replace(parts, partial=_partial_sums(parts))
        parts = replace(parts, curve=_extended(parts, wanted))
        yield parts


def _partial_sums(parts: Decomposition) -> tuple[Anchor, ...]:
    """Return the surfaces at every CHUNK modes as far as there are modes."""
    sums = list(parts.partial)
    while sums[-1].count + CHUNK <= parts.k:
        last = sums[-1]
        part = slice(last.count, last.count + CHUNK)
        phi, eta, wave = parts.modes[:, part], parts.eta[part], parts.eigenvalues[part]
        surface = last.surface + phi @ (eta / wave[:, None])
        sums.append(Anchor(part.stop, float(wave[-1]), surface, last.delta + phi @ eta))
    return tuple(sums)


def _extended(parts: Decomposition, wanted: int) -> Curve:
    """Return the curve with its knots up to the number of modes, the last of all included."""
    knots, cutoffs = [], []
    k = next_knot(int(parts.curve.knots[-1]))
    while k < parts.k or (k == parts.k and k < parts.m):
        knots.append(k)
        cutoffs.append(cutoff_curvature(parts.delta(k), parts.areas))
        k = next_knot(k)
    if parts.k == wanted and (knots[-1] if knots else int(parts.curve.knots[-1])) < wanted:
        whole = wanted == parts.m
        knots.append(wanted)
        cutoffs.append(
            parts.curve.full if whole else cutoff_curvature(parts.delta(wanted), parts.areas)
        )
    return parts.curve.with_knots(knots, cutoffs)


def with_fewer(parts: Decomposition, wanted: int) -> Decomposition:
    """Return the decomposition with the modes that it has for all that can be computed."""
    told = (
        f"Only {parts.k} of {wanted} modes can be computed here; beyond them the level of detail "
        "goes in coarser steps."
    )
    return replace(parts, curve=_extended(parts, parts.k), report=f"{parts.report} {told}".strip())


def finished(parts: Decomposition) -> Decomposition:
    """Return the decomposition with its slider closed: from what is known straight to level 1."""
    if parts.curve.knots[-1] < parts.m:
        parts = replace(parts, curve=parts.curve.with_knots([parts.m], [parts.curve.full]))
    return replace(parts, complete=True)


def with_rest(parts: Decomposition, run: Run) -> Iterator[Decomposition]:
    """Yield the decomposition with low-passed surfaces beyond its modes, coarse to fine."""
    region, scale = parts.region, parts.region.scale
    root = np.sqrt(region.areas_roi)
    d = sp.diags_array(1 / root)
    s = sp.csr_array(d @ region.stiffness_roi @ d)
    held = parts.delta(parts.k)
    left = root[:, None] * (parts.delta_base + parts.delta_residual - held)
    surface = parts.surface(parts.k)
    # Without any mode Weyl's law says where about as many lie as a first band has.
    first = float(parts.eigenvalues[-1]) * scale**2 if parts.k else weyl(FIRST_COUNT, region)
    cutoffs = (first * REST_RATIO**i for i in count(1))

    def filtered(mu: float) -> tuple[float, int, F64]:
        return mu, shift_at(s, mu).count, lowpass(s, left, mu, run) / root[:, None]

    for cutoff, held_modes, more in two_at_a_time(run, filtered, cutoffs):
        known = parts.rest[-1].count if parts.rest else parts.k
        if known < held_modes < parts.m:
            parts = _with_anchor(parts, held_modes, cutoff / scale**2, surface, held, more)
            yield parts
        if held_modes >= REST_SHARE * parts.m:
            break
    yield finished(parts)


def weyl(count: int, region: Region) -> float:
    """Return the eigenvalue below which about `count` others lie, in the region's frame."""
    return 4 * np.pi * count / float(region.areas_roi.sum())


def _with_anchor(
    parts: Decomposition, count: int, wave: float, surface: F64, delta: F64, more: F64
) -> Decomposition:
    """Return the decomposition with one more low-passed surface: `delta` + `more`."""
    moved = parts.factor.solve(parts.areas[:, None] * more)
    anchor = Anchor(count, wave, surface + moved, delta + more)
    curve = parts.curve.with_knots([count], [cutoff_curvature(anchor.delta, parts.areas)])
    return replace(parts, rest=(*parts.rest, anchor), curve=curve)


def _read_only(array: F64) -> F64:
    view = array.view()
    view.flags.writeable = False
    return view
