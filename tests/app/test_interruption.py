"""An interrupted call leaves the interpreter as it was: a profiler works after it."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[2]

TOO_LATE = """
    import threading
    from plugins.interruption import interrupt, receive
    for _ in range(200):
        try:
            interrupt(threading.get_ident(), KeyError)
        except KeyError:
            pass
        receive(KeyError)
"""
TOOL_THAT_CAME_BACK = """
    import time
    import app.patience
    app.patience.SECONDS, app.patience.LOOK = 0.05, 0.01
    patience = app.patience.Patience()
    hung, seconds = 0, 0.1
    while not hung:
        for _ in range(5):
            try:
                with patience.call():
                    time.sleep(seconds)
            except app.patience.ToolHungError:
                hung += 1
        seconds *= 2
    patience.stop()
"""
WORKER_THAT_ENDS_MEANWHILE = """
    from plugins.interruption import InterruptibleThread
    for _ in range(300):
        thread = InterruptibleThread("short", lambda: None)
        thread.start()
        thread.interrupt()
        thread.join()
"""
PROFILED = """
    import sys
    seen = []
    sys.setprofile(lambda frame, event, _arg: seen.append(frame.f_code.co_name))
    def called():
        return 1
    for _ in range(100):
        called()
    sys.setprofile(None)
    assert seen.count("called") == 200
"""


@pytest.mark.parametrize("before", [TOO_LATE, TOOL_THAT_CAME_BACK, WORKER_THAT_ENDS_MEANWHILE])
def test_a_profiler_works_after_an_interruption(before: str) -> None:
    """Without care Python 3.11 never leaves the first call that is profiled."""
    program = textwrap.dedent(before) + textwrap.dedent(PROFILED)
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True, timeout=PATIENCE)
