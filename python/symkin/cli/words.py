# SPDX-License-Identifier: MIT
"""What is wrong with a command line, in a sentence that says what to type instead."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from symkin.errors import did_you_mean

_TYPE = re.compile(r" <(?:str|Path|float|int|list\[\w+\])>$")


def arguments_of(command: Any, context: Any) -> list[str]:
    """What a command line has behind the command's name, options aside: ``MECHANISM``."""
    found = []
    for each in command.get_params(context):
        if each.param_type_name == "argument":
            name = str(each.metavar or each.human_readable_name).strip("{}[]")
            found.append(name if each.required else f"[{name}]")
    return found


def without_type(record: tuple[str, str]) -> tuple[str, str]:
    """A line of the help of an argument, whose type its words say."""
    return _TYPE.sub("", record[0]), record[1]


def usage_words(error: Any) -> str:
    """Say what cannot be used of a command line."""
    message = " ".join(error.format_message().split()).rstrip(".")
    message = message.removeprefix("Invalid value: ").replace("Value error, ", "")
    for pattern, told in _WORDS.items():
        if found := re.fullmatch(pattern, message):
            return told(found, error)
    return message


def _whole(error: Any) -> str:
    if error.ctx is None:
        return "a command and its options"
    words = [error.ctx.command_path, *arguments_of(error.ctx.command, error.ctx)]
    return " ".join(words)


def _option(error: Any) -> str:
    """An option as it is typed, with what stands for its value."""
    parameter = getattr(error, "param", None)
    if parameter is None:
        return ""
    name = next((each for each in parameter.opts if each.startswith("--")), "")
    return f"{name} {parameter.metavar}" if parameter.metavar else name


def _extra(found: re.Match[str], error: Any) -> str:
    words = found[1].split()
    told = ", ".join(f'"{word}"' for word in words)
    return f"{told} {'are' if len(words) > 1 else 'is'} too much; expected {_whole(error)}"


def _no_option(found: re.Match[str], error: Any) -> str:
    name, context = found[1], error.ctx
    if context is None or context.parent is None:
        return f"there is no option {name} here; expected a command first, such as check"
    flags = {flag for each in context.command.params for flag in each.opts}
    own = {flag.lstrip("-") for flag in flags if flag.startswith("-")}
    if name.lstrip("-") in flags:
        return (
            f"{context.info_name} takes what {name} would say without it; expected {_whole(error)}"
        )
    near = did_you_mean(name.lstrip("-"), sorted(own)).replace('"', '"--', 1)
    others = [
        other
        for other, command in context.parent.command.commands.items()
        if any(name in each.opts for each in command.params)
    ]
    elsewhere = f"; {', '.join(others)} have it" if len(others) > 1 else ""
    elsewhere = f"; {others[0]} has it" if len(others) == 1 else elsewhere
    part_of_own = any(name.lstrip("-") in each for each in own)  # nearer than what is elsewhere
    told = near if part_of_own else elsewhere or near
    return f"{context.info_name} has no option {name}{told}"


def _no_value(found: re.Match[str], _: Any) -> str:
    return f"{found[1]} needs a value behind it"


def _missing_option(found: re.Match[str], error: Any) -> str:
    choices = f", one of {found[2]}" if found[2] else ""
    return f"{found[1]} is missing; expected {_option(error) or found[1]}{choices}"


def _no_number(found: re.Match[str], _: Any) -> str:
    return f"{found[1]}: expected {'a whole number' if found[2] == 'int' else 'a number'}"


def _out_of_range(found: re.Match[str], _: Any) -> str:
    """Say the end of the range that a value is beyond, as ``0<=x<=9`` or ``x>0`` has it."""
    name, value, low, above, below, high = found.groups()
    if below is not None and below.startswith(">"):  # an end without the other
        low, above, high = high, below.replace(">", "<"), None
    if low is None or (high is not None and float(value) > float(low)):
        return f"{name}: expected {'at most' if below == '<=' else 'less than'} {high}"
    return f"{name}: expected {'at least' if above == '<=' else 'more than'} {low}"


# What typer says, and how it is said here.
_WORDS: Mapping[str, Callable[[re.Match[str], Any], str]] = {
    r"Got unexpected extra arguments?(?:\(s\))? \((.*)\)": _extra,
    r"No such option:? '?(--?[^ ']*)'?.*": _no_option,
    r"No such command '(.*)'\. (Did you mean .*)": lambda found, _: (
        f'there is no command "{found[1]}". {found[2]}'
    ),
    r"No such command '(.*)'": lambda found, _: f'there is no command "{found[1]}"',
    r"Missing argument '(.*?)(?:\.\.\.)?'\.?": lambda found, error: (
        f"{found[1]} is missing; expected {_whole(error)}"
    ),
    r"Missing option '(--[^ ']*).*?'(?:\. Choose from: (.*))?": _missing_option,
    r"Option '(.*)' requires an argument": _no_value,
    r"Option '(.*)' does not take a value": lambda found, _: f"{found[1]} takes no value",
    r"Invalid value for '(--[^ ']*).*?': '.*' is not a valid (int|float).*": _no_number,
    r"Invalid value for '(--[^ ']*).*?': (\S+) is not in the range "
    r"(?:(\S+?)(<=?))?x(?:([<>]=?)(\S+))?": _out_of_range,
    r"Invalid value for '(--[^ ']*).*?': '(.*?)' is not one of (.*)": lambda found, _: (
        f'{found[1]} is "{found[2]}"; expected one of {found[3].replace(chr(39), "")}'
    ),
}
