"""Damage document files by accident and by intent: nothing wrong may come out of one unsaid.

    python -m tests.soak.archive_mutations --count 10000 --seed 1

An accident leaves sums and digests as they were: every state that comes back must be, to the last
bit, one that was saved, and what is lost must be said. Intent puts the sums right again: whatever
opens must be sound, survive being saved and opened again, and its steps must run or be refused in
words. It ends with 1 on any fault.
"""

from __future__ import annotations

import argparse
import io
import json
import random
import re
import signal
import sys
import tempfile
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from engine import EngineError, FileError, HistoryState, Run
from engine.applied import applied
from engine.archive import Archive, open_archive, save_archive
from engine.recipe import Kinds
from plugins.registry import kinds
from tests.engine.every_step import bumpy, one_history
from tests.engine.histories import KINDS, PNG, fingerprint, history, marks
from tests.soak.mutations import HUGE, mutate

ACCIDENTS = ("bits", "bytes", "cut", "splice", "repeat", "blank", "delete", "lose", "exchange")
INTENTS = ("number", "number", "number", "word", "subtree", "entry", "forge", "rows")
SECONDS = 60
LIST, COPY = "manifest.json", "manifest-copy.json"


@dataclass(frozen=True)
class Seed:
    """A document file that is damaged: its bytes and what is in it."""

    data: bytes
    state: HistoryState

    @property
    def members(self) -> dict[str, bytes]:
        """The parts by name."""
        with zipfile.ZipFile(io.BytesIO(self.data)) as archive:
            return {name: archive.read(name) for name in archive.namelist()}


def seeds(folder: Path) -> dict[str, Seed]:
    """Return a document of a plain step and one of every kind of step that there is."""
    states = {"plain": history().state(), "every step": one_history(bumpy(3)).state()}
    found = {}
    for name, state in states.items():
        path = folder / f"{name}.eigenform"
        save_archive(path, state, {0: PNG, 2: PNG + b"2"}, {"eye": {"distance": 3.0}})
        found[name] = Seed(path.read_bytes(), state)
    return found


def by_accident(seed: Seed, how: str, dice: random.Random) -> bytes:
    """Return the file damaged so that its sums and digests tell it."""
    if how in ("lose", "exchange"):
        members = seed.members
        one, two = dice.sample(list(members), 2)
        if how == "lose":
            del members[one]
            return packed(members)
        # The sums of two parts change places too: they do not fit what they stand for.
        members[one], members[two] = members[two], members[one]
        return packed(members) if one.startswith("arrays") and two.startswith("arrays") else b""
    if how in ("blank", "delete"):
        damaged = bytearray(seed.data)
        a, b = sorted(dice.randrange(len(damaged)) for _ in range(2))
        if how == "blank":
            damaged[a:b] = bytes(b - a)
        else:
            del damaged[a:b]
        return bytes(damaged)
    return mutate(seed.data, how, dice)


def by_intent(seed: Seed, how: str, dice: random.Random) -> bytes:
    """Return the file changed by somebody who puts every sum right again."""
    members = seed.members
    text = members[LIST].decode()
    if how == "number":
        numbers = list(re.finditer(r"(?<=[\[: ,])-?\d+(\.\d+)?(e-?\d+)?(?=[\],} ])", text))
        for chosen in sorted(dice.sample(numbers, dice.choice([1, 1, 3])), key=lambda m: -m.end()):
            value = str(dice.choice([*HUGE, 0.5, -1e300, 1e-300, 2, 3, "NaN", "1e999", "true"]))
            text = text[: chosen.start()] + value + text[chosen.end() :]
    elif how == "word":
        words = list(re.finditer(r'"[^"\\]{0,70}"', text))
        one, two = dice.choice(words), dice.choice(words)
        text = text[: one.start()] + two.group() + text[one.end() :]
    elif how == "subtree":
        tree = json.loads(text)
        places = list(_places(tree))
        (one, key), (two, other) = dice.choice(places), dice.choice(places)
        # A copy: a tree that holds itself is no JSON.
        one[key] = json.loads(json.dumps(two[other]))
        text = json.dumps(tree)
    elif how == "entry":
        tree = json.loads(text)
        one, key = dice.choice(list(_places(tree)))
        del one[key]
        text = json.dumps(tree)
    else:
        return packed(_forged(members, how, dice))
    members[LIST] = members[COPY] = text.encode()
    return packed(members)


def _forged(members: dict[str, bytes], how: str, dice: random.Random) -> dict[str, bytes]:
    """Return the parts with an array changed, and its name and all that names it with it."""
    from engine.packing import array_key

    name = dice.choice([name for name in members if name.startswith("arrays/")])
    array = np.load(io.BytesIO(members[name])).copy()
    if array.size:
        if how == "rows":
            array = np.delete(array, dice.randrange(len(array)), axis=0)
        elif array.dtype.kind == "f":
            array.flat[dice.randrange(array.size)] = dice.choice([np.nan, np.inf, 1e308, 0.0])
        else:
            array.flat[dice.randrange(array.size)] = dice.choice([-1, 2**31 - 1, 0, array.max()])
    out = io.BytesIO()
    np.save(out, array)
    key = array_key(array)
    renamed = {n: m for n, m in members.items() if n != name}
    for one in (LIST, COPY):
        renamed[one] = members[one].replace(name[7:-4].encode(), key.encode())
    return {**renamed, f"arrays/{key}.npy": out.getvalue()}


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, entry in list(entries):
        yield tree, key
        if isinstance(entry, dict | list):
            yield from _places(entry)


def packed(members: dict[str, bytes]) -> bytes:
    """Return a document file of these parts."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, member in members.items():
            archive.writestr(zipfile.ZipInfo(name), member)
    return out.getvalue()


def fault_of_accident(found: Archive, whole: HistoryState) -> str:
    """Return what is wrong with what came out of a file that an accident damaged, or ""."""
    if not found.report:
        return "" if fingerprint(found.state) == fingerprint(whole) else "a change went unnoticed"
    if not all(line.endswith(".") for line in found.report):
        return f"no sentences: {found.report}"
    original = whole.moments[0].document.original
    for i, moment in found.state.moments.items():
        if moment.label == "Rescued":
            if moment.document.mesh.digest != original.digest:
                return "another surface is said to be the original"
            continue
        was = whole.moments[i]
        if marks(replace(moment, parent=was.parent)) != marks(was):
            return f"state {i} is not the one that was saved"
        if moment.parent != was.parent and not any("came from" in line for line in found.report):
            return f"state {i} was hung elsewhere unsaid"
    return _unsound(found)


def _unsound(found: Archive) -> str:
    for moment in found.state.moments.values():
        document = moment.document
        for mesh in (document.original, document.mesh):
            if not np.isfinite(mesh.vertices).all():
                return "a coordinate that is not finite"
            if mesh.faces.min() < 0 or mesh.faces.max() >= mesh.n:
                return "a face beyond the vertices"
        if moment.parent is not None and moment.parent not in found.state.moments:
            return "a parent that is not there"
    again = found.history
    while again.can_undo:
        again.undo()
    return ""


def fault_of_intent(found: Archive, whole: HistoryState, folder: Path, known: Kinds) -> str:
    """Return what is wrong with what came out of a file that was changed by intent, or ""."""
    wrong = _unsound(found)
    if wrong:
        return wrong
    path = folder / "again.eigenform"
    save_archive(path, found.state)
    back = open_archive(path, known)
    if back.report or fingerprint(back.state) != fingerprint(found.state):
        return f"saved again it is another one: {back.report}"
    moments = whole.moments.values()
    tried = {json.dumps(step.to_json()) for m in moments for step in m.document.recipe.steps}
    for moment in found.state.moments.values():
        for step in moment.document.recipe.steps:
            data = json.dumps(step.to_json())
            # Remeshing is done by the file worker, within its own limits.
            if data in tried or step.kind == "remesh":
                continue
            tried.add(data)
            try:
                applied(step, moment.document.original, Run())
            except EngineError as error:
                if not str(error).endswith(".") or "Traceback" in str(error):
                    return f"refused without words: {error}"
    return ""


@dataclass
class Tally:
    """How it went, for accidents and for intents."""

    outcomes: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)


class TooSlowError(Exception):
    """One file took longer than it may."""


@contextmanager
def limited(seconds: int) -> Iterator[None]:
    """Raise `TooSlowError` in the main thread when the block takes longer."""

    def up(_number: int, _frame: Any) -> None:
        raise TooSlowError(f"longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, up)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def run(count: int, seed: int, folder: Path) -> Tally:
    """Open `count` damaged documents: accidents and intents take turns."""
    dice = random.Random(seed)
    tally = Tally()
    known: Kinds = {**kinds(), **KINDS}
    files = list(seeds(folder).items())
    path = folder / "damaged.eigenform"
    for i in range(count):
        name, whole = files[i // 2 % len(files)]
        accident = i % 2 == 0
        how = dice.choice(ACCIDENTS if accident else INTENTS)
        data = (by_accident if accident else by_intent)(whole, how, dice) or b"\0"
        path.write_bytes(data)
        way = "accident" if accident else "intent"
        try:
            # Numbers beyond all measure are meant: what comes of them is looked at afterwards.
            with limited(SECONDS), np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                outcome, fault = _opened(path, whole.state, accident, folder, known)
        except Exception as error:  # noqa: BLE001
            outcome, fault = "fault", f"raised {type(error).__name__}: {error}"
        tally.outcomes[f"{way}: {outcome}"] += 1
        if fault:
            tally.faults.append(f"{i} {name} {how}: {fault}")
            (folder / f"fault-{i}.eigenform").write_bytes(data)
    return tally


def _opened(
    path: Path, whole: HistoryState, accident: bool, folder: Path, known: Kinds
) -> tuple[str, str]:
    try:
        found = open_archive(path, known)
    except FileError as error:
        words = str(error)
        said = path.name in words and words.endswith(".") and "Traceback" not in words
        return "refused in words", "" if said else f"refused without words: {words}"
    outcome = "saved in part and said so" if found.report else "opened whole"
    if accident:
        return outcome, fault_of_accident(found, whole)
    return outcome, fault_of_intent(found, whole, folder, known)


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="eigenform-documents-"))
    tally = run(options.count, options.seed, folder)
    for outcome, number in sorted(tally.outcomes.items()):
        print(f"{outcome:40} {number:6}")
    print(f"{len(tally.faults)} faults (files in {folder})")
    for fault in tally.faults[:50]:
        print(fault)
    return int(bool(tally.faults))


if __name__ == "__main__":
    sys.exit(main())
