"""The file worker: whatever happens in it costs one sentence, and the next file opens."""

from __future__ import annotations

import ctypes
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psutil
import pytest

from engine import FileError, Mesh, open_file, save
from engine.files import limits
from engine.files.process import FileWorker, WorkerDiedError, spawn, worker
from engine.files.report import CLEANING
from engine.io import start_worker
from tests import comma_locale
from tests.engine.test_io_open import tetrahedron, write
from tests.engine.test_io_shared import assert_says_it
from tests.program import PATIENCE, run_python
from tests.soak.export_kills import MORTAL, sheet


def test_the_worker_is_held_to_its_memory(tmp_path: Path) -> None:
    save(sheet(0, 300), tmp_path / "large.obj")
    path = write(tmp_path, "a.obj", tetrahedron())
    worker.stop()  # what another test had it free may be room enough
    open_file(path)
    assert worker.pid is not None
    process = psutil.Process(worker.pid)
    assert process.rlimit(psutil.RLIMIT_AS)[0] == limits.MEMORY
    tight = process.memory_info().vms + (8 << 20)
    process.rlimit(psutil.RLIMIT_AS, (tight, tight))
    with pytest.raises(FileError, match="GiB of memory") as refusal:
        open_file(tmp_path / "large.obj")
    assert_says_it("large.obj", str(refusal.value))
    assert open_file(tmp_path / "large.obj").mesh.n == 90_000


def test_the_worker_is_held_to_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save(sheet(0, 200), tmp_path / "a.obj")
    worker.stop()
    with monkeypatch.context() as patch:
        # Its start alone takes longer, on any machine.
        patch.setattr(limits, "seconds_for", lambda size: 1e-6)
        with pytest.raises(FileError, match="took longer than") as refusal:
            open_file(tmp_path / "a.obj")
    assert_says_it("a.obj", str(refusal.value))
    assert open_file(tmp_path / "a.obj").mesh.n == 40_000
    assert limits.seconds_for(1) == 20.0
    assert limits.seconds_for(1_000_000_000) == 100.0


def test_a_file_may_come_slowly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a network it comes in 6 seconds, while 4 would be too long without a sign of life."""
    path = write(tmp_path, "a.obj", tetrahedron())
    slow = FileWorker()
    slow.spawn = lambda: spawn("tests.soak.mortal_worker", "slow")
    monkeypatch.setattr("engine.io.worker", slow)
    try:
        open_file(path)  # what a start takes is not the drive's
        monkeypatch.setattr(limits, "seconds_for", lambda size: 1.0)
        assert open_file(path).mesh.n == 4
    finally:
        slow.stop()


def test_a_crash_of_native_code_costs_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save(sheet(0), tmp_path / "whole.glb")
    worker.stop()
    with monkeypatch.context() as patch:
        patch.setattr(worker, "spawn", lambda: spawn(MORTAL, "reader"))
        plain = write(tmp_path, "a.obj", tetrahedron())
        assert open_file(plain).mesh.n == 4
        before = worker.pid
        place = tmp_path / "temporary"
        place.mkdir()
        patch.setenv("TMPDIR", str(place))
        patch.setattr("tempfile.tempdir", str(place))
        worker.stop()
        with pytest.raises(FileError, match="its content stopped the reader") as refusal:
            open_file(tmp_path / "whole.glb")
        assert list(place.iterdir()) == [], "no copy of the file may be left"
        assert_says_it("whole.glb", str(refusal.value))
        assert open_file(plain).mesh.n == 4
        assert worker.pid not in (before, None)
    worker.stop()
    assert open_file(tmp_path / "whole.glb").mesh.n == sheet(0).n


@pytest.mark.skipif(sys.platform == "win32", reason="the system ends processes otherwise there")
def test_a_crash_inside_cleanup_opens_the_file_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = sheet(0, 150)
    # Points that no face uses are removed by a native filter; this worker dies in any such.
    save(Mesh(np.vstack([whole.vertices, [[-9.0, -9.0, -9.0]]]), whole.faces), tmp_path / "a.ply")
    worker.stop()
    with monkeypatch.context() as patch:
        patch.setattr(worker, "spawn", lambda: spawn(MORTAL, "filter"))
        with pytest.raises(WorkerDiedError) as died:
            worker.ask(
                {"job": "import", "path": str(tmp_path / "a.ply"), "name": "a.ply", "clean": True},
                None,
                20.0,
                None,
            )
        assert died.value.stage == CLEANING
        found = open_file(tmp_path / "a.ply")
    assert found.mesh.n == whole.n + 1
    assert found.mesh is found.as_read
    assert np.array_equal(found.mesh.faces, whole.faces)
    assert found.report.repairs == ()
    assert "Cleanup could not cope with this mesh" in found.report.warnings[-1]
    # The next file, in a worker that lives, is cleaned as ever.
    worker.stop()
    assert open_file(tmp_path / "a.ply").mesh.n == whole.n


def test_a_worker_killed_between_files_is_replaced(tmp_path: Path) -> None:
    path = write(tmp_path, "a.obj", tetrahedron())
    open_file(path)
    assert worker.pid is not None
    process = psutil.Process(worker.pid)
    process.kill()
    process.wait(PATIENCE)
    assert open_file(path).mesh.n == 4


@pytest.mark.skipif(sys.platform == "win32", reason="it does not tell who ended a process")
def test_a_worker_killed_while_it_reads_is_not_the_files_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path, "a.obj", tetrahedron())
    starts: list[str] = []

    def killed_times(count: int) -> FileWorker:
        one = FileWorker()
        starts.clear()

        def start() -> subprocess.Popen[bytes]:
            starts.append("killed" if len(starts) < count else "")
            return spawn(MORTAL, starts[-1])

        one.spawn = start
        monkeypatch.setattr("engine.io.worker", one)
        return one

    for count in (1, 2):
        mortal = killed_times(count)
        try:
            if count == 1:
                assert open_file(path).mesh.n == 4
            else:
                with pytest.raises(FileError, match="twice the system ended") as refusal:
                    open_file(path)
                assert_says_it("a.obj", str(refusal.value))
            assert starts[:2] == ["killed", "killed" if count == 2 else ""]
        finally:
            mortal.stop()


def test_native_code_reads_one_strangers_file_in_a_process(tmp_path: Path) -> None:
    """What a damaged one does to its memory must not show in the next file."""
    plain, native = tmp_path / "plain.ply", tmp_path / "native.glb"
    for path in (plain, native):
        save(sheet(0), path)
    open_file(plain)
    before = worker.pid
    found = open_file(native)
    assert found.mesh.n == sheet(0).n
    assert worker.pid != before
    damaged = native.read_bytes().replace(b"VEC3", b"VEC9")
    native.write_bytes(damaged)
    before = worker.pid
    with pytest.raises(FileError):
        open_file(native)
    open_file(plain)
    assert worker.pid == before, "it was refused before native code saw it"


def test_two_threads_take_turns(tmp_path: Path) -> None:
    found: dict[int, int] = {}

    def open_one(i: int) -> None:
        found[i] = open_file(tmp_path / f"{i}.obj").mesh.n

    for i in range(6):
        save(sheet(0, 5 + i), tmp_path / f"{i}.obj")
    threads = [threading.Thread(target=open_one, args=(i,)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert found == {i: (5 + i) ** 2 for i in range(6)}


def test_a_warm_worker_opens_every_further_file(tmp_path: Path) -> None:
    start_worker()
    save(sheet(0, 5), tmp_path / "a.ply")
    warm = worker.pid
    assert warm is not None
    for _ in range(3):
        open_file(tmp_path / "a.ply")
        assert worker.pid == warm, "none is started for it"


def test_a_script_without_a_main_guard_can_open_files(tmp_path: Path) -> None:
    write(tmp_path, "a.obj", tetrahedron())
    script = write(tmp_path, "script.py", "import engine\nprint(engine.load('a.obj').n)\n")
    done = run_python(str(script), cwd=tmp_path)
    assert (done.stdout.strip(), done.stderr.strip()) == ("4", "")


def test_the_worker_ends_when_its_program_is_killed(tmp_path: Path) -> None:
    write(tmp_path, "a.obj", tetrahedron())
    code = (
        "import engine, os, signal; from engine.files.process import worker\n"
        "engine.load('a.obj'); print(worker.pid, flush=True); os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = run_python("-c", code, cwd=tmp_path)
    pid = int(done.stdout)
    limit = time.monotonic() + PATIENCE
    while psutil.pid_exists(pid) and time.monotonic() < limit:
        time.sleep(0.02)
    assert not psutil.pid_exists(pid)


class Kernel:
    """Plays kernel32 as its documentation tells it; called through the declared signatures."""

    def __init__(self, refuses: str = "") -> None:
        self.calls: list[tuple[str, tuple[object, ...]]] = []
        for name, (result, arguments) in limits.SIGNATURES.items():
            play = self._play(name, refuses)
            setattr(self, name, ctypes.CFUNCTYPE(result, *arguments)(play))

    def _play(self, name: str, refuses: str) -> Callable[..., int]:
        def play(*given: object) -> int:
            if name == "SetInformationJobObject":
                address = given[2]
                assert isinstance(address, int)
                held = limits.ExtendedLimits.from_address(address)
                flags = held.BasicLimitInformation.LimitFlags
                given = (*given[:2], flags, held.ProcessMemoryLimit, given[3])
            self.calls.append((name, given))
            if name == refuses:
                return 0
            # A handle that 32 bits do not hold.
            return 0x1_2345_6788 if name == "CreateJobObjectW" else 1

        return play


def test_a_windows_job_is_set_up_as_documented() -> None:
    if ctypes.sizeof(ctypes.c_void_p) == 8:
        assert ctypes.sizeof(limits.BasicLimits) == 64
        assert ctypes.sizeof(limits.ExtendedLimits) == 144
        assert limits.ExtendedLimits.ProcessMemoryLimit.offset == 112
    kernel = Kernel()
    job = limits.windows_job(kernel, 0x9_8765_4320)
    assert job == 0x1_2345_6788
    kill_and_memory = 0x2000 | 0x100
    size = ctypes.sizeof(limits.ExtendedLimits)
    assert kernel.calls == [
        ("CreateJobObjectW", (None, None)),
        ("SetInformationJobObject", (job, 9, kill_and_memory, limits.MEMORY, size)),
        ("AssignProcessToJobObject", (job, 0x9_8765_4320)),
    ]


@pytest.mark.parametrize("refuses", list(limits.SIGNATURES)[:3])
def test_a_windows_job_that_is_refused_is_let_go(
    refuses: str, caplog: pytest.LogCaptureFixture
) -> None:
    kernel = Kernel(refuses)
    assert limits.windows_job(kernel, 5) is None
    closed = [given for name, given in kernel.calls if name == "CloseHandle"]
    assert closed == ([] if refuses == "CreateJobObjectW" else [(0x1_2345_6788,)])


COMMA_SCRIPT = textwrap.dedent("""
    import locale, sys
    locale.setlocale(locale.LC_ALL, "")
    assert locale.localeconv()["decimal_point"] == ",", "no comma locale"
    import numpy as np, engine
    from engine.io import EXPORT_SUFFIXES
    mesh = engine.load(sys.argv[1])
    assert mesh.vertices.max() == 0.348, mesh.vertices.max()
    for suffix in EXPORT_SUFFIXES:
        engine.save(mesh, "out" + suffix)
        assert abs(engine.load("out" + suffix).vertices.max() - 0.348) < 1e-7, suffix
    # pymeshlab reads this one: its numbers are what the locale of the worker says.
    strips = engine.load("strips.ply")
    assert abs(strips.vertices.max() - 0.348) < 1e-6, strips.vertices
    print("right")
""")


STRIPS = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element tristrips 1
property list int int vertex_indices
end_header
0 0 0
0.348 0 0
0 0.348 0
0.348 0.348 0
4 0 1 2 3
"""


def test_a_comma_desktop_destroys_no_number(tmp_path: Path) -> None:
    """Runs a program that really calls setlocale under de_DE.UTF-8, as Qt does at its start."""
    comma = comma_locale.make("de_DE.UTF-8", tmp_path / "locales")
    if not comma:
        pytest.skip("the locale de_DE.UTF-8 cannot be made here")
    write(tmp_path, "a.obj", tetrahedron(0.348))
    write(tmp_path, "strips.ply", STRIPS)
    done = run_python("-c", COMMA_SCRIPT, "a.obj", cwd=tmp_path, **comma)
    assert done.stdout.strip() == "right", done.stderr


@pytest.mark.parametrize(
    ("job", "stage", "killed", "asked"),
    [
        ("import", "Reading", True, 2),
        ("import", "Reading", False, 1),
        ("export", "Writing", True, 1),
        ("export", "Writing", False, 1),
        ("export", "Starting", True, 2),
        ("import", "Starting", False, 2),
    ],
)
def test_a_job_is_done_again_only_where_its_end_was_not_its_fault(
    job: str, stage: str, killed: bool, asked: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asking, replaced = [], []

    def ask(self: FileWorker, *given: object) -> None:
        asking.append(given)
        raise WorkerDiedError(stage, killed)

    monkeypatch.setattr(FileWorker, "_ask", ask)
    monkeypatch.setattr(FileWorker, "_replace", lambda self: replaced.append(self))
    with pytest.raises(WorkerDiedError) as lost:
        FileWorker().ask({"job": job}, None, 1.0, None)
    assert lost.value.stage == stage
    assert len(asking) == asked
    assert len(replaced) == 1
