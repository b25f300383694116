"""Saving: the same mesh to the last bit where the format can, and never half a file."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import psutil
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from engine import Cancelled, Document, FileError, History, Mesh, open_file, save
from engine.archive import save_archive
from engine.files.place import write_file
from engine.files.process import FileWorker, spawn, worker
from engine.io import EXPORT_SUFFIXES, start_worker, sweep_strays
from tests.engine.test_io_open import cancelled_at
from tests.program import PATIENCE, run_python
from tests.soak.export_kills import run as kill_often
from tests.soak.export_kills import sheet
from tests.soak.plain_readers import read_plainly

EXACT = (".obj", ".ply", ".off", ".3mf")
IS_ROOT = os.name == "posix" and os.geteuid() == 0


def awkward_mesh() -> Mesh:
    """Return a mesh with what exporters like to tidy away, and with all 53 bits in use."""
    flat = sheet(0)
    vertices = np.vstack([flat.vertices * np.pi / 3, flat.vertices[:1] * np.pi, [[9.1, 9.2, 9.3]]])
    faces = np.vstack([flat.faces, flat.faces[:2], [[5, 5, 6]]])
    return Mesh(vertices, faces)


@pytest.mark.parametrize("suffix", EXACT)
def test_a_saved_mesh_comes_back_to_the_last_bit(tmp_path: Path, suffix: str) -> None:
    mesh = awkward_mesh()
    report = save(mesh, tmp_path / f"a{suffix}")
    assert report.precision == 0.0
    found = open_file(tmp_path / f"a{suffix}", clean=False)
    assert found.mesh.digest == mesh.digest
    vertices, polygons = read_plainly((tmp_path / f"a{suffix}").read_bytes(), suffix[1:].upper())
    assert (np.array(vertices) == mesh.vertices).all()
    assert (np.array(polygons) == mesh.faces).all()


@pytest.mark.parametrize("suffix", [".stl", ".glb"])
def test_single_precision_is_said_and_met(tmp_path: Path, suffix: str) -> None:
    mesh = Mesh(sheet(0).vertices * np.pi, sheet(0).faces)
    report = save(mesh, tmp_path / f"a{suffix}")
    assert "single precision" in report.lines()[1]
    got = trimesh.load_mesh(tmp_path / f"a{suffix}", process=False)
    assert np.asarray(got.triangles).dtype.kind == "f"
    off = np.abs(np.asarray(got.triangles) - mesh.vertices[mesh.faces]).max()
    assert 0 < off <= report.precision * np.abs(mesh.vertices).max()


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".off"])
def test_an_independent_library_reads_the_same(tmp_path: Path, suffix: str) -> None:
    mesh = Mesh(sheet(0).vertices * np.pi, sheet(0).faces)
    save(mesh, tmp_path / f"a{suffix}")
    got = trimesh.load_mesh(tmp_path / f"a{suffix}", process=False, maintain_order=True)
    assert np.allclose(got.vertices, mesh.vertices, rtol=1e-15, atol=0)
    assert (got.faces == mesh.faces).all()


def test_meshlab_reads_the_3mf(tmp_path: Path) -> None:
    mesh = sheet(0)
    save(mesh, tmp_path / "a.3mf")
    code = (
        "import pymeshlab as p; s = p.MeshSet(); s.load_new_mesh('a.3mf'); m = s.current_mesh();"
        "print(m.vertex_number(), m.face_number(), *m.bounding_box().max())"
    )
    done = run_python("-c", code, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    n, f, *corner = done.stdout.split()[-5:]
    assert (int(n), int(f)) == (mesh.n, len(mesh.faces))
    assert np.allclose([float(c) for c in corner], mesh.bounds[1], atol=1e-4)


coordinates = st.floats(-1e20, 1e20, allow_nan=False, allow_subnormal=False)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=3, max_size=8))
def test_any_double_survives(tmp_path: Path, points: list[tuple[float, float, float]]) -> None:
    # One proper triangle more, so that there is always a surface to open.
    vertices = np.vstack([np.array(points), [[0, 0, 0], [1e20, 0, 0], [0, 1e20, 1]]])
    n = len(points)
    mesh = Mesh(vertices, [[0, 1, 2], [n, n + 1, n + 2]])
    for suffix in EXACT:
        save(mesh, tmp_path / f"a{suffix}")
        got = open_file(tmp_path / f"a{suffix}", clean=False).mesh
        assert (got.vertices == mesh.vertices).all()
        assert (got.faces == mesh.faces).all()


@pytest.mark.parametrize("suffix", EXPORT_SUFFIXES)
def test_the_same_mesh_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    for name in ("a", "b"):
        save(sheet(0), tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def assert_old_file_whole(target: Path, before: bytes) -> None:
    assert target.read_bytes() == before
    assert [p.name for p in target.parent.iterdir()] == [target.name]


@pytest.mark.parametrize("suffix", EXPORT_SUFFIXES)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.95])
def test_a_file_that_may_not_grow_leaves_the_old_one_whole(
    tmp_path: Path, suffix: str, share: float
) -> None:
    target = tmp_path / f"a{suffix}"
    save(sheet(0), target)
    before = target.read_bytes()
    assert worker.pid is not None
    most = int(share * len(before))
    process = psutil.Process(worker.pid)
    free = process.rlimit(psutil.RLIMIT_FSIZE)
    process.rlimit(psutil.RLIMIT_FSIZE, (most, free[1]))
    try:
        with pytest.raises(FileError, match="was not saved") as refusal:
            save(sheet(1), target)
    finally:
        if process.is_running():
            process.rlimit(psutil.RLIMIT_FSIZE, free)
    assert target.name in str(refusal.value)
    assert "unchanged" in str(refusal.value)
    assert_old_file_whole(target, before)


@contextlib.contextmanager
def mounted(folder: Path, options: str) -> Iterator[Path]:
    """Mount a memory file system on `folder`, or skip where that is not allowed."""
    folder.mkdir()
    if not IS_ROOT:
        pytest.skip("only root can mount a small disk")
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    if subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False).returncode:
        pytest.skip("mounting is not allowed here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], timeout=PATIENCE, check=True)


@pytest.mark.parametrize("suffix", EXPORT_SUFFIXES)
def test_a_full_disk_leaves_the_old_file_whole(tmp_path: Path, suffix: str) -> None:
    with mounted(tmp_path / "disk", "size=600k") as disk:
        target = disk / f"a{suffix}"
        save(sheet(0, 12), target)
        before = target.read_bytes()
        room = disk / "room"
        with contextlib.suppress(OSError):
            room.write_bytes(bytes(1 << 20))
        with room.open("r+b") as file:
            file.truncate(room.stat().st_size // 4096 * 4096 - 8192)
        with pytest.raises(FileError, match="the disk is full"):
            save(sheet(1, 60), target)
        assert target.read_bytes() == before
        assert sorted(p.name for p in disk.iterdir()) == sorted([target.name, "room"])


def test_a_disk_that_can_only_be_read_is_named(tmp_path: Path) -> None:
    with (
        mounted(tmp_path / "disk", "ro") as disk,
        pytest.raises(FileError, match="can only be read"),
    ):
        save(sheet(0), disk / "a.obj")


@pytest.mark.skipif(IS_ROOT, reason="root may write everywhere")
def test_a_folder_without_permission_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(FileError, match="writing is not allowed there"):
        save(sheet(0), tmp_path / "a.obj")


@pytest.mark.parametrize(
    ("name", "why"),
    [("none/a.obj", "folder is not there"), ("a.xyz", "no format that can be written"),
     ("a", "no format"), ("a.obj/", "there is a folder of that name"),
     ("x" * 300 + ".obj", "name is too long"), ("a\0.obj", "cannot be used")],
)  # fmt: skip
def test_a_target_that_cannot_be_is_refused(tmp_path: Path, name: str, why: str) -> None:
    if name.endswith("/"):
        (tmp_path / name).mkdir()
    with pytest.raises(FileError, match=why):
        save(sheet(0), f"{tmp_path}/{name}")
    assert len(list(tmp_path.iterdir())) == name.endswith("/")


NAMES = [
    "Größe.ply",
    "模型.stl",
    "🚗 design.obj",
    'it\'s "quoted" $HOME; *.3mf',
    "x" * 196 + ".off",
]


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_any_name_and_folder_can_be_saved_to(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "Ordner für 模型 🚗"
    folder.mkdir()
    save(sheet(0), folder / name)
    assert open_file(folder / name).mesh.n == sheet(0).n
    assert [p.name for p in folder.iterdir()] == [name]


@pytest.mark.skipif(sys.platform == "win32", reason="it lets nobody replace a file that is open")
@pytest.mark.parametrize("how", ["mesh", "document", "small file"])
def test_who_reads_the_old_file_still_has_all_of_it(how: str, tmp_path: Path) -> None:
    """The new one takes the name in one step; not a byte of the old one is touched."""
    path = tmp_path / ("a.eigenform" if how == "document" else "a.obj")
    writes: dict[str, Callable[[int], object]] = {
        "mesh": lambda i: save(sheet(i), path),
        "document": lambda i: save_archive(path, History(Document.open(sheet(i), "a")).state()),
        "small file": lambda i: write_file(path, bytes([i]) * 1000),
    }
    writes[how](0)
    before = path.read_bytes()
    with path.open("rb") as held:
        writes[how](1)
        assert held.read() == before
        assert path.stat().st_ino != os.fstat(held.fileno()).st_ino
    assert path.read_bytes() != before


@pytest.mark.parametrize("suffix", EXPORT_SUFFIXES)
def test_what_reads_back_wrong_never_takes_the_name(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{suffix}"
    save(sheet(0), path)
    before = path.read_bytes()
    wrong = FileWorker()
    wrong.spawn = lambda: spawn("tests.soak.mortal_worker", "wrong")
    monkeypatch.setattr("engine.io.worker", wrong)
    try:
        with pytest.raises(FileError, match=r"was not saved: (what was written did|the writer)"):
            save(sheet(1), path)
    finally:
        wrong.stop()
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_saving_through_a_link_keeps_the_link(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    far, link = tmp_path / "far" / "a.obj", tmp_path / "link.obj"
    save(sheet(0), far)
    far.chmod(0o640)
    link.symlink_to(far)
    save(sheet(1), link)
    assert link.is_symlink()
    assert open_file(far).mesh.digest == sheet(1).digest
    assert far.stat().st_mode & 0o777 == 0o640


def test_a_cancelled_save_leaves_the_old_file_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.obj"
    save(sheet(0), target)
    before = target.read_bytes()
    for stage in ("Writing", "Reading back"):
        with pytest.raises(Cancelled):
            save(sheet(1, 200), target, cancelled_at(stage))
        assert_old_file_whole(target, before)


def test_strays_of_dead_programs_are_swept_and_those_of_the_living_stay(tmp_path: Path) -> None:
    save(sheet(0), tmp_path / "a.obj")
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait(30)
    code = (
        "import sys, os; from pathlib import Path; from engine.files.place import beside\n"
        "with beside(Path(sys.argv[1]), '.obj') as part: part.write_text('half'); os._exit(9)"
    )
    root = Path(__file__).resolve().parents[2]
    program = [sys.executable, "-c", code, str(tmp_path / "b.obj")]
    subprocess.run(program, cwd=root, timeout=PATIENCE, check=False)
    (stray,) = tmp_path.glob(".eigenform-part-*")
    host = stray.name.split("-")[2]
    alive = tmp_path / f".eigenform-part-{host}-{os.getpid()}-00000000.obj"
    elsewhere = tmp_path / f".eigenform-part-00000000-{dead.pid}-00000000.obj"
    old = tmp_path / f".eigenform-part-00000000-{dead.pid}-00000001.obj"
    own = tmp_path / ".eigenform-part-of-my-own.obj"
    for path in (alive, elsewhere, old, own):
        path.write_text("half")
    os.utime(old, (time.time() - 100_000,) * 2)
    assert sorted(sweep_strays(tmp_path)) == sorted([stray, old])
    assert alive.exists()
    assert elsewhere.exists()
    assert own.exists()
    assert (tmp_path / "a.obj").exists()
    assert sweep_strays(tmp_path / "none") == []


def test_kills_inside_a_save_never_leave_half_a_file(tmp_path: Path) -> None:
    start_worker()
    tally = kill_often(8, seed=5, folder=tmp_path, programs=0.2)
    assert tally.faults == []
    assert tally.kills.total() == 8
    assert tally.kills["worker, at a byte"] >= 2
    assert tally.kills["program, at a moment"]


@pytest.mark.soak
@pytest.mark.timeout(7200)
def test_a_thousand_kills_never_leave_half_a_file(tmp_path: Path) -> None:
    tally = kill_often(1000, seed=1, folder=tmp_path, forked=True)
    assert tally.faults == []
    for way in ("worker, at a byte", "worker, at a moment", "document, at a byte"):
        assert tally.kills[way] > 10
