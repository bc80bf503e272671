# SPDX-License-Identifier: MIT
"""Run cases in a process of their own: ``array_walk.py LOG FIRST SEED SECONDS``.

Without seconds a sixth of all single changes, the same for the same seed; else all of them, and
then many at once for so long.

The log gets a line before each case and one after it, so that a crash has a name.
"""

from __future__ import annotations

import dataclasses
import faulthandler
import json
import random
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from array_calls import Call, calls
from array_mutations import LAYOUTS, NUMBERS, WRONG

_HANGS = 30  # seconds for one case


@dataclasses.dataclass(frozen=True)
class Case:
    name: str
    call: Call
    changes: Callable[[], dict[str, Any]]
    same_values: bool = False


def every_single_change(all_calls: list[Call]) -> Iterator[Case]:
    for call in all_calls:
        for argument, array in call.arrays.items():
            for kind, mutate in (LAYOUTS | WRONG).items():
                yield Case(
                    f"{call.name}: {argument} is {kind}",
                    call,
                    lambda a=argument, v=array, m=mutate: {a: m(v.copy())},
                    kind in LAYOUTS,
                )
        for argument, number in call.numbers.items():
            for kind, mutate in NUMBERS.items():
                yield Case(
                    f"{call.name}: {argument} is {kind}",
                    call,
                    lambda a=argument, v=number, m=mutate: {a: m(v)},
                )


def changes_together(all_calls: list[Call], seed: int) -> Iterator[Case]:
    """Endlessly, all arguments of a call changed at random."""
    draw = random.Random(seed)
    while True:
        call = draw.choice([call for call in all_calls if len(call.arrays) + len(call.numbers) > 1])
        kinds = {name: draw.choice([*WRONG, *LAYOUTS]) for name in call.arrays}
        numbers = {name: draw.choice([*NUMBERS]) for name in call.numbers if draw.random() < 0.2}

        def changes(
            call: Call = call, kinds: dict[str, str] = kinds, numbers: dict[str, str] = numbers
        ) -> dict[str, Any]:
            arrays = {
                name: (LAYOUTS | WRONG)[kind](call.arrays[name].copy())
                for name, kind in kinds.items()
            }
            return arrays | {
                name: NUMBERS[kind](call.numbers[name]) for name, kind in numbers.items()
            }

        yield Case(f"{call.name}: {kinds | numbers}", call, changes)


def outcome(case: Case, expected: dict[str, Any]) -> str:
    """Empty if all is well."""
    try:
        changes = case.changes()
    except (TypeError, ValueError, IndexError, OverflowError):
        return ""  # the array has no such variant
    try:
        result = case.call(**changes)
    except (TypeError, ValueError, MemoryError):  # symkin's own is a ValueError
        return ""
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    if case.same_values and not same(values_of(result), expected[case.call.name]):
        return "another result than with the same values in an ordinary array"
    return ""


def values_of(result: Any, depth: int = 0) -> Any:
    """What can be compared of a result."""
    if isinstance(result, (np.ndarray, np.generic, int, float, str, type(None))):
        return result
    if isinstance(result, (list, tuple)):
        return [values_of(each, depth + 1) for each in result]
    if isinstance(result, dict):
        return {key: values_of(each, depth + 1) for key, each in result.items()}
    if depth > 4:
        return None
    names = [
        name for name in dir(type(result)) if isinstance(getattr(type(result), name), property)
    ]
    if dataclasses.is_dataclass(result):
        names = [each.name for each in dataclasses.fields(result)]
    return {name: values_of(getattr(result, name), depth + 1) for name in names}


def same(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, (np.ndarray, np.generic, float)):
        return np.array_equal(
            np.asarray(a), np.asarray(b), equal_nan=np.asarray(a).dtype.kind == "f"
        )
    return bool(a == b)


def main() -> None:
    log, first, seed, seconds = Path(sys.argv[1]), *map(int, sys.argv[2:4]), float(sys.argv[4])
    warnings.simplefilter("ignore")
    all_calls = list(calls())
    expected = {call.name: values_of(call()) for call in all_calls}
    single = list(every_single_change(all_calls))
    if not seconds:
        single = random.Random(seed).sample(single, len(single) // 6)
    with log.open("a", buffering=1) as lines:
        for number, case in enumerate(single):
            if number >= first:
                record(number, case, expected, lines)
        begun = time.monotonic()
        for number, case in enumerate(changes_together(all_calls, seed), len(single)):
            if time.monotonic() - begun > seconds:
                break
            if number >= first:
                record(number, case, expected, lines)
    faulthandler.cancel_dump_traceback_later()


def record(number: int, case: Case, expected: dict[str, Any], lines: Any) -> None:
    print(json.dumps({"number": number, "name": case.name}), file=lines)
    faulthandler.dump_traceback_later(_HANGS, exit=True)
    print(json.dumps({"number": number, "failure": outcome(case, expected)}), file=lines)


if __name__ == "__main__":
    main()
