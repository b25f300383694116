"""Numbers only: no Qt, no VTK. Everything here works headless and from a script."""

from engine.align import Alignment, align
from engine.anchors import AnchorPath, anchor_path, trace_anchors
from engine.applied import StepError, applied
from engine.archive import Archive, open_archive, save_archive
from engine.arrays import B1, F64, I64
from engine.closest import Closest, Nearby, closest_points
from engine.data_step import DataStep, ids_from_text, ids_to_text
from engine.decomposition import decompose, decompose_stream, decompose_until
from engine.detail import Decomposition
from engine.document import Document, Draft, History, HistoryState, Moment
from engine.edit import EditOptions, SketchEdit, Source, Stroke
from engine.errors import (
    Cancelled,
    EngineError,
    FileError,
    MeshError,
    PositionsError,
    RecipeError,
    RegionError,
    SketchError,
    SolveError,
)
from engine.figures import figure
from engine.io import (
    EXPORT_SUFFIXES,
    IMPORT_SUFFIXES,
    MEMORY_LIMIT,
    Change,
    ExportReport,
    Imported,
    ImportReport,
    estimate,
    load,
    open_file,
    save,
    start_worker,
    sweep_strays,
)
from engine.mesh import Mesh, Topology
from engine.mirror import middle_plane, mirrored_region, reflected, reflection, symmetry_plane
from engine.morph import Morph
from engine.operators import cotangent_stiffness, mean_curvature, vertex_areas
from engine.oversketch import redraw_part
from engine.patch_drag import drag_patch, drag_patches
from engine.prepared import PreparedEdit
from engine.recipe import Kinds, Recipe, Step, UnknownStep, replay
from engine.region import Region
from engine.remesh import remesh
from engine.result import EditResult, LevelResult
from engine.run import Memo, Run
from engine.selection import (
    connected_to,
    grown,
    inverted,
    shrunk,
    smoothed_border,
    without_specks,
)
from engine.silhouette import silhouette_chain
from engine.sketch import pressure_weights, resample_target, source_curve, tidy_stroke
from engine.solve import Factor, factorise
from engine.transfer import Transferred, TransferReport, transfer
from engine.view import View, look_at
