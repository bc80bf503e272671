# SPDX-License-Identifier: MIT
"""What a function is called with: refused in one sentence, before anything begins, if it is wrong.

What an argument may be is what its annotation says, and of an option what its table does.
"""

from __future__ import annotations

import functools
import inspect
import os
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError, did_you_mean, shown
from symkin.options.table import OPTIONS

P = ParamSpec("P")
T = TypeVar("T")

_ARRAY = "an array of numbers"
_WORDS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    str: "a text",
    bool: "True or False",
    os.PathLike: "a path",
    types.NoneType: "None",
}


def checks(*homonyms: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Let a function refuse what its arguments cannot be.

    `homonyms` are parameters that are something else than the option of their name.
    """

    def made(function: Callable[P, T]) -> Callable[P, T]:
        signature = _spelt_out(function)
        names = [*signature.parameters]

        @functools.cache
        def hints() -> dict[str, Any]:
            return hints_of(function)

        @functools.wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> T:
            for name in kwargs:
                if name not in names:
                    like = did_you_mean(name, names)
                    raise TypeError(f'{function.__name__} has no argument "{name}"{like}')
            for name, value in (dict(zip(names, args, strict=False)) | kwargs).items():
                if name in OPTIONS and name not in homonyms:
                    OPTIONS[name].check(value)
                if not _may_be(value, hints().get(name, Any)):
                    expected = _in_words(hints()[name])
                    raise SymkinError(f"{name} is {shown(value)}; expected {expected}")
            return function(*args, **kwargs)

        called.__signature__ = signature  # type: ignore[attr-defined]
        return called

    return made


def _unpacked(function: Callable[..., Any], parameter: inspect.Parameter) -> Any:
    """The options that a parameter unpacks, ``**options: Unpack[Options]``."""
    (options,) = get_args(eval(parameter.annotation, function.__globals__))
    return options


def _spelt_out(function: Callable[..., Any]) -> inspect.Signature:
    """A signature with unpacked options one by one, for `help` and for what completes names."""
    signature = inspect.signature(function)
    spelt_out: list[inspect.Parameter] = []
    for each in signature.parameters.values():
        if each.kind is not each.VAR_KEYWORD:
            spelt_out.append(each)
            continue
        for name, annotation in _unpacked(function, each).__annotations__.items():
            default = OPTIONS[name].default if name in OPTIONS else None
            like = {"default": default, "annotation": annotation.__forward_arg__}
            spelt_out.append(inspect.Parameter(name, each.KEYWORD_ONLY, **like))
    return signature.replace(parameters=spelt_out)


def hints_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Types of parameters, those of unpacked options one by one."""
    hints = typing.get_type_hints(function)
    for each in inspect.signature(function).parameters.values():
        if each.kind is each.VAR_KEYWORD:
            del hints[each.name]
            hints |= typing.get_type_hints(_unpacked(function, each))
    # What may be a table is looked at, and refused, where tables are read.
    return {name: hint for name, hint in hints.items() if not _may_be_table(hint)}


def _may_be_table(hint: Any) -> bool:
    return any(get_origin(each) is typing.IO for each in get_args(hint))


def _members(hint: Any) -> tuple[Any, ...]:
    """What a union may be, or the type itself; what NumPy takes for arrays is one of them."""
    if get_origin(hint) not in (Union, types.UnionType):
        return (hint,)
    members = get_args(hint)
    origins = [get_origin(each) or each for each in members]
    if not any(getattr(each, "__name__", "") == "_NestedSequence" for each in origins):
        return members
    has_paths = os.PathLike in origins
    beside = (types.NoneType, os.PathLike, *((str,) if has_paths else ()))
    others = [
        each
        for each, origin in zip(members, origins, strict=True)
        if origin in beside or getattr(origin, "__module__", "").startswith("symkin")
    ]
    return (NDArray, *others)


def _may_be(value: object, hint: Any) -> bool:
    return any(_is(value, each) for each in _members(hint))


def _is(value: Any, hint: Any) -> bool:
    """Whether a value is of a type; also if the type cannot be looked into."""
    origin = get_origin(hint) or hint
    if origin is Any:
        return True
    if origin is Literal:
        return isinstance(value, str) and value in get_args(hint)
    if origin in (int, float):
        return _is_number(value, whole=origin is int)
    if origin is bool:
        return isinstance(value, bool | np.bool_)
    if hint is NDArray:
        return _is_array(value)
    if isinstance(hint, TypeVar):
        return hint.__bound__ is None or _may_be(value, hint.__bound__)
    if origin in (Sequence, tuple, list):
        return _is_sequence(value, get_args(hint))
    if origin is Mapping:
        kinds = get_args(hint)
        return isinstance(value, Mapping) and all(
            _may_be(key, kinds[0]) and _may_be(each, kinds[1]) for key, each in value.items()
        )
    if origin is Callable:
        return callable(value)
    if getattr(origin, "_is_protocol", False):
        names = [name for name in dir(origin) if not name.startswith("_")]
        return all(hasattr(value, name) for name in names)
    return not isinstance(origin, type) or isinstance(value, origin)


def _is_number(value: Any, *, whole: bool) -> bool:
    if isinstance(value, bool | np.bool_ | np.ndarray):
        return False
    return hasattr(value, "__index__") or (not whole and isinstance(value, float | np.floating))


def _is_array(value: Any) -> bool:
    if isinstance(value, str | bytes | Mapping) or callable(value):
        return False
    try:
        return bool(np.asarray(value).dtype.kind in "fiub")
    except ValueError:  # rows of different lengths
        return False


def _is_sequence(value: Any, kinds: Sequence[Any]) -> bool:
    if isinstance(value, str | bytes | Mapping) or not hasattr(value, "__len__"):
        return isinstance(value, str) and kinds[:1] == (str,)  # one pattern for several
    if not hasattr(value, "__getitem__") or (isinstance(value, np.ndarray) and not value.ndim):
        return False
    alike = len(kinds) < 2 or kinds[1] is ...
    if not alike:
        return len(value) == len(kinds) and all(map(_may_be, value, kinds))
    return not kinds or all(_may_be(each, kinds[0]) for each in value)


def _in_words(hint: Any) -> str:
    """A type as a sentence has it: ``a Mechanism, a text or a path``."""
    words = dict.fromkeys(map(_one_in_words, _members(hint)))
    words.pop("None", None)
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last


def _one_in_words(hint: Any) -> str:
    origin = get_origin(hint) or hint
    if hint is NDArray:
        return _ARRAY
    if origin is Literal:
        return ", ".join(f'"{each}"' for each in get_args(hint))
    if origin in (Sequence, tuple, list) and get_args(hint):
        return f"a list, each {_in_words(get_args(hint)[0])}"
    if origin is Mapping:
        return "a mapping"
    if origin is Callable:
        return "a function"
    if isinstance(hint, TypeVar) and hint.__bound__ is not None:
        return _in_words(hint.__bound__)
    if origin in _WORDS:
        return _WORDS[origin]
    name = getattr(origin, "__name__", str(origin))
    return f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"
