"""What passes between the program and its file worker, and what must not."""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest

from engine.files.wire import receive, send


def test_a_message_comes_back_with_its_arrays() -> None:
    pipe = io.BytesIO()
    points, faces = np.arange(6.0).reshape(2, 3), np.array([[0, 1, 1]], dtype=np.int64)
    send(pipe, {"job": "export", "name": "é.ply"}, {"points": points, "faces": faces})
    pipe.seek(0)
    message, arrays = receive(pipe)
    assert message == {"job": "export", "name": "é.ply"}
    assert arrays["points"].tobytes() == points.tobytes()
    assert arrays["faces"].tolist() == faces.tolist()


@pytest.mark.parametrize(
    "stray",
    [
        b"Warning: a library could not be loaded\n",  # its first bytes read as a huge length
        struct.pack("<Q", 5) + b"Error and more",
        struct.pack("<Q", 40) + b'{"message"',
        b"",
    ],
)
def test_what_is_no_message_is_the_end_of_the_other_side(stray: bytes) -> None:
    with pytest.raises(EOFError):
        receive(io.BytesIO(stray))
