# SPDX-License-Identifier: MIT
"""The units that results are told in: one for all lengths, and one for all angles."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from contextvars import ContextVar

from symkin.errors import QuantityError
from symkin.storage.quantities import is_unit, unit_factor, unit_names
from symkin.storage.tables import WRITTEN_UNITS
from symkin.values import set_to

_SIGNS = {"deg": "\N{DEGREE SIGN}", "um": "\N{MICRO SIGN}m", "urad": "\N{MICRO SIGN}rad"}
_UNITS: ContextVar[tuple[str, str]] = ContextVar("units", default=("mm", "deg"))


def units_of(text: str) -> tuple[str, str]:
    """Return the units of lengths and angles of a text such as ``"mm,mrad"``; one may be missing.

    Raises
    ------
    QuantityError
        For what is no unit, and for two of one dimension.
    """
    length, angle = _UNITS.get()
    given = re.split(r"[\s,]+", text.strip()) if text.strip() else []
    named = [each for each in given if each in unit_names()]
    lengths, angles = ([each for each in named if is_unit(each, si)] for si in ("m", "rad"))
    if len(lengths) > 1 or len(angles) > 1 or len(lengths) + len(angles) < len(given):
        raise QuantityError(
            f'units are "{text}"; expected one of lengths, one of angles or both, such as '
            f'"mm,mrad", of {", ".join(unit_names())}'
        )
    return (lengths or [length])[0], (angles or [angle])[0]


@contextlib.contextmanager
def in_units(text: str) -> Iterator[None]:
    """Tell results in these units, such as ``"m,rad"``; what is not named stays as it is.

    Pages and texts are told in the units in which they are made, and tables are written in those
    that are asked for, to nanometres and nanoradians; else in m and rad, with all digits.
    """
    length, angle = units_of(text)
    written = {"m": length, "rad": angle} if text.strip() else {}
    with set_to(_UNITS, (length, angle)), set_to(WRITTEN_UNITS, written):
        yield


def on_paper(unit: str) -> tuple[float, str]:
    """Return how many of the unit that is told are one ``"m"`` or ``"rad"``, and its sign.

    Other units stay as they are.
    """
    length, angle = _UNITS.get()
    told = {"m": length, "rad": angle}.get(unit)
    if told is None:
        return 1.0, unit
    return 1 / unit_factor(told, unit), _SIGNS.get(told, told)
