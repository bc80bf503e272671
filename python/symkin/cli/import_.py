# SPDX-License-Identifier: MIT
"""``symkin import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import say
from symkin.cli.help import with_example
from symkin.cli.options import OverwriteOption
from symkin.io.output_files import OutputFiles

_MECHANISM, _PROBED = "mechanism.toml", "probed.csv"


@with_example(
    "symkin import printer.cfg --out printer",
    "symkin identify printer/mechanism.toml printer/probed.csv --out calibrated",
)
def import_(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Klipper's printer.cfg of a linear delta, or an MJCF or URDF file of symkin.",
        ),
    ],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for mechanism.toml and probed.csv.")
    ],
    overwrite: OverwriteOption = False,
) -> None:
    """Make a mechanism file of a printer's configuration, and a table of what it has probed.

    Of Klipper's printer.cfg, linear deltas with what SAVE_CONFIG wrote: towers, rods, endstops, and
    the heights that DELTA_CALIBRATE recorded. Models are read if symkin wrote them. Last printed
    are the files that were written.
    """
    from symkin.exports.reading import import_mechanism

    with OutputFiles([file], overwrite) as outputs:
        folder = outputs.folder(out, _MECHANISM, _PROBED)
        found = import_mechanism(file)
        header = f"Read from {file.name}"
        symkin.save_mechanism(found.mechanism, folder / _MECHANISM, header=header)
        if found.measurements is not None:
            symkin.write_measurements(found.measurements, folder / _PROBED, found.mechanism)
    for note in found.notes:
        say(f"{note}.")
    say(str(out / _MECHANISM))
    if found.measurements is not None:
        say(str(out / _PROBED))
