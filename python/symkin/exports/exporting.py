# SPDX-License-Identifier: MIT
"""Writing a mechanism in the format of a controller or a simulator."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import MechanismError, SymkinError, one_of
from symkin.exports.common import ExportOptions, Loss, Written
from symkin.exports.firmware import (
    write_klipper,
    write_linuxcnc,
    write_marlin,
    write_reprapfirmware,
)
from symkin.exports.known_bodies import structure_of
from symkin.exports.models import write_mjcf, write_sdf, write_urdf
from symkin.exports.parameters import write_c_header, write_json, write_table, write_yaml
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.options import checks
from symkin.storage.output_files import OutputFiles
from symkin.values import Value, field, record


@record
class Exported(Value):
    """A mechanism in another format.

    Attributes
    ----------
    format : str
        One of `symkin.exports.FORMATS`.
    text : str
        What the file holds.
    notes : tuple of str
        What a person must know or do besides.
    loss : Loss or None
        The errors that remain when a controller uses the file; None for a format that holds
        everything.
    """

    format: str
    text: str = field(private=True)
    notes: tuple[str, ...]
    loss: Loss | None


class Format(NamedTuple):
    """Where a format is written, and what it is.

    Attributes
    ----------
    write : callable
        Makes the text of a mechanism.
    description : str
        For a list.
    """

    write: Callable[[Mechanism, ExportOptions], Written]
    description: str


FORMATS = {
    "klipper": Format(write_klipper, "sections of printer.cfg; deltas"),
    "marlin": Format(write_marlin, "M665, M666; linear deltas"),
    "reprapfirmware": Format(write_reprapfirmware, "M665, M666; linear deltas"),
    "linuxcnc": Format(write_linuxcnc, "hexapods and linear deltas"),
    "mjcf": Format(write_mjcf, "MuJoCo, loops closed by constraints"),
    "urdf": Format(write_urdf, "a tree, loops cut"),
    "sdf": Format(write_sdf, "Gazebo, loops closed by ball joints"),
    "json": Format(write_json, "parameters, units, deviations"),
    "yaml": Format(write_yaml, "the same"),
    "c-header": Format(write_c_header, "constants of C and C++"),
    "table": Format(write_table, "pose wanted, pose to command"),
}
# Which formats use what else may be said; others refuse it.
_TAKEN_BY = {
    "endstops": ("klipper", "marlin", "reprapfirmware", "linuxcnc"),
    "nominal": ("table",),
    "grid": ("table",),
}


@checks()
def export(
    mechanism: MechanismGiven,
    to: str,
    path: str | os.PathLike[str] | None = None,
    *,
    endstops: float | Sequence[float] = (),
    nominal: MechanismGiven | None = None,
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
    mechanism = as_mechanism(mechanism)
    nominal = None if nominal is None else as_mechanism(nominal, "nominal")
    chosen: Format = one_of("to", to, FORMATS)
    stops = tuple(np.atleast_1d(np.asarray(endstops, dtype=np.float64)).tolist())
    options = ExportOptions(stops, nominal, grid)
    for name, formats in _TAKEN_BY.items():
        if getattr(options, name) and to not in formats:
            raise SymkinError(
                f'the format "{to}" has no use for {name}; expected only with {", ".join(formats)}'
            )
    if mechanism.sensor_table is not None:
        raise MechanismError(
            f'the sensors of "{mechanism.name}" are made straight by a table, which no format has; '
            "take [sensor_table] out of its file if the controller itself makes them straight"
        )
    if path is None:
        written = chosen.write(mechanism, options)
    else:
        inputs = [*mechanism.files, *(nominal.files if nominal else ())]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.file(Path(path))
            written = chosen.write(mechanism, options)
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
    return dict(structure_of(mechanism, poses).values)
