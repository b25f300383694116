"""Run the measures beside their peers and print a Markdown table: `make bench`."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from bench import drag
from bench.measures import Figures
from bench.surfaces import sheet

PAPER_850 = {50: 0.15, 250: 2.8, 500: 8.3}
GROWTH = (5_000, 20_000, 80_000, 320_000)
TIME_LIMIT = 900
BLENDER: list[str] = []

Row = tuple[str, str, str, str]


@cache
def run(measure: str, *sizes: int, threads: int = 0) -> Figures:
    """Run `module.function` in a fresh process and return its figures, {} if it failed.

    Parameters
    ----------
    threads : BLAS threads of the process; 0 leaves it to the library.
    """
    module, function = measure.split(".")
    code = (
        f"import json; from bench.{module} import {function} as f; "
        f"print('FIGURES', json.dumps(f(*{sizes})))"
    )
    environment = dict(os.environ)
    if threads:
        environment["OPENBLAS_NUM_THREADS"] = str(threads)
    return _figures_of([sys.executable, "-c", code], environment)


def _figures_of(command: list[str], environment: dict[str, str]) -> Figures:
    try:
        done = subprocess.run(
            command,
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT,
            check=True,
        )
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        print(f"{command}: {error}", getattr(error, "stderr", ""), file=sys.stderr)
        return {}
    line = next(x for x in done.stdout.splitlines() if x.startswith("FIGURES"))
    found: Figures = json.loads(line.removeprefix("FIGURES "))
    print(f"{command[2][:160]}: {found}", file=sys.stderr)
    return found


def best_of_threads(measure: str, *sizes: int) -> Figures:
    """Return the faster of a peer's runs with one BLAS thread and with two."""
    runs = [run(measure, *sizes, threads=t) for t in (1, 2)]
    return min((r for r in runs if r), key=lambda r: r.get("all", np.inf), default={})


def seconds(value: float) -> str:
    """Return a time as text with a fitting unit."""
    return f"{value:.2f} s" if value >= 0.1 else f"{1000 * value:.1f} ms"


def small_region() -> list[Row]:
    """850 vertices against the paper's figures."""
    rows = []
    for k, paper in PAPER_850.items():
        ours = run("measures.modes", 850, k)
        if ours:
            ratio = f"{paper / ours['all']:.0f} x faster than the paper's {paper} s"
            goal = "50 x at 500" if k == 500 else ""
            rows.append((f"850 vertices, {k} modes", seconds(ours["all"]), goal, ratio))
    ours = run("measures.modes", 850, 850)
    if ours:
        rows.append(("850 vertices, all modes", seconds(ours["all"]), "0.1 s", ""))
    return rows


def large_region() -> list[Row]:
    """20,000 vertices and 500 modes against scipy and LaPy."""
    ours = run("measures.modes", 20_000, 500)
    twice = run("measures.modes", 20_000, 1000)
    if not ours or not twice:
        return []
    rows = [("20,000 vertices, 500 modes", seconds(ours["all"]), "", "")]
    for peer, name in (("peers.scipy_modes", "scipy eigsh"), ("peers.lapy_modes", "LaPy")):
        theirs = best_of_threads(peer, 20_000, 500)
        if theirs:
            ratio = f"{theirs['all'] / ours['all']:.1f} x faster ({seconds(theirs['all'])})"
            cpu = f"{theirs['cpu'] / ours['cpu']:.1f} x the CPU time"
            rows.append((f"the same by {name}", ratio, "10 x", cpu))
    first, double = ours["first 50"] / ours["all"], twice["all"] / ours["all"]
    return [
        *rows,
        ("first 50 of the 500", f"{100 * first:.0f} %", "10 %", seconds(ours["first 50"])),
        ("1,000 modes against 500", f"{double:.2f} x", "2.3 x", seconds(twice["all"])),
        ("their M-orthonormality", f"{twice['orthonormality']:.0e}", "1e-8", "counted by inertia"),
    ]


def base_shapes() -> list[Row]:
    """Base shape against libigl."""
    rows = []
    for m, goal in ((20_000, 0.15), (200_000, 1.5)):
        ours, theirs = run("measures.base", m), run("peers.igl_base", m)
        if ours and theirs:
            ratio = f"libigl harmonic: {theirs['base'] / ours['base']:.1f} x as long"
            rows.append((f"base shape, {m:,} vertices", seconds(ours["base"]), f"{goal} s", ratio))
    return rows


def slider() -> list[Row]:
    """Slider, cancel and stalls at 20,000 vertices."""
    rows = []
    steps = run("measures.whole_slider", 20_000)
    if steps:
        worst = f"worst {seconds(steps['step worst'])}"
        rows.append(("slider step, 20,000 vertices", seconds(steps["step median"]), "8 ms", worst))
        rows.append(("slider exact from 0 to 1 after", seconds(steps["complete"]), "", ""))
    asked = run("measures.cancel", 20_000)
    if asked:
        rows.append(("cancel answers within", seconds(asked["cancel"]), "0.25 s", ""))
    for m in (20_000, 200_000):
        stalled = run("measures.stall", m)
        if stalled:
            idle = f"idle {seconds(stalled['stall idle'])}"
            name = f"longest stall of a 16 ms timer, {m:,}"
            rows.append((name, seconds(stalled["stall"]), "50 ms", idle))
    return rows


def growth() -> list[Row]:
    """How time grows with the region, and what memory it needs."""
    found = {m: run("measures.modes", m, 100) for m in GROWTH}
    times = {m: f["all"] for m, f in found.items() if f}
    rows = [(f"base and 100 modes, {m:,}", seconds(t), "", "") for m, t in times.items()]
    if len(times) > 1:
        cpu = [found[m]["cpu"] for m in times]
        slopes = [
            np.polyfit(np.log(list(times)), np.log(y), 1)[0] for y in (list(times.values()), cpu)
        ]
        beside = f"of the CPU time {slopes[1]:.2f}"
        rows.append(("exponent of that growth", f"{slopes[0]:.2f}", "1.2", beside))
    memory = run("measures.modes", 200_000, 100)
    if memory:
        size = f"{memory['memory GiB']:.2f} GiB"
        rows.append(("memory, 200,000 and 100 modes", size, "2 GiB", seconds(memory["all"])))
    return rows


def edits() -> list[Row]:
    """One edit of 20,000 vertices, against libigl's ARAP and Blender's Laplacian Deform."""
    ours = run("drag.edit", 20_000)
    if not ours:
        return []
    rows = [
        ("edit prepared, 20,000 vertices", seconds(ours["prepare"]), "0.35 s", ""),
        ("target moved to final surface", seconds(ours["update"]), "33 ms", ""),
    ]
    arap = run("drag.igl_arap", 20_000)
    if arap:
        rows.append(_update_row("libigl ARAP, 10 rounds", arap, ours, ""))
    theirs = blender(20_000)
    if theirs:
        rows.append(_update_row("Blender Laplacian Deform", theirs, ours, "100 x"))
    return rows


def _update_row(name: str, theirs: Figures, ours: Figures, goal: str) -> Row:
    ratio = f"{theirs['update'] / ours['update']:.0f} x faster ({seconds(theirs['update'])})"
    return (f"the same by {name}", ratio, goal, f"prepared in {seconds(theirs['prepare'])}")


def blender(m: int) -> Figures:
    """Return the figures of Blender's modifier, {} where no interpreter has it."""
    if not BLENDER:
        return {}
    mesh, roi = sheet(m)
    ids = drag.anchors(mesh, roi)
    goals = np.array([drag.moved_to(mesh, ids, pull) for pull in drag.pulls(len(ids))[:5]])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "edit.npz"
        held = np.setdiff1d(np.arange(mesh.n), roi)
        np.savez(
            path, vertices=mesh.vertices, faces=mesh.faces, held=held, anchors=ids, goals=goals
        )
        script = Path(__file__).with_name("blender.py")
        return _figures_of([BLENDER[0], str(script), str(path)], dict(os.environ))


GROUPS: dict[str, Callable[[], list[Row]]] = {
    "small": small_region,
    "large": large_region,
    "base": base_shapes,
    "slider": slider,
    "edit": edits,
    "growth": growth,
}


def main() -> None:
    """Run the chosen groups and print their table."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("groups", nargs="*", choices=[*GROUPS, []], help="default: all of them")
    parser.add_argument("--blender", help="a Python that has bpy, for Blender as a peer")
    given = parser.parse_args()
    chosen = given.groups or list(GROUPS)
    if given.blender:
        BLENDER.append(given.blender)
    packages = ("numpy", "scipy", "cvxopt", "lapy", "libigl")
    versions = ", ".join(f"{p} {importlib.metadata.version(p)}" for p in packages)
    print(f"\n{os.cpu_count()} cores, {platform.system()} {platform.machine()}, {versions}\n")
    print("| measure | figure | goal | beside |\n|---|---|---|---|")
    for name in chosen:
        for row in GROUPS[name]():
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
