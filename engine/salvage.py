"""A history from as many of its moments as can be read."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

from engine.document import HistoryState, Moment
from engine.errors import Cancelled, EngineError, FileError
from engine.run import Run
from engine.unpacking import Unpacker


def readable_moments(
    entries: Iterable[Any], unpacker: Unpacker, run: Run | None = None
) -> tuple[dict[int, Moment], list[str]]:
    """Return the moments that can be read, by id, and a sentence about those that cannot.

    A moment whose surface is damaged comes back where its steps give that very surface again.

    Raises
    ------
    EngineError
        Not one can be read; the reason is that of the first.
    """
    moments: dict[int, Moment] = {}
    broken: list[tuple[Any, EngineError]] = []
    for entry in entries:
        try:
            moment = unpacker.moment(entry)
        except EngineError as error:
            broken.append((entry, error))
        else:
            moments[moment.id] = moment
    if not moments:
        raise broken[0][1] if broken else FileError("It holds no surface.")
    errors: list[EngineError] = []
    for entry, reason in broken:
        try:
            moment = _recomputed(entry, unpacker, moments, run)
        except Cancelled:
            raise
        except EngineError:
            errors.append(reason)
        else:
            moments[moment.id] = moment
    report = []
    total, again = len(moments) + len(errors), len(broken) - len(errors)
    if errors:
        report.append(f"{len(errors)} of {total} states could not be read. {errors[0]}")
    if again:
        report.append(
            f"{again} of {total} states {'was' if again == 1 else 'were'} damaged and computed "
            "again from the steps: to the last bit what had been saved."
        )
    return moments, report


def _recomputed(
    entry: Any, unpacker: Unpacker, moments: Mapping[int, Moment], run: Run | None
) -> Moment:
    """Return a moment after its surface was made again."""
    try:
        # Another moment with the same surface may have come first.
        return unpacker.moment(entry)
    except EngineError:
        if not isinstance(entry, dict):
            raise
    parent = entry.get("parent")
    known = moments.get(parent) if type(parent) is int else None
    unpacker.recompute(entry.get("document"), None if known is None else known.document, run)
    return unpacker.moment(entry)


def redo_links(data: Any) -> dict[int, int]:
    """Return which child redo leads to, as far as `data` can be understood."""
    if not isinstance(data, dict):
        return {}
    return {int(k): v for k, v in data.items() if k.isdecimal() and len(k) < 10 and type(v) is int}


def history_state(
    moments: Mapping[int, Moment], current_id: int, redo: Mapping[int, int]
) -> tuple[HistoryState, int]:
    """Return a whole tree from the moments that could be read, and how many were hung elsewhere.

    There is at least one. A moment whose parent is lost becomes a child of the root; without its
    root, the tree grows from the moment with the smallest number. Whatever was open and is lost
    gives way to the newest.
    """
    root = min(moments, key=lambda i: (moments[i].parent is not None, i))
    kept: dict[int, Moment] = {}
    rehung = 0
    for i in sorted(moments, key=lambda i: (i != root, i)):
        moment = moments[i]
        parent = None if i == root else moment.parent
        # Parents are older than their children, so that no ring can form.
        if i != root and (parent not in kept):
            parent = root
            rehung += 1
        kept[i] = dataclasses.replace(moment, parent=parent)
    links = {k: v for k, v in redo.items() if k in kept and v in kept and kept[v].parent == k}
    open_id = current_id if current_id in kept else max(kept)
    return HistoryState(kept, open_id, links), rehung
