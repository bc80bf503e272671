# SPDX-License-Identifier: MIT
"""Writes figures and tables of the page that judges the paper, and the figure of README.md.

Usage: .venv/bin/python docs/figures/paper.py out/study

The folder is that of `make study`; what is not there is computed.
"""

import sys
from pathlib import Path

import matplotlib as mpl

import symkin
from symkin import plot
from symkin.present import Table
from symkin.show.units import in_units
from symkin_paper import figures
from symkin_paper.page import FIG_9_CELLS, HEADLINE_CELLS, paper_page

FOLDER = Path(__file__).parent
# Section of the page, and how many of its tables are shown.
TABLES = {"identification": 1, "improvements": 2, "assumptions": 2, "further": 2}


def write(figure, name):
    figure.savefig(FOLDER / f"{name}.svg", metadata={"Date": None}, dpi=160)


def row(cells):
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def markdown(table):
    rows = [line for group in table.groups for line in group.rows]
    lines = [row(table.columns), "|---" * len(table.columns) + "|", *map(row, rows)]
    return "\n".join([f"{table.caption}:\n", *lines] if table.caption else lines)


def write_text(name, *parts):
    (FOLDER / f"paper-{name}.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def write_tables(page, claims):
    sections = {section.anchor: section for section in page.sections}
    for anchor, shown in TABLES.items():
        tables = [part for part in sections[anchor].parts if isinstance(part, Table)]
        write_text(anchor, *map(markdown, tables[:shown]))
    rows = [(f"“{each.quotation}” ({each.place})", each.verdict, each.sentence) for each in claims]
    write_text(
        "claims",
        "\n".join([row(("The paper", "Verdict", "Figures")), "|---|---|---|", *map(row, rows)]),
    )


@in_units("mm,mrad")  # the paper's
def main():
    mpl.rcParams["svg.hashsalt"] = "symkin"
    study = symkin.run_study("paper", sys.argv[1])
    found = study.findings
    cells = study.cells
    write(plot.chosen_readings(found.plan, found.workspace.sample), "paper-fig7")
    write(
        plot.protocol_errors({name: cells[cell] for name, cell in FIG_9_CELLS.items()}),
        "paper-fig9",
    )
    write(figures.local_errors(found.local), "paper-fig10")
    headline = {name: cells[cell] for name, cell in HEADLINE_CELLS.items()}
    write(plot.protocol_errors(headline, before=False), "protocols")
    write_tables(paper_page(study, found), found.claims)


if __name__ == "__main__":
    main()
