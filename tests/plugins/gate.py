"""What plugin files of the tests wait for, and what they leave behind when they are run."""

from __future__ import annotations

import threading

OPEN = threading.Event()
TRIED: list[str] = []
