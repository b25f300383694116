"""The `.eigenform` document file: one zip of a JSON manifest, arrays and pictures.

Layout: `mimetype`, `manifest.json`, `arrays/<sha-256>.npy` for every array once,
`pictures/<id>.png` for the moments, and `manifest-copy.json` at the end. Nothing is compressed: a
member can then never be larger than the file, a flipped bit hurts one member only, and members can
be found again without the directory at the end of a zip. Nothing is ever unpacked to disk, and
nothing is unpickled.
"""

from __future__ import annotations

import io
import json
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from engine.document import Document, History, HistoryState, Moment
from engine.errors import Cancelled, EngineError, FileError
from engine.files.place import (
    Stamp,
    beside,
    put_in_place,
    readable_size,
    reading_sentence,
    real_target,
    refuse_changed,
    stamp_of,
    sweep_strays,
)
from engine.files.report import shown
from engine.mesh import Mesh
from engine.npy import npy_array, npy_header
from engine.packing import Packer, array_key, json_bytes
from engine.recipe import Kinds
from engine.run import Run
from engine.salvage import history_state, readable_moments, redo_links
from engine.unpacking import Unpacker

if TYPE_CHECKING:
    from typing_extensions import Buffer

DOCUMENT_SUFFIX = ".eigenform"
FORMAT_VERSION = 1
MIMETYPE = b"application/x-eigenform"
MANIFEST, MANIFEST_COPY = "manifest.json", "manifest-copy.json"
MANIFEST_LIMIT = 256 * 2**20
MEMBER_LIMIT = 200_000

_NAME = re.compile(
    r"mimetype|manifest(-copy)?\.json|arrays/[0-9a-f]{64}\.npy|pictures/\d{1,9}\.png"
)
# Of a member's header in a zip file: signature, version, flags, method, time, CRC, sizes, lengths.
_LOCAL_HEADER = struct.Struct("<4sHHHIIIIHH")


@dataclass(frozen=True, eq=False)
class Archive:
    """What a document file holds.

    Parameters
    ----------
    state : the history with all its documents.
    pictures : PNG bytes of the moments that have one, by the moment's id.
    window : what the window wants to find again, as plain JSON (its camera, for one).
    report : what could not be read, in plain sentences; empty when the file is whole.
    stamp : of the file that was read, for `save_archive`.
    """

    state: HistoryState
    pictures: Mapping[int, bytes] = field(default_factory=lambda: MappingProxyType({}))
    window: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    report: tuple[str, ...] = ()
    stamp: Stamp | None = None

    @property
    def history(self) -> History:
        """A history that goes on from here."""
        return History.from_state(self.state)


def save_archive(
    path: str | Path,
    state: HistoryState,
    pictures: Mapping[int, bytes] | None = None,
    window: Mapping[str, Any] | None = None,
    known: Stamp | None = None,
) -> Stamp | None:
    """Write a history as a document file; the same history gives the same bytes.

    Returns the stamp of what was written.

    Parameters
    ----------
    path : the file to write or replace.
    state : `History.state()`.
    pictures : PNG bytes by moment id.
    window : plain JSON that is handed back on opening.
    known : the stamp that the file had when it was opened or saved here; None replaces anything.

    Raises
    ------
    FileError
        The file cannot be written, was changed by somebody else meanwhile, or reads back wrong; the
        old file is unchanged then.
    """
    arrays: dict[str, NDArray[Any]] = {}
    tables: dict[str, dict[str, Any]] = {"meshes": {}, "steps": {}}
    packer = Packer(arrays.__setitem__, lambda table, key, e: tables[table].__setitem__(key, e))
    manifest: dict[str, Any] = {
        "eigenform": FORMAT_VERSION,
        "moments": [packer.moment(moment) for moment in state.moments.values()],
        "current": state.current_id,
        "redo": {str(parent): child for parent, child in state.redo.items()},
        "window": dict(window or {}),
        **tables,
        "arrays": {key: [a.dtype.str, list(a.shape)] for key, a in arrays.items()},
    }
    text = json_bytes(manifest)
    if len(text) > MANIFEST_LIMIT:
        raise FileError("The history is too long to be saved. Save one of its states as a mesh.")
    kept = {i: png for i, png in (pictures or {}).items() if i in state.moments}

    target = Path(path)
    sweep_strays(real_target(target).parent)
    with beside(target, DOCUMENT_SUFFIX) as part:
        with part.open("r+b") as file:
            _write(file, text, arrays, kept)
            file.flush()
            os.fsync(file.fileno())
        _check_whole(part, shown(target.name))
        if known is not None:
            refuse_changed(target, known)
        put_in_place(part, target)
        return stamp_of(target)


def _write(
    file: BinaryIO,
    manifest: bytes,
    arrays: Mapping[str, NDArray[Any]],
    pictures: Mapping[int, bytes],
) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        _add(archive, "mimetype", MIMETYPE)
        _add(archive, MANIFEST, manifest)
        for key, array in arrays.items():
            _add(archive, f"arrays/{key}.npy", npy_header(array), array.data)
        for i, png in sorted(pictures.items()):
            _add(archive, f"pictures/{i}.png", png)
        _add(archive, MANIFEST_COPY, manifest)


def _add(archive: zipfile.ZipFile, name: str, *parts: Buffer) -> None:
    views = [memoryview(part) for part in parts]
    size = sum(view.nbytes for view in views)
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.file_size = size
    with archive.open(info, "w", force_zip64=size >= 2**31) as member:
        for view in views:
            # A view of an array without elements cannot be cast.
            if view.nbytes:
                member.write(view.cast("B"))


def _check_whole(path: Path, name: str) -> None:
    """Read every member back: check sums, and the digest of every array."""
    try:
        members = _Members(path)
        if members.report:
            raise FileError(members.report[0])
        for member in members.names():
            data = members.read(member)
            if member.startswith("arrays/"):
                _array(data, member[7:-4])
    except FileError as error:
        raise FileError(
            f"“{name}” was not saved: what was written reads back wrong ({error}) "
            "Choose another disk; what was there before is unchanged."
        ) from error


def open_archive(path: str | Path, kinds: Kinds, run: Run | None = None) -> Archive:
    """Read a document file; a damaged one gives back what can be saved, and says so.

    Parameters
    ----------
    path : the file.
    kinds : the steps that are known; others are kept as they were written.
    run : progress and cancel, for a damaged file whose surfaces are computed again.

    Raises
    ------
    FileError
        It is not a document file, was made by a newer version, holds what no document holds, or is
        damaged so that no surface is left.
    """
    path = Path(path)
    readable_size(path)
    name = shown(path.name)
    # Taken first: what is written while it is read makes it another one.
    stamp = stamp_of(path)
    try:
        return replace(_Reading(path, kinds, run).archive(), stamp=stamp)
    except Cancelled:
        raise
    except OSError as error:
        raise FileError(reading_sentence(name, error)) from error
    except _NewerError as error:
        raise FileError(
            f"“{name}” cannot be opened. {error} Update Eigenform to open it."
        ) from error
    except EngineError as error:
        raise FileError(
            f"“{name}” cannot be opened. {error} Open an earlier copy of it, or another file."
        ) from error
    except (MemoryError, RecursionError) as error:
        raise FileError(
            f"“{name}” cannot be opened: what it holds does not fit into memory. "
            "Close other programs and open it again."
        ) from error


class _NewerError(FileError):
    """It was saved by a newer version of the program."""


class _Members:
    """The members of the file by name, found through its directory or, failing that, by search."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.report: list[str] = []
        with path.open("rb") as file:
            if file.read(4) != b"PK\x03\x04":
                raise FileError("It is not an Eigenform document.")
        try:
            self._places = self._by_directory()
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, ValueError, struct.error):
            self._places = _by_search(path)
            self.report.append("The end of the file is missing or damaged.")
        if "mimetype" not in self._places and MANIFEST not in self._places:
            raise FileError("It is a zip file, but not an Eigenform document.")

    def _by_directory(self) -> dict[str, tuple[int, int, int]]:
        size = self._path.stat().st_size
        places: dict[str, tuple[int, int, int]] = {}
        with zipfile.ZipFile(self._path) as archive:
            infos = archive.infolist()
        if len(infos) > MEMBER_LIMIT:
            raise FileError(f"It has {len(infos)} parts, far more than a document can have.")
        if not {info.filename for info in infos} & {"mimetype", MANIFEST, MANIFEST_COPY}:
            raise FileError("It is a zip file, but not an Eigenform document.")
        for info in infos:
            if not _NAME.fullmatch(info.filename):
                raise FileError(
                    f"It has a part named {info.filename[:60]!r}, which no document has."
                )
            if info.filename in places:
                raise FileError(f"It has the part {info.filename!r} twice.")
            if info.compress_type != zipfile.ZIP_STORED or info.file_size != info.compress_size:
                raise FileError("It has a compressed part, which no document has.")
            places[info.filename] = (info.header_offset, info.file_size, info.CRC)
        if sum(place[1] for place in places.values()) > size:
            raise FileError("Its parts claim to be larger than the file.")
        return places

    def names(self) -> list[str]:
        """All names, in the order of the file."""
        return sorted(self._places, key=lambda name: self._places[name][0])

    def size(self, name: str) -> int:
        """The size of a member in bytes."""
        return self._places[name][1]

    def read(self, name: str) -> bytes:
        """Return a member's bytes; raises `FileError` when it is absent or its sum is wrong."""
        if name not in self._places:
            raise FileError(f"The part {name} is missing.")
        offset, size, crc = self._places[name]
        with self._path.open("rb") as file:
            file.seek(offset)
            header = file.read(_LOCAL_HEADER.size)
            if len(header) < _LOCAL_HEADER.size or header[:4] != b"PK\x03\x04":
                raise FileError(f"The part {name} is damaged.")
            lengths = _LOCAL_HEADER.unpack(header)[-2:]
            file.seek(sum(lengths), io.SEEK_CUR)
            data = file.read(size)
        if len(data) != size or zlib.crc32(data) != crc:
            raise FileError(f"The part {name} is damaged.")
        return data


def _by_search(path: Path) -> dict[str, tuple[int, int, int]]:
    """Find members by the headers in front of them, for a file whose directory is lost."""
    places: dict[str, tuple[int, int, int]] = {}
    data = path.read_bytes()
    at = data.find(b"PK\x03\x04")
    while at >= 0 and len(places) < MEMBER_LIMIT:
        step = 4
        if at + _LOCAL_HEADER.size <= len(data):
            fields = _LOCAL_HEADER.unpack_from(data, at)
            crc, size, name_length, extra = fields[5], fields[7], fields[8], fields[9]
            start = at + _LOCAL_HEADER.size
            name = data[start : start + name_length].decode("ascii", "replace")
            if size == 0xFFFFFFFF and extra >= 20:
                size = struct.unpack_from("<Q", data, start + name_length + 4)[0]
            start += name_length + extra
            whole = fields[3] == zipfile.ZIP_STORED and start + size <= len(data)
            if _NAME.fullmatch(name) and whole and name not in places:
                places[name] = (at, size, crc)
                step = start + size - at
        at = data.find(b"PK\x03\x04", at + step)
    return places


def _array(data: bytes, key: str) -> NDArray[Any]:
    """Return the array in a member; it must be the one that its name says."""
    array = npy_array(data)
    if array_key(array) != key:
        raise FileError("An array is not the one it is named for.")
    return array


class _Reading:
    """One reading of a file: what it gives, and what was lost on the way."""

    def __init__(self, path: Path, kinds: Kinds, run: Run | None) -> None:
        self._members = _Members(path)
        self._kinds = kinds
        self._run = run
        self._report = self._members.report
        self._arrays: dict[str, NDArray[Any]] = {}

    def archive(self) -> Archive:
        manifest = self._manifest()
        if manifest is None:
            return self._surface_alone()
        moments = self._moments(manifest)
        current = manifest.get("current")
        if type(current) is not int:
            current = -1
        state, rehung = history_state(moments, current, redo_links(manifest.get("redo")))
        if current != state.current_id:
            self._report.append("What was open is lost; the newest state that is left is shown.")
        if rehung:
            self._report.append(f"{rehung} states have lost the one they came from.")
        window = manifest.get("window")
        return Archive(
            state,
            MappingProxyType(self._pictures(moments)),
            MappingProxyType(window if isinstance(window, dict) else {}),
            tuple(dict.fromkeys(self._report)),
        )

    def _manifest(self) -> dict[str, Any] | None:
        """The manifest or its copy, or None when neither can be read."""
        for name in (MANIFEST, MANIFEST_COPY):
            try:
                if name in self._members.names() and self._members.size(name) > MANIFEST_LIMIT:
                    raise FileError("Its list of contents is larger than any document needs.")
                found = json.loads(self._members.read(name), parse_constant=_no_constant)
            except (FileError, ValueError, RecursionError):
                self._report.append("A copy of the list of contents is damaged.")
                continue
            version = found.get("eigenform") if isinstance(found, dict) else None
            if type(version) is not int or version < 1:
                raise FileError("It has no version that this program knows.")
            if version > FORMAT_VERSION:
                raise _NewerError(
                    f"It has the version {version}; this program reads up to {FORMAT_VERSION}."
                )
            if MANIFEST_COPY not in self._members.names():
                self._report.append("The end of the file is missing or damaged.")
            checked: dict[str, Any] = found
            return checked
        return None

    def _fetch(self, key: str) -> NDArray[Any]:
        if key not in self._arrays:
            self._arrays[key] = _array(self._members.read(f"arrays/{key}.npy"), key)
        return self._arrays[key]

    def _moments(self, manifest: dict[str, Any]) -> dict[int, Moment]:
        meshes, steps, entries = (manifest.get(key) for key in ("meshes", "steps", "moments"))
        if not (isinstance(meshes, dict) and isinstance(steps, dict) and isinstance(entries, list)):
            raise FileError("Its list of contents is not that of a document.")
        unpacker = Unpacker(meshes, steps, self._fetch, self._kinds)
        moments, lost = readable_moments(entries, unpacker, self._run)
        self._report += lost
        return moments

    def _pictures(self, moments: Mapping[int, Moment]) -> dict[int, bytes]:
        pictures: dict[int, bytes] = {}
        for name in self._members.names():
            if name.startswith("pictures/") and int(name[9:-4]) in moments:
                try:
                    png = self._members.read(name)
                except FileError:
                    self._report.append("A picture of the history is damaged.")
                    continue
                if png.startswith(b"\x89PNG\r\n\x1a\n"):
                    pictures[int(name[9:-4])] = png
        return pictures

    def _surface_alone(self) -> Archive:
        """The first surface in the file, when the list of contents is lost."""
        found: dict[str, NDArray[Any]] = {}
        for name in self._members.names():
            try:
                array = self._fetch(name[7:-4]) if name.startswith("arrays/") else np.empty(0)
            except FileError:
                continue
            if array.ndim == 2 and array.shape[1] == 3:
                found.setdefault(array.dtype.kind, array)
        if not {"f", "i"} <= set(found):
            raise FileError("It is damaged, and no surface is left in it.")
        document = Document.open(Mesh(found["f"], found["i"]))
        self._report.append("Only the original surface could be saved; its steps are lost.")
        return Archive(History(document, "Rescued").state(), report=tuple(self._report))


def _no_constant(text: str) -> float:
    raise ValueError(f"{text} is not a number")
