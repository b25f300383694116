"""A scripted session that keeps a journal until it is killed; arguments: folder and seed.

It writes a line with the number of every state that it has handed over, and when. What state number
k is follows from the seed alone, so that whoever killed it can tell what should be there.
"""

from __future__ import annotations

import random
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from engine import Document, Draft, History, HistoryState, Stroke
from engine import scribe as scribe_module
from tests.engine.histories import Nudge, grid, view
from tests.program import PATIENCE


def states(seed: int) -> Iterator[HistoryState]:
    """The states of the session, one after the other, without an end."""
    dice = random.Random(seed)
    history = History(Document.open(grid(14), "scripted"))
    yield history.state()
    while True:
        document = history.current
        roi = np.arange(dice.randrange(70), dice.randrange(80, 150))
        match dice.randrange(7):
            case 0:
                history.add(document.with_draft(Draft(roi, dice.random())), "Region")
            case 1:
                anchors = roi[:40]
                target = np.array([[dice.random(), dice.random()] for _ in anchors])
                draft = Draft(roi, dice.random(), None, (Stroke(anchors, view(), target),))
                history.add(document.with_draft(draft), "Target")
            case 2:
                document = document.with_draft(Draft(document.draft.roi, dice.random()))
                history.amend(document)
            case 3 if history.can_undo:
                history.undo()
            case 4 if history.can_redo:
                history.redo()
            case 5:
                history.go(dice.choice(list(history.moments)))
            case _:
                step = Nudge(roi, np.full((len(roi), 3), dice.random()))
                history.add(document.with_step(step, step.apply(document.mesh)), "Nudge")
        yield history.state()


def main(folder: Path, seed: int) -> None:
    # However long this machine takes over a state: what a hand waits for is shown elsewhere.
    scribe_module.PATIENCE = PATIENCE
    scribe = scribe_module.Scribe(folder)
    dice = random.Random(-seed)
    for number, state in enumerate(states(seed)):
        if number == 0:
            scribe.begin(state, "scripted.obj")
        else:
            scribe.write(state)
        sys.stdout.write(f"{number} {time.monotonic()}\n")
        sys.stdout.flush()
        # The hand of a person who scribbles faster than anyone can.
        time.sleep(dice.uniform(0.04, 0.12))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
