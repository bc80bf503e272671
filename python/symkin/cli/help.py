# SPDX-License-Identifier: MIT
"""Help that begins with what is used every day."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand

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
