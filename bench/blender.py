"""Blender's Laplacian Deform on the same edit. Runs by itself in a Python that has `bpy`.

    python bench/blender.py EDIT.npz

`python -m bench edit --blender PYTHON` calls it with an interpreter that has it (the wheel needs
Python 3.11 and an older numpy than ours, so it wants an environment of its own:
`python3.11 -m venv blender && blender/bin/pip install bpy==5.0.1`).

EDIT.npz holds vertices (n, 3), faces (f, 3), held (h,), anchors (c,), goals (u, c, 3).
"""

from __future__ import annotations

import json
import sys
import time

import bpy
import numpy as np


def main(path: str) -> None:
    """Bind once, then move the anchors and let the modifier follow; print the figures."""
    edit = np.load(path)
    mesh = bpy.data.meshes.new("sheet")
    mesh.from_pydata(edit["vertices"].tolist(), [], edit["faces"].tolist())
    thing = bpy.data.objects.new("sheet", mesh)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    group = thing.vertex_groups.new(name="held")
    group.add(np.concatenate([edit["held"], edit["anchors"]]).tolist(), 1.0, "REPLACE")
    modifier = thing.modifiers.new("deform", "LAPLACIANDEFORM")
    modifier.vertex_group = group.name
    modifier.iterations = 1
    begun = time.perf_counter()
    bpy.ops.object.laplaciandeform_bind(modifier=modifier.name)
    positions = edit["vertices"].copy()
    figures = {"prepare": _updated(thing, mesh, positions, begun)[0]}
    steps = []
    for goal in edit["goals"]:
        positions[edit["anchors"]] = goal
        begun_cpu = time.process_time()
        took, shape = _updated(thing, mesh, positions, time.perf_counter())
        steps.append((took, time.process_time() - begun_cpu))
    middle = np.median(np.array(steps), axis=0)
    moved = np.abs(shape - edit["vertices"]).max(axis=1) > 1e-3
    figures |= {"update": middle[0], "update cpu": middle[1], "moved": int(moved.sum())}
    print("FIGURES", json.dumps({k: float(v) for k, v in figures.items()}))


def _updated(thing, mesh, positions, begun):
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.update()
    thing.update_tag()
    graph = bpy.context.evaluated_depsgraph_get()
    graph.update()
    shown = thing.evaluated_get(graph).to_mesh()
    shape = np.empty(3 * len(positions), dtype=np.float32)
    shown.vertices.foreach_get("co", shape)
    return time.perf_counter() - begun, shape.reshape(-1, 3)


if __name__ == "__main__":
    main(sys.argv[1])
