"""What the tests of the engine share."""

from __future__ import annotations

import pytest

from tests.engine.documents_on_disk import small_file


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str]:
    """The bytes of a small document file, and the fingerprint of what is in it."""
    return small_file(tmp_path_factory.mktemp("whole") / "small.eigenform")
