"""What several tests of tools begin with."""

from __future__ import annotations

import pytest

from engine import Document
from tests.plugins.flat import FlatContext, plate


@pytest.fixture
def context() -> FlatContext:
    return FlatContext(Document.open(plate()))
