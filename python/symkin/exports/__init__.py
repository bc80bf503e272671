# SPDX-License-Identifier: MIT
"""Mechanisms in the formats of controllers and simulators, and printers read from theirs.

A format is one function that makes a text of a mechanism. What it cannot express it refuses, or it
writes the nearest that it can and says what is lost, as errors of the end-effector.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import MechanismError, one_of
from symkin.exports.exported import Exported, ExportOptions, Loss, Written
from symkin.io.output_files import OutputFiles
from symkin.mechanism import Mechanism

__all__ = ["FORMATS", "Exported", "Format", "Loss", "export", "joint_values"]


class Format(NamedTuple):
    """Where a format is written, and what it is.

    Attributes
    ----------
    module, function : str
        In `symkin.exports`; imported when it is used.
    description : str
        For a list.
    """

    module: str
    function: str
    description: str


FORMATS = {
    "klipper": Format("printers", "write_klipper", "sections of printer.cfg; deltas"),
    "marlin": Format("firmware", "write_marlin", "M665, M666; linear deltas"),
    "reprapfirmware": Format("firmware", "write_reprapfirmware", "M665, M666; linear deltas"),
    "linuxcnc": Format("firmware", "write_linuxcnc", "hexapods and linear deltas"),
    "mjcf": Format("models", "write_mjcf", "MuJoCo, loops closed by constraints"),
    "urdf": Format("models", "write_urdf", "a tree, loops cut"),
    "sdf": Format("models", "write_sdf", "Gazebo, loops closed by ball joints"),
    "json": Format("parameters", "write_json", "parameters, units, deviations"),
    "yaml": Format("parameters", "write_yaml", "the same"),
    "c-header": Format("parameters", "write_c_header", "constants of C and C++"),
    "table": Format("parameters", "write_table", "pose wanted, pose to command"),
}


def export(
    mechanism: Mechanism,
    to: str,
    path: str | os.PathLike[str] | None = None,
    *,
    endstops: float | Sequence[float] = (),
    nominal: Mechanism | None = None,
    grid: int = 0,
    overwrite: bool = False,
) -> Exported:
    """Write a mechanism in the format of a controller or a simulator.

    Parameters
    ----------
    mechanism : Mechanism
        Usually a calibrated one.
    to : str
        One of `symkin.exports.FORMATS`.
    path : str or path, optional
        The file to write; without it there is only the text.
    endstops : float or sequence of float
        What the sensors read at their endstops, m or rad: one number, or one for each leg. By
        default the joint limit: of linear deltas the upper, of rotary deltas the lower one. For
        "klipper", "marlin", "reprapfirmware" and "linuxcnc" of deltas.
    nominal : Mechanism, optional
        What the controller computes with; for "table".
    grid : int
        Poses along each coordinate of a table; 0 for 21, and 5 of six coordinates.
    overwrite : bool
        Whether `path` may exist.

    Returns
    -------
    Exported
        The text, what else to know, and what was lost.

    Raises
    ------
    SymkinError
        For an unknown format, or a robot that the format cannot express, with the reason.
    """
    chosen: Format = one_of("to", to, FORMATS)
    stops = tuple(np.atleast_1d(np.asarray(endstops, dtype=np.float64)).tolist())
    options = ExportOptions(stops, nominal, grid)
    if mechanism.sensor_table is not None:
        raise MechanismError(
            f'the sensors of "{mechanism.name}" are made straight by a table, which no format has; '
            "take [sensor_table] out of its file if the controller itself makes them straight"
        )
    module = importlib.import_module(f"symkin.exports.{chosen.module}")
    if path is None:
        written: Written = getattr(module, chosen.function)(mechanism, options)
    else:
        inputs = [*mechanism.files, *(nominal.files if nominal else ())]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.file(Path(path))
            written = getattr(module, chosen.function)(mechanism, options)
            target.write_text(written.text, encoding="utf-8", newline="")
    return Exported(to, written.text, written.notes, written.loss)


def joint_values(mechanism: Mechanism, poses: ArrayLike) -> dict[str, np.ndarray]:
    """Values of all joints of an exported model at poses, passive ones too.

    Parameters
    ----------
    mechanism : Mechanism
        As it was exported.
    poses : array_like, shape (N, coordinates)
        In reach; where it is not, values are NaN.

    Returns
    -------
    dict of str to ndarray, shape (N,) or (N, 7)
        By the names of the joints in the MJCF and URDF files, m and rad: put into them, they close
        the loops. The joint ``platform`` of a spatial robot has position and quaternion, scalar
        first. In an SDF file joints count from home: subtract the values there.

    Raises
    ------
    SymkinError
        As `export` to a model does.
    """
    from symkin.exports.structure import structure_of

    return dict(structure_of(mechanism, poses).values)
