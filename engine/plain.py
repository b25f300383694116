"""Frozen dataclasses as plain JSON and back, led by their type hints; long arrays are put aside.

What a document holds besides its meshes (draft, strokes, cameras, regions) is written field by
field, so that a field added later is kept too. Reading is a door: every value must have the type
that the field is annotated with, and every number must be finite.
"""

from __future__ import annotations

import dataclasses
import math
import types
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from engine.arrays import frozen
from engine.errors import FileError

T = TypeVar("T")
Put = Callable[[NDArray[Any]], str]
Fetch = Callable[[str], NDArray[Any]]

INLINE = 64
"""Arrays with fewer decimal numbers stand in the JSON itself."""


def to_plain(value: Any, put: Put) -> Any:
    """Return `value` as JSON data; ids and arrays of `INLINE` numbers go to `put`.

    Parameters
    ----------
    value : None, a number, text, array, sequence, mapping with text keys, or a dataclass of these.
    put : takes an array and returns the key that stands for it.
    """
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return float(value)
    if isinstance(value, np.ndarray):
        # Ids go apart whatever their number: who compares regions by identity finds them the same.
        if value.size >= INLINE or value.dtype.kind in "iu":
            return {"array": put(value)}
        return {"values": value.tolist(), "shape": list(value.shape)}
    if isinstance(value, Mapping):
        return {str(key): to_plain(entry, put) for key, entry in value.items()}
    if isinstance(value, tuple | list | frozenset):
        return [to_plain(entry, put) for entry in value]
    if dataclasses.is_dataclass(value):
        fields = dataclasses.fields(value)
        return {f.name: to_plain(getattr(value, f.name), put) for f in fields}
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be written to a document")


def from_plain(hint: Any, data: Any, fetch: Fetch) -> Any:
    """Return what `to_plain` was given, checked against the type `hint`.

    Raises
    ------
    FileError
        A value is not of the annotated type, not finite, or a class refuses it.
    """
    origin = get_origin(hint)
    if hint is Any:
        return data
    if origin is Union or origin is types.UnionType:
        return _one_of(get_args(hint), data, fetch)
    if origin is Literal:
        return _checked(data, data in get_args(hint), f"one of {get_args(hint)}")
    if origin is np.ndarray or hint is np.ndarray:
        return _array(hint, data, fetch)
    if origin is tuple:
        return _tuple(get_args(hint), data, fetch)
    if origin in (list, frozenset):
        entries = _checked(data, isinstance(data, list), "a list")
        return origin(from_plain(get_args(hint)[0], entry, fetch) for entry in entries)
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        entries = _checked(data, isinstance(data, dict), "named entries")
        kind = get_args(hint)[1]
        return MappingProxyType({k: from_plain(kind, v, fetch) for k, v in entries.items()})
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return dataclass_from_plain(hint, data, fetch)
    return _scalar(hint, data)


def dataclass_from_plain(
    kind: type[T], data: Any, fetch: Fetch, given: Mapping[str, Any] | None = None
) -> T:
    """Build a dataclass from JSON data; absent fields keep their defaults, unknown ones are passed.

    `given` holds fields that the caller has already made and that are not looked for in `data`.
    """
    _checked(data, isinstance(data, dict), f"the fields of {kind.__name__}")
    values: dict[str, Any] = dict(given or {})
    hints = _hints(kind)
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]
        if field.init and field.name in data and field.name not in values:
            values[field.name] = from_plain(hints[field.name], data[field.name], fetch)
    try:
        return kind(**values)
    except (TypeError, ValueError) as error:
        raise FileError(f"{kind.__name__} cannot be made from the file: {error}.") from error


_HINTS: dict[Any, dict[str, Any]] = {}


def _hints(kind: Any) -> dict[str, Any]:
    # Working them out takes a millisecond, and a document asks for them a thousand times.
    if kind not in _HINTS:
        _HINTS[kind] = get_type_hints(kind)
    return _HINTS[kind]


def _checked(data: Any, good: bool, wanted: str) -> Any:
    if not good:
        raise FileError(f"{str(data)[:60]!r} was found where {wanted} is needed.")
    return data


def _one_of(kinds: tuple[Any, ...], data: Any, fetch: Fetch) -> Any:
    if data is None and type(None) in kinds:
        return None
    kinds = tuple(kind for kind in kinds if kind is not type(None))
    for kind in kinds[:-1]:
        try:
            return from_plain(kind, data, fetch)
        except FileError:
            continue
    return from_plain(kinds[-1], data, fetch)


def _scalar(hint: Any, data: Any) -> Any:
    if hint is bool or hint is str or hint is type(None):
        return _checked(data, type(data) is (type(None) if hint is None else hint), hint.__name__)
    if hint is int:
        return _checked(data, type(data) is int and abs(data) < 2**63, "a whole number")
    if hint is float:
        number = type(data) in (int, float) and abs(data) <= 1e300 and math.isfinite(data)
        return float(_checked(data, number, "a finite number"))
    raise FileError(f"The file has a value of the unknown type {hint}.")


def _tuple(kinds: tuple[Any, ...], data: Any, fetch: Fetch) -> Any:
    entries = _checked(data, isinstance(data, list), "a list")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return tuple(from_plain(kinds[0], entry, fetch) for entry in entries)
    _checked(data, len(entries) == len(kinds), f"a list of {len(kinds)}")
    return tuple(from_plain(k, entry, fetch) for k, entry in zip(kinds, entries, strict=True))


def _array(hint: Any, data: Any, fetch: Fetch) -> NDArray[Any]:
    _checked(data, isinstance(data, dict), "an array")
    dtype = np.dtype(get_args(get_args(hint)[1])[0])
    if "array" in data:
        array = fetch(_checked(data["array"], isinstance(data["array"], str), "an array's key"))
    else:
        try:
            array = np.array(data.get("values"))
            array = array.reshape([int(length) for length in data["shape"]])
        except (TypeError, ValueError, KeyError, OverflowError) as error:
            raise FileError(f"An array in the file cannot be read: {error}.") from error
    if array.size == 0:
        array = array.astype(dtype)
    safe = array.dtype.kind == dtype.kind or (array.dtype.kind, dtype.kind) == ("i", "f")
    _checked(array.dtype, safe and array.dtype.kind in "ifb", f"numbers of the type {dtype}")
    if dtype.kind == "f":
        _checked("a number", bool(np.isfinite(array).all()), "a finite number")
    return frozen(array, dtype)
