# SPDX-License-Identifier: MIT
"""The comments that somebody wrote into a mechanism file, carried over when it is written again.

tomlkit, which keeps a document's comments, was tried: it does not know the places of keys, so that
errors would want a second reader, and files are written anew here, not edited.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from symkin.storage.toml_file import (
    KeyPath,
    Statement,
    TomlSource,
    lines_of_keys,
    statements,
    toml_value,
)

_WAS = "was "


@dataclass
class _Comment:
    """What stands above a key or header, and beside it."""

    above: list[str] = field(default_factory=list)
    beside: str = ""

    def said(self) -> list[str]:
        return [*self.above, f"# {self.beside}"] if self.beside else self.above


def with_comments(
    text: str, source: TomlSource, plain: str, leg_of_reference: Sequence[int], top: Sequence[str]
) -> str:
    """Return a mechanism file's text with the comments of the file that it was made of.

    What is said beside a value that has changed is said of the former value. What stands in
    `plain`, the source's mechanism as symkin itself writes it, is not the user's. The number, from
    0, of each reference leg of the source among its legs is in `leg_of_reference`; between the
    lines `top` symkin's own heading of a file stands.
    """
    theirs, end = _comments(source.text)
    homeless: list[str] = []
    own, _ = _comments(plain)
    _without_own(theirs, own, top)
    values, former = tomllib.loads(text), tomllib.loads(plain)
    lines, places = text.split("\n"), lines_of_keys(text)
    above: dict[int, list[str]] = {}
    for path, comment in theirs.items():
        target = _target(path, places, leg_of_reference)
        kept = next((target[:n] for n in range(len(target), 0, -1) if target[:n] in places), None)
        if kept is None:
            homeless += comment.said()
        elif kept != target:
            above.setdefault(places[kept] - 1, []).extend(comment.said())
        else:
            line = places[kept] - 1
            above.setdefault(line, []).extend(comment.above)
            if comment.beside:
                changed = _changed(_at(former, path), _at(values, kept))
                was = changed and not comment.beside.startswith(_WAS)
                said = f"{_WAS}{toml_value(_at(source.values, path))}: " if was else ""
                value, _, note = lines[line].partition("  # ")
                if " " in note and note in comment.beside:  # words are said once
                    note = ""
                note += "; " if note else ""
                lines[line] = f"{value}  # {note}{said}{comment.beside}"
    for line, added in sorted(above.items(), reverse=True):
        lines[line:line] = added
    end += ["", *homeless] if homeless else []
    return "\n".join(lines).rstrip("\n") + "\n" + "".join(f"{each}\n" for each in end)


def _comments(text: str) -> tuple[dict[KeyPath, _Comment], list[str]]:
    """Those with each key and header, and those below the last."""
    lines = text.split("\n")
    found: dict[KeyPath, _Comment] = {}
    pending: list[str] = []
    for each, complete in statements(text):
        if not complete:
            continue
        path, inside = each.path, list(_inside(each, lines))
        if path is None:
            pending += [lines[each.first].strip()] if inside or pending else []
            continue
        beside = [comment for line, comment in inside if line in (each.first, each.end - 1)]
        among = [f"# {comment}" for _, comment in inside if comment not in beside]
        found[path] = _Comment([*pending, *among], "; ".join(beside))
        pending = []
    while pending and not pending[-1]:
        pending.pop()
    return found, ["", *pending] if pending else []


def _inside(statement: Statement, lines: list[str]) -> Iterator[tuple[int, str]]:
    """The comments in the lines of a statement: what can be left out and nothing changes."""
    of_statement = lines[statement.first : statement.end]
    for number, line in enumerate(of_statement):
        for column in (index for index, letter in enumerate(line) if letter == "#"):
            without = [*of_statement[:number], line[:column], *of_statement[number + 1 :]]
            if _reads("\n".join(without)) == statement.values:
                yield statement.first + number, line[column:].lstrip("#").strip()
                break


def _reads(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except ValueError:
        return None


def _without_own(
    theirs: dict[KeyPath, _Comment], own: Mapping[KeyPath, _Comment], top: Sequence[str]
) -> None:
    """Leave out what symkin wrote: its heading, and its notes."""
    first = next(iter(theirs.values()), _Comment())
    begin, last = top
    if begin in first.above:
        start = first.above.index(begin)
        stop = first.above.index(last) if last in first.above else start
        del first.above[start : stop + 1]
        while first.above and not first.above[0]:
            first.above.pop(0)
    for path, comment in theirs.items():
        note = own[path].beside if path in own else ""
        if note and f"{comment.beside}; ".startswith(f"{note}; "):
            comment.beside = comment.beside[len(note) :].removeprefix("; ")


def _target(
    path: KeyPath, places: Mapping[KeyPath, int], leg_of_reference: Sequence[int]
) -> KeyPath:
    """Where in the new file it is said; the legs may be given otherwise there."""
    if path in places:
        return path
    match path:
        case ("reference_leg", *rest):
            return ("legs", 0, *rest)
        case ("reference_legs", int(reference), *rest):
            return ("legs", leg_of_reference[reference], *rest)
        case ("legs", 0, *rest) if ("reference_leg",) in places:
            return ("reference_leg", *rest)
    return path


def _at(values: Any, path: KeyPath) -> Any:
    for key in path:
        try:
            values = values[key]
        except (KeyError, IndexError, TypeError):
            return None
    return values


def _changed(former: Any, value: Any) -> bool:
    """Whether a value is another, its deviation apart; of a table no."""
    plain = [each.get("value") if isinstance(each, dict) else each for each in (former, value)]
    return plain[0] is not None and plain[0] != plain[1]
