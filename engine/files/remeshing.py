"""Isotropic remeshing of a part of a mesh, in the worker."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine.errors import MeshError
from engine.files.wire import Arrays

ROUNDS = 6


def remesh_part(
    job: dict[str, Any], arrays: Arrays, tick: Callable[[float, str], None]
) -> tuple[dict[str, Any], Arrays]:
    """Remesh the faces of `arrays["chosen"]` to edges of the length `job["length"]`."""
    import pymeshlab

    tick(0.1, "Remeshing")
    meshes = pymeshlab.MeshSet(verbose=False)
    try:
        meshes.add_mesh(
            pymeshlab.Mesh(
                arrays["vertices"],
                arrays["faces"].astype(np.int32),
                f_scalar_array=arrays["chosen"].astype(np.float64),
            )
        )
        meshes.compute_selection_by_condition_per_face(condselect="(fq > 0.5)")
        meshes.meshing_isotropic_explicit_remeshing(
            selectedonly=True,
            targetlen=pymeshlab.PureValue(job["length"]),
            iterations=ROUNDS,
            checksurfdist=False,
        )
    except pymeshlab.PyMeshLabException as error:
        raise MeshError(
            f"The part could not be remeshed ({error}). Clean the mesh, or choose another part."
        ) from error
    made = meshes.current_mesh()
    found = {
        "vertices": np.ascontiguousarray(made.vertex_matrix(), dtype=np.float64),
        "faces": np.ascontiguousarray(made.face_matrix(), dtype=np.int64),
    }
    return {}, found
