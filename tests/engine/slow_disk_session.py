"""A scripted session on a disk that takes 0.3 s over every push; arguments: folder and seed."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from engine import journal, pusher
from tests.engine.scripted_session import main

if __name__ == "__main__":
    journal.os.fsync = lambda _file: time.sleep(0.3)
    # The disk is busy all the time.
    pusher.QUIET = 0.0
    main(Path(sys.argv[1]), int(sys.argv[2]))
