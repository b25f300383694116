"""The journal: every state of a document is on disk within moments, so that a kill loses nothing.

A journal is one file of checked records that only grows. Every state of the history that is handed
in is compared with the one before, and only what changed is written: arrays once by digest, meshes
as the rows that moved. The file is locked as long as its program lives, however that ends.
"""

from __future__ import annotations

import json
import os
import secrets
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal

import psutil
from numpy.typing import NDArray

from engine.document import HistoryState, Moment
from engine.errors import EngineError, FileError
from engine.filelock import try_lock
from engine.files.place import Stamp, push_folder, why_not_written
from engine.npy import npy_array, npy_header
from engine.packing import Packer, array_key, json_bytes
from engine.recipe import Kinds
from engine.records import DAMAGED, append_record, read_records
from engine.salvage import history_state, readable_moments, redo_links
from engine.unpacking import Unpacker

ENDING = ".journal"
FORMAT_VERSION = 1
REWRITE_ABOVE = 256 * 2**20
"""A journal that has grown by more bytes than this since it was begun is written anew."""
SET_ASIDE_DAYS = 7.0
"""How long work is kept that the person chose not to save."""

Why = Literal["crash", "closed", "set aside"]

_ARRAY, _JSON = 1, 2


class Journal:
    """One open journal file. One thread writes to it; another may push it to the disk meanwhile,
    and ends it.

    Parameters
    ----------
    folder : where journals are; made if it is not there.

    Raises
    ------
    FileError
        The file cannot be made or written.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file_note: tuple[str, Stamp | None] | None = None
        self._replaced: list[tuple[BinaryIO, Path]] = []
        self._begin()

    def _begin(self, instead_of: Path | None = None) -> None:
        """Start a file that holds nothing yet."""
        name = f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}-{secrets.token_hex(4)}{ENDING}"
        self.path = self._folder / name
        try:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._file: BinaryIO = self.path.open("xb", buffering=0)
        except OSError as error:
            raise _failure(error) from error
        try:
            self._start_file(instead_of)
        except EngineError:
            self._file.close()
            raise

    def _start_file(self, instead_of: Path | None) -> None:
        # Another program that looks for journals right now may hold an empty file for an instant.
        for _attempt in range(50):
            if try_lock(self._file) is not False:
                break
            time.sleep(0.02)
        self._packer = Packer(self._store, self._enter)
        self._written: dict[int, Moment] = {}
        self._place: tuple[int, dict[int, int]] | None = None
        self._whole_size = 0
        begun: dict[str, Any] = {"event": "begun", "eigenform": FORMAT_VERSION}
        if instead_of is not None:
            begun["instead_of"] = instead_of.name
        self._append(begun)

    def write(self, state: HistoryState) -> None:
        """Write what is new in `state`; when it returns, a kill of the program loses none of it."""
        if self._whole_size and self._file.tell() > self._whole_size + REWRITE_ABOVE:
            old = (self._file, self.path)
            try:
                self._begin(self.path)
                if self._file_note is not None:
                    self.belongs_to(*self._file_note)
                self._write(state)
            finally:
                # It goes once a power cut cannot take the new one.
                self._replaced.append(old)
            return
        self._write(state)

    def _write(self, state: HistoryState) -> None:
        changed = [m for i, m in state.moments.items() if self._written.get(i) is not m]
        gone = [i for i in self._written if i not in state.moments]
        if not changed and not gone and self._place == _place(state):
            return
        self._append_state(state, changed, gone)
        self._written = dict(state.moments)
        self._place = _place(state)
        self._whole_size = self._whole_size or self._file.tell()

    def _append_state(self, state: HistoryState, changed: list[Moment], gone: list[int]) -> None:
        # One record each, so that damage to one costs that moment only.
        for moment in changed:
            self._append({"event": "moment", "moment": self._packer.moment(moment)})
        self._append(
            {
                "event": "state",
                "changed": [moment.id for moment in changed],
                "gone": gone,
                "current": state.current_id,
                "redo": {str(parent): child for parent, child in state.redo.items()},
                "time": time.time(),
            }
        )

    def belongs_to(self, path: str, stamp: Stamp | None) -> None:
        """Note the file that the document is of, before a state that is not safe in it."""
        self._file_note = (path, stamp)
        self._append({"event": "saved", "path": path, "stamp": stamp})

    def saved(self, path: str, state: HistoryState, stamp: Stamp | None = None) -> None:
        """Note that `state` is safe in a file; what differs from it by now is still unsaved.

        The `stamp` is what the file had then.
        """
        newest = HistoryState(self._written, *self._place) if self._place else state
        self.belongs_to(path, stamp)
        if not same_state(newest, state):
            self._append_state(newest, [], [])

    def sync(self) -> None:
        """Have the bytes survive a power cut.

        Raises
        ------
        FileError
            The disk does not take them.
        """
        # In this order: what was replaced by now was replaced by this file or one before it.
        count = len(self._replaced)
        file = self._file
        try:
            os.fsync(file.fileno())
            push_folder(self._folder)
        except OSError as error:
            raise _failure(error) from error
        for _ in range(count):
            old, path = self._replaced.pop(0)
            old.close()
            path.unlink(missing_ok=True)

    def remove(self) -> None:
        """End the journal and its file: nothing in it is needed."""
        for file, path in (*self._replaced, (self._file, self.path)):
            file.close()
            path.unlink(missing_ok=True)

    def abandon(self) -> None:
        """Let go of a file that could not be written to; the next start finds what it holds."""
        for file, _path in (*self._replaced, (self._file, self.path)):
            file.close()

    def closed(self, why: Why) -> None:
        """Note why the document was closed."""
        self._append({"event": "closed", "why": why})

    def keep(self) -> None:
        """End the journal and keep its file for the next start."""
        try:
            self.sync()
        finally:
            self.abandon()

    def _store(self, _key: str, array: NDArray[Any]) -> None:
        self._record(_ARRAY, npy_header(array) + array.tobytes())

    def _enter(self, table: str, key: str, entry: dict[str, Any]) -> None:
        self._append({"event": "entry", "table": table, "key": key, "entry": entry})

    def _append(self, event: dict[str, Any]) -> None:
        self._record(_JSON, json_bytes(event))

    def _record(self, kind: int, payload: bytes) -> None:
        try:
            append_record(self._file, kind, payload)
        except OSError as error:
            raise _failure(error) from error


def _failure(error: OSError) -> FileError:
    fact, _ = why_not_written(error)
    return FileError(
        f"No recovery copy can be kept: {fact}. Save often until this is mended: a crash would "
        "cost what is not saved."
    )


def _place(state: HistoryState) -> tuple[int, dict[int, int]]:
    return state.current_id, dict(state.redo)


def same_state(a: HistoryState, b: HistoryState) -> bool:
    """Whether two states hold the same moments and the same one is open."""
    return (
        a.current_id == b.current_id
        and len(a.moments) == len(b.moments)
        and all(b.moments.get(i) is moment for i, moment in a.moments.items())
    )


def _stamp(data: Any) -> Stamp | None:
    if data is None:
        return None
    size, when = data
    return int(size), int(when)


@dataclass(eq=False)
class Recoverable:
    """A document that a journal holds; its journal stays locked until this is discarded.

    Parameters
    ----------
    path : the journal's file.
    state : the history, up to the last state that was written whole.
    saved_to : the file it was opened from or last saved to; "" if there is none.
    stamp : the stamp that this file had then; None if that is not known.
    why : "crash" when its program ended without closing it, "closed" when it was closed with
        unsaved changes and without a question, "set aside" when the person chose not to save.
    time : when the last state was written, in seconds since the epoch.
    report : what could not be read, in plain sentences.
    """

    path: Path
    state: HistoryState
    saved_to: str
    stamp: Stamp | None
    why: Why
    time: float
    report: tuple[str, ...]
    lock: BinaryIO

    @property
    def name(self) -> str:
        """The document's name, for a sentence."""
        return self.state.current.name or "untitled"

    def discard(self) -> None:
        """Remove the journal for good."""
        self.lock.close()
        self.path.unlink(missing_ok=True)

    def release(self) -> None:
        """Leave the journal for the next start."""
        self.lock.close()


def recover(folder: Path, kinds: Kinds) -> list[Recoverable]:
    """Return what can be restored from the journals in a folder, the newest first.

    Journals of programs that are running are left alone; those with nothing unsaved in them, and
    what was set aside too long ago, are removed.

    Parameters
    ----------
    folder : where journals are; it need not exist.
    kinds : the steps that are known.
    """
    found: list[Recoverable] = []
    replaced: set[str] = set()
    for path in sorted(folder.glob("*" + ENDING)):
        try:
            lock = path.open("r+b")
        except OSError:
            continue
        if not _ours_to_take(lock, path):
            lock.close()
            continue
        reading = _Reading()
        reading.read(path)
        if reading.moments and not reading.damaged:
            replaced.add(reading.instead_of)
        kept = reading.recoverable(path, kinds, lock) if reading.worth_keeping else None
        if kept is not None:
            found.append(kept)
        else:
            lock.close()
            if reading.worthless(path):
                path.unlink(missing_ok=True)
    # Killed after a long journal was written anew, before the old one was gone.
    for old in [one for one in found if one.path.name in replaced]:
        found.remove(old)
        old.discard()
    return sorted(found, key=lambda one: -one.time)


def _ours_to_take(lock: BinaryIO, path: Path) -> bool:
    """Whether no running program owns the journal."""
    free = try_lock(lock)
    if free is None:
        # The file system knows no locks: the process number in the name has to do.
        pid = path.stem.split("-")[-2] if path.stem.count("-") >= 3 else ""
        return not (pid.isdecimal() and psutil.pid_exists(int(pid)))
    return free


class _Reading:
    """What the records of one journal say."""

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}
        self.tables: dict[str, dict[str, Any]] = {"meshes": {}, "steps": {}}
        self.moments: dict[int, Any] = {}
        self.waiting: dict[int, Any] = {}
        self.current = -1
        self.redo: Any = {}
        self.time = 0.0
        self.saved_to = ""
        self.stamp: Stamp | None = None
        self.instead_of = ""
        self.unsaved = False
        self.why: Why = "crash"
        self.newer = False
        self.damaged = False

    def read(self, path: Path) -> None:
        """Go through all whole records; what is not understood is passed over."""
        for kind, payload in read_records(path):
            self.damaged = self.damaged or kind == DAMAGED
            try:
                if kind == _ARRAY:
                    array = npy_array(payload)
                    self.arrays[array_key(array)] = array
                elif kind == _JSON:
                    self._event(json.loads(payload))
            except (EngineError, ValueError, TypeError, KeyError, RecursionError):
                continue
        if not self.moments and self.waiting:
            # The record that ends the only state is lost: what it would have ended is not.
            self.moments, self.unsaved, self.time = self.waiting, True, path.stat().st_mtime

    def _event(self, event: dict[str, Any]) -> None:
        name = event["event"]
        if name == "begun":
            self.newer = event["eigenform"] > FORMAT_VERSION
            self.instead_of = str(event.get("instead_of", ""))
        elif name == "entry":
            self.tables[event["table"]][event["key"]] = event["entry"]
        elif name == "moment":
            self.waiting[int(event["moment"]["id"])] = event["moment"]
        elif name == "state":
            self._state(event)
        elif name == "saved":
            self.saved_to = str(event["path"])
            self.stamp = _stamp(event.get("stamp"))
            self.unsaved = False
        elif name == "closed" and event["why"] in ("crash", "closed", "set aside"):
            self.why = event["why"]

    def _state(self, event: dict[str, Any]) -> None:
        self.damaged = self.damaged or not set(event["changed"]) <= set(self.waiting)
        self.moments.update(self.waiting)
        self.waiting.clear()
        for number in event["gone"]:
            self.moments.pop(number, None)
        self.current = int(event["current"])
        self.redo = event["redo"]
        self.time = float(event["time"])
        self.unsaved = True

    @property
    def worth_keeping(self) -> bool:
        """Whether something would be lost without this journal."""
        old = time.time() - self.time > SET_ASIDE_DAYS * 86400
        return self.unsaved and not self.newer and not (self.why == "set aside" and old)

    def worthless(self, path: Path) -> bool:
        """Whether the file can be removed; a fresh empty one may be just begun by its owner."""
        fresh = time.time() - path.stat().st_mtime < 60
        empty = not self.moments and not self.arrays
        return not self.newer and not (empty and fresh)

    def recoverable(self, path: Path, kinds: Kinds, lock: BinaryIO) -> Recoverable | None:
        """Build the documents; None when no surface is left."""
        unpacker = Unpacker(self.tables["meshes"], self.tables["steps"], self._fetch, kinds)
        try:
            moments, report = readable_moments(self.moments.values(), unpacker)
            state, _ = history_state(moments, self.current, redo_links(self.redo))
        except EngineError:
            return None
        if self.damaged and not report:
            report.append(
                "The recovery copy is damaged in places: the last changes may be missing."
            )
        if state.current_id != self.current:
            report.append("What was open is lost; the newest state that is left is shown.")
        return Recoverable(
            path, state, self.saved_to, self.stamp, self.why, self.time, tuple(report), lock
        )

    def _fetch(self, key: str) -> NDArray[Any]:
        if key not in self.arrays:
            raise FileError("A part of it was not written to the end.")
        return self.arrays[key]
