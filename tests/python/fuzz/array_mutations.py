# SPDX-License-Identifier: MIT
"""What can be wrong with an array, or unusual and right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Mutation = Callable[[np.ndarray], Any]


def _strided(a: np.ndarray) -> np.ndarray:
    wide = np.repeat(a, 2, axis=-1)
    return wide[..., ::2]


def _reversed_twice(a: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(a[::-1])[::-1]


def _unaligned(a: np.ndarray) -> np.ndarray:
    raw = np.empty(a.nbytes + 1, dtype=np.uint8)
    view = raw[1:].view(a.dtype).reshape(a.shape)
    view[...] = a
    return view


def _read_only(a: np.ndarray) -> np.ndarray:
    copy = a.copy()
    copy.flags.writeable = False
    return copy


# The same values: a result, if there is one, is that of the array as it was.
LAYOUTS: dict[str, Mutation] = {
    "Fortran order": np.asfortranarray,
    "every second value": _strided,
    "reversed": _reversed_twice,
    "unaligned": _unaligned,
    "read-only": _read_only,
    "big-endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "a matrix with more columns": lambda a: np.concatenate([a, a], axis=-1)[..., : a.shape[-1]],
    "object": lambda a: a.astype(object),
    "lists": lambda a: a.tolist(),
    "masked": np.ma.asarray,
}

WRONG: dict[str, Mutation] = {
    # Shapes.
    "a row short": lambda a: a[:-1],
    "a row long": lambda a: np.concatenate([a, a[:1]]),
    "one row": lambda a: a[:1],
    "fifty times as long": lambda a: np.concatenate([a] * 50),
    "a column short": lambda a: a[..., :-1],
    "a column long": lambda a: np.concatenate([a, a[..., :1]], axis=-1),
    "one column": lambda a: a[..., :1],
    "twice as wide": lambda a: np.concatenate([a, a], axis=-1),
    "no rows": lambda a: a[:0],
    "no columns": lambda a: a[..., :0],
    "nothing": lambda _: np.empty((0, 0)),
    "an empty list": lambda _: [],
    "the first row": lambda a: a[0],
    "flat": lambda a: a.ravel(),
    "transposed": lambda a: a.T,
    "a scalar": lambda a: a.ravel()[0].item(),
    "no dimension": lambda a: np.array(a.ravel()[0]),
    "a dimension in front": lambda a: a[None],
    "a dimension behind": lambda a: a[..., None],
    "four dimensions": lambda a: a[None, None, ..., None],
    "ragged": lambda a: [[1.0], [1.0, 2.0], *a.tolist()],
    "one value for all": lambda a: np.broadcast_to(a.ravel()[0], a.shape),
    # Types.
    "int64": lambda a: a.astype(np.int64),
    "int8": lambda a: a.astype(np.int8),
    "uint64": lambda a: a.astype(np.uint64),
    "float32": lambda a: a.astype(np.float32),
    "float16": lambda a: a.astype(np.float16),
    "long double": lambda a: a.astype(np.longdouble),
    "bool": lambda a: a.astype(bool),
    "complex": lambda a: a.astype(complex) + 1j,
    "text": lambda a: a.astype(str),
    "words": lambda a: np.full(a.shape, "x"),
    "bytes": lambda a: np.full(a.shape, b"x"),
    "objects": lambda a: np.full(a.shape, None),
    "dates": lambda a: np.full(a.shape, np.datetime64("2000-01-01")),
    "records": lambda a: np.zeros(len(a), dtype=[("x", float), ("y", int)]),
    "None": lambda _: None,
    "a word": lambda _: "x",
    "a dictionary": lambda _: {"x": 1.0},
    "a set": lambda _: {1.0, 2.0},
    "a function": lambda _: len,
    # Values.
    "NaN": lambda a: np.full(a.shape, np.nan),
    "a NaN at the end": lambda a: _with_last(a, np.nan),
    "infinite": lambda a: np.full(a.shape, np.inf),
    "minus infinity at the end": lambda a: _with_last(a, -np.inf),
    "zeros": np.zeros_like,
    "all alike": np.ones_like,
    "negative": lambda a: -1.0 * a,
    "huge": lambda a: a * 1e300,
    "tiny": lambda a: a * 1e-300,
    "denormal": lambda a: np.full(a.shape, 5e-324),
    "the largest number": lambda a: np.full(a.shape, np.finfo(float).max),
    "large integers": lambda a: np.full(a.shape, 2**62),
    "negative integers": lambda a: np.full(a.shape, -(2**31)),
}

NUMBERS: dict[str, Callable[[int], Any]] = {
    "-1": lambda _: -1,
    "-2": lambda _: -2,
    "the number of legs": lambda _: 3,
    "six": lambda _: 6,
    "a thousand": lambda _: 1000,
    "the largest int": lambda _: 2**31 - 1,
    "the smallest long": lambda _: -(2**63),
    "too long": lambda _: 2**70,
    "a float": lambda n: n + 0.5,
    "a word": lambda _: "x",
    "None": lambda _: None,
    "an array": lambda n: np.array([n, n]),
    "zero": lambda _: 0,
}


def _with_last(a: np.ndarray, value: float) -> np.ndarray:
    changed = a.astype(float)
    changed[(-1,) * a.ndim] = value
    return changed
