"""Text as arrays: lines and tokens of a whole file at once, and numbers out of them."""

from __future__ import annotations

import codecs
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine.arrays import B1, F64, I64
from engine.files.report import Change

U8 = NDArray[np.uint8]


def _alphabet(characters: bytes) -> B1:
    table = np.zeros(256, dtype=bool)
    table[np.frombuffer(characters, np.uint8)] = True
    return table


_BLANK = _alphabet(b" \t\n\v\f")
_DECIMAL = _alphabet(b"0123456789+-.eE")
_DIGITS = _alphabet(b"0123456789")
UTF8_MARK = codecs.BOM_UTF8
_NOT_FINITE = frozenset({b"nan", b"inf", b"infinity", b"1.#inf", b"1.#qnan", b"1.#ind"})


def plain_text(data: bytes) -> tuple[bytes, list[Change]]:
    """Return text with LF line ends in UTF-8 without a byte order mark, and what was noticed."""
    notes: list[Change] = []
    for mark, encoding in (
        (UTF8_MARK, "utf-8"),
        (codecs.BOM_UTF16_LE, "utf-16-le"),
        (codecs.BOM_UTF16_BE, "utf-16-be"),
    ):
        if data.startswith(mark):
            data = data[len(mark) :]
            if encoding != "utf-8":
                data = data.decode(encoding, errors="replace").encode()
                notes.append(Change("utf16", "The text is in UTF-16; it was read as such."))
            break
    else:
        encoding = _bare_utf16(data)
        if encoding:
            data = data.decode(encoding, errors="replace").encode()
            notes.append(Change("utf16", "The text is in UTF-16; it was read as such."))
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data, notes


def _bare_utf16(data: bytes) -> str:
    head = np.frombuffer(data[:400], np.uint8)
    if len(head) < 16:
        return ""
    even, odd = (head[0::2] == 0).mean(), (head[1::2] == 0).mean()
    if odd > 0.9 and even < 0.1:
        return "utf-16-le"
    if even > 0.9 and odd < 0.1:
        return "utf-16-be"
    return ""


@dataclass(frozen=True)
class Tokens:
    """All words of a text.

    Parameters
    ----------
    text : (b,) the bytes.
    start, end : (t,) where each word begins and where the blank after it is.
    first : (l + 1,) number of the first word of each line that has words, and t at the end.
    line : (l,) which line of the file that is, from 0.
    """

    text: U8
    start: I64
    end: I64
    first: I64
    line: I64

    @property
    def lengths(self) -> I64:
        """Number of words in each line, (l,)."""
        return np.diff(self.first)

    def characters(self, words: I64, offset: int = 0) -> U8:
        """Return the byte at `offset` in each of `words`; a blank where the word is shorter."""
        at = self.start[words] + offset
        return np.where(at < self.end[words], self.text[np.minimum(at, len(self.text) - 1)], 32)

    def are(self, words: I64, what: bytes) -> B1:
        """Return which of `words` are exactly `what`, in lower or upper case."""
        same = (self.end[words] - self.start[words]) == len(what)
        for i, byte in enumerate(what.lower()):
            same &= (self.characters(words, i) | 32) == (byte | 32)
        return np.asarray(same)

    def until(self, words: I64, byte: int) -> I64:
        """Return where each of `words` ends when it is cut at the first `byte` in it."""
        marks = np.append(np.flatnonzero(self.text == byte), len(self.text))
        cut: I64 = marks[np.searchsorted(marks, self.start[words])]
        return np.minimum(self.end[words], cut)


def tokenise(data: bytes, comment: bytes = b"") -> Tokens:
    """Return the words of `data`; from the `comment` character on, a line does not count."""
    text = np.frombuffer(data + b"\n", np.uint8)
    breaks = np.flatnonzero(text == 10)
    blank = _BLANK[text]
    if comment and comment in data:
        blank = blank | _after_mark(text, breaks, comment[0])
    edges = np.diff(np.concatenate([[True], blank]).astype(np.int8))
    start = np.flatnonzero(edges == -1)
    end = np.flatnonzero(edges == 1)
    of_line = np.searchsorted(breaks, start)
    new = np.flatnonzero(np.diff(of_line, prepend=-1))
    return Tokens(text, start, end, np.append(new, len(start)), of_line[new])


def _after_mark(text: U8, breaks: I64, mark: int) -> B1:
    """Return which bytes come after a `mark` in their line (the mark itself included)."""
    marks = np.flatnonzero(text == mark)
    line = np.searchsorted(breaks, marks)
    first = np.flatnonzero(np.diff(line, prepend=-1))
    delta = np.zeros(len(text) + 1, dtype=np.int8)
    delta[marks[first]] = 1
    delta[breaks[line[first]]] = -1
    return np.asarray(np.cumsum(delta, dtype=np.int8)[:-1] > 0)


def decimals(tokens: Tokens, words: I64) -> F64:
    """Return the numbers that `words` spell, NaN where a word is none: correctly rounded."""
    start, end = tokens.start[words], tokens.end[words]
    buffer = _joined(tokens.text, start, end)
    if (_DECIMAL | _BLANK)[buffer].all() and len(values := _numbers(buffer)) == len(words):
        return values
    good = _all_in(tokens.text, start, end, _DECIMAL)
    values = np.full(len(words), np.nan)
    spelt = _joined(tokens.text, start[good], end[good])
    read = _numbers(spelt)
    if len(read) != len(words[good]):
        # Words such as 1-2 or 1e stop the fast reader; a damaged file is worth the slow one.
        read = np.array([_one_number(word) for word in spelt.tobytes().split()])
    values[good] = read
    return values


def wholes(tokens: Tokens, words: I64, end: I64 | None = None) -> tuple[I64, B1]:
    """Return the whole numbers that `words` spell, (w,), and which of them are any at all, (w,).

    Words of more than 15 digits do not count: no file has that many vertices.
    """
    start = tokens.start[words]
    stop = tokens.end[words] if end is None else end
    sign = tokens.text[start]
    start = start + ((sign == ord("-")) | (sign == ord("+")))
    length = stop - start
    good = (length > 0) & (length <= 15)
    values = np.zeros(len(words), dtype=np.int64)
    for place in range(int(length[good].max(initial=0))):
        more = good & (place < length)
        byte = tokens.text[np.minimum(start + place, len(tokens.text) - 1)]
        good &= ~more | _DIGITS[byte]
        values = np.where(more, values * 10 + (byte.astype(np.int64) - 48), values)
    return np.where(sign == ord("-"), -values, values), good


def spell_not_finite(tokens: Tokens, words: I64) -> B1:
    """Return which of the few `words` say that there is no finite number: nan, -inf, 1.#QNAN."""
    spelt = [
        tokens.text[s:e].tobytes()
        for s, e in zip(tokens.start[words], tokens.end[words], strict=True)
    ]
    return np.array([w.lower().lstrip(b"+-") in _NOT_FINITE for w in spelt], dtype=bool)


def _all_in(text: U8, start: I64, end: I64, allowed: B1) -> B1:
    """Return which of the words [start, end) have at least one byte, and only allowed ones."""
    wrong = np.concatenate([[0], np.cumsum(~allowed[text], dtype=np.int32)])
    return np.asarray((end > start) & (wrong[end] == wrong[start]))


def _numbers(buffer: U8) -> F64:
    """Return the numbers in a text of digits, signs, points and exponents, up to a bad one."""
    with warnings.catch_warnings():
        # A word that is no number is deprecated in this reader, and an error in later versions.
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(buffer.tobytes(), dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return np.empty(0)


def _one_number(word: bytes) -> float:
    try:
        return float(word)
    except ValueError:
        return float("nan")


def _joined(text: U8, start: I64, end: I64) -> U8:
    """Return the words [start, end), which ascend, with one blank after each."""
    delta = np.zeros(len(text) + 1, dtype=np.int8)
    delta[start] = 1
    delta[end] -= 1
    kept = np.cumsum(delta, dtype=np.int8)[:-1] > 0
    kept[end] = True
    out = text.copy()
    out[end] = 32
    return out[kept]
