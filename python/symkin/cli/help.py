# SPDX-License-Identifier: MIT
"""The commands, which are loaded when they are asked for, and help with what is used every day."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from symkin.cli.words import arguments_of, without_type

WHOLE_HELP = "whole help"  # key of the context's object


class HelpedCommand(TyperCommand):
    """A command whose help has the everyday options, and all in groups where that is asked for."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """What is typed behind the name, without the braces of typer's."""
        return ["[OPTIONS]", *arguments_of(self, ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments, everyday options, then the groups, or how to see them."""
        groups: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for each in self.get_params(ctx):
            record = each.get_help_record(ctx)
            if record is not None:
                is_argument = each.param_type_name == "argument"
                title = getattr(each, "rich_help_panel", None) or "Options"
                told = without_type(record) if is_argument else record
                groups.setdefault("Arguments" if is_argument else title, []).append(told)
        shown = list(groups) if ctx.obj[WHOLE_HELP] else ["Arguments", "Options"]
        for title in shown:
            if groups[title]:
                with formatter.section(title):
                    formatter.write_dl(groups[title])
        left = sum(len(records) for title, records in groups.items() if title not in shown)
        if left:
            formatter.write_paragraph()
            formatter.write_text(f"--help-all has {left} more options.")


# Where the function of each command is, in the order of the help.
_FUNCTIONS = {
    "check": "mechanism.check",
    "workspace": "mechanism.workspace",
    "pose-count": "protocol.pose_count",
    "plan": "protocol.plan",
    "simulate": "protocol.simulate",
    "measure": "measure.measure",
    "simulate-device": "measure.simulate_device",
    "identify": "identify.identify",
    "evaluate": "acceptance.evaluate",
    "accept": "acceptance.accept",
    "compare": "acceptance.compare",
    "show": "show.show",
    "run": "protocol.run",
    "kinematics": "mechanism.kinematics",
    "study": "protocol.study",
    "identify-batch": "identify.identify_batch",
    "align": "identify.align",
    "export": "mechanism.export",
    "import": "mechanism.import_",
    "new": "mechanism.new",
    "list": "mechanism.list_mechanisms",
}


class LoadedCommands(Mapping[str, Any]):
    """Commands by name, each loaded when it is first asked for: half of a short one is loading."""

    def __init__(self) -> None:
        self._loaded: dict[str, Any] = {}

    def __iter__(self) -> Iterator[str]:  # noqa: D105
        return iter(_FUNCTIONS)

    def __len__(self) -> int:  # noqa: D105
        return len(_FUNCTIONS)

    def __getitem__(self, name: str) -> Any:  # noqa: D105
        if name not in self._loaded:
            module, function = _FUNCTIONS[name].split(".")
            alone = typer.Typer(add_completion=False, rich_markup_mode=None)
            called = getattr(import_module(f"symkin.cli.{module}"), function)
            alone.command(name, cls=HelpedCommand)(called)
            self._loaded[name] = typer.main.get_command(alone)
        return self._loaded[name]


class Commands(TyperGroup):
    """The group of all commands."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.commands: Any = LoadedCommands()
