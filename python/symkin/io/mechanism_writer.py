# SPDX-License-Identifier: MIT
"""Writing mechanism files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import tomlkit

from symkin.errors import SymkinError
from symkin.identification.calibrated import canonical
from symkin.io.mechanism_file import load_mechanism
from symkin.io.mechanism_text import (
    Values,
    commented_out,
    leg_values,
    settings_values,
    update_table,
)
from symkin.io.output_files import OutputFiles
from symkin.mechanism import Mechanism
from symkin.symmetry import generate_legs, verify_declared

__all__ = ["mechanism_text", "save_mechanism"]


def save_mechanism(
    mechanism: Mechanism,
    path: str | os.PathLike[str],
    *,
    template: str | os.PathLike[str] | None = None,
    header: str = "",
    overwrite: bool = False,
) -> None:
    """Write a mechanism as a TOML file that reads back to the same mechanism.

    Points with negative radii are written as the same points with positive ones.

    Parameters
    ----------
    mechanism : Mechanism
        Its legs are listed in full, each parameter with its standard deviation if `deviations` has
        one, unless its symmetry generates exactly these legs.
    path : str or path
        The file to write.
    template : str or path, optional
        A mechanism file whose comments, expressions and settings are kept where they still hold;
        by default the file that the mechanism was read from, if any.
    header : str
        Where the parameters come from; written as comments at the top.
    overwrite : bool
        Whether `path` may exist, be it the template or the file that the mechanism was read from.

    Raises
    ------
    SymkinError
        If `path` exists without `overwrite`, if the template has another chain, if the declared
        symmetry does not hold, or if the file could not be read, as for a home pose out of reach.
    """
    template = Path(template) if template is not None else mechanism.source
    with OutputFiles(overwrite=overwrite) as outputs:
        target = outputs.file(Path(path))
        text = mechanism_text(mechanism, template=template, header=header)
        target.write_text(text, encoding="utf-8", newline="")
        try:
            load_mechanism(target)
        except SymkinError as error:
            reason = str(error).replace(str(target), str(path))
            raise SymkinError(f"a file of this mechanism could not be read: {reason}") from error


def mechanism_text(mechanism: Mechanism, *, template: Path | None = None, header: str = "") -> str:
    """Return the text that `save_mechanism` writes."""
    values, signs = canonical(mechanism, mechanism.parameters)
    if (signs < 0).any():
        mechanism = mechanism.with_parameters(values, mechanism.deviations)
    if mechanism.symmetry is not None:
        verify_declared(mechanism)
    if template is None:
        return _commented(header) + _new_text(mechanism)
    original = load_mechanism(template)
    kind, expected = _kind(mechanism), _kind(original)
    if kind != expected:
        raise SymkinError(f"{template}: has {expected}, the mechanism to write {kind}")
    text = template.read_text(encoding="utf-8-sig")
    return _commented(header) + _edited(text, mechanism, original)


def _kind(mechanism: Mechanism) -> str:
    return (
        f"chain {mechanism.chain} with a {mechanism.platform} platform and readings in "
        f"{mechanism.reading_unit}"
    )


def _commented(header: str) -> str:
    lines = [f"# {line}".rstrip() for line in header.splitlines()]
    return "\n".join([*lines, "", ""]) if lines else ""


def _new_text(mechanism: Mechanism) -> str:
    document = tomlkit.document()
    document.update(
        {
            "schema": 1,
            "name": mechanism.name,
            "chain": mechanism.chain,
            "platform": mechanism.platform,
            "reading_unit": mechanism.reading_unit,
        }
    )
    for section, values in settings_values(mechanism).items():
        if values:
            table = tomlkit.table()
            update_table(table, values, {})
            document.add(section, table)
    return document.as_string() + _symmetry_text(mechanism) + _leg_text(mechanism)


def _edited(text: str, mechanism: Mechanism, original: Mechanism) -> str:
    """The template's text with what differs from the original mechanism brought up to date."""
    document = tomlkit.parse(text)
    if mechanism.name != original.name or "name" not in document:
        document["name"] = mechanism.name
    present = settings_values(original)
    for section, values in settings_values(mechanism).items():
        if values == present[section]:
            continue
        if not values:
            document.remove(section)
            continue
        if section not in document:
            document.add(section, tomlkit.table())
        update_table(document[section], values, present[section])
    if _same_legs(mechanism, original) and mechanism.symmetry == original.symmetry:
        return document.as_string()
    if mechanism.symmetry == original.symmetry and _edit_legs(document, mechanism, original):
        return document.as_string()
    text = document.as_string()
    if mechanism.symmetry != original.symmetry:
        text = commented_out(text, "symmetry", _symmetry_text(mechanism))
    old_legs = "legs" if "legs" in document else "reference_leg"
    return commented_out(text, old_legs, _leg_text(mechanism))


def _edit_legs(document: tomlkit.TOMLDocument, mechanism: Mechanism, original: Mechanism) -> bool:
    """Bring the template's own leg tables up to date, if they can hold the new legs."""
    if "reference_leg" in document and _is_generated(mechanism):
        update_table(document["reference_leg"], leg_values(mechanism, 0), leg_values(original, 0))
        return True
    if "legs" in document and len(mechanism.legs) == len(original.legs):
        tables: Any = document["legs"]
        for leg, table in enumerate(tables):
            update_table(table, leg_values(mechanism, leg), leg_values(original, leg))
        return True
    return False


def _same_legs(mechanism: Mechanism, original: Mechanism) -> bool:
    legs = range(len(mechanism.legs))
    return len(mechanism.legs) == len(original.legs) and all(
        leg_values(mechanism, leg) == leg_values(original, leg) for leg in legs
    )


def _is_generated(mechanism: Mechanism) -> bool:
    """Whether the declared symmetry generates exactly these legs from the first."""
    if mechanism.symmetry is None or mechanism.deviations is not None:
        return False
    legs = list(mechanism.legs)
    generated = generate_legs(legs[0], mechanism.symmetry, len(legs))
    return all(
        dict(a.parameters) == dict(b.parameters) and a.working_mode == b.working_mode
        for a, b in zip(legs, generated, strict=True)
    )


def _symmetry_text(mechanism: Mechanism) -> str:
    symmetry = mechanism.symmetry
    if symmetry is None:
        return ""
    values: Values = {"group": symmetry.group, "legs": len(mechanism.legs)}
    if symmetry.axis:
        values["axis"] = symmetry.axis
    if symmetry.elements is not None:
        values["elements"] = list(symmetry.elements)
    return "\n" + tomlkit.dumps({"symmetry": values})


def _leg_text(mechanism: Mechanism) -> str:
    """One reference leg if the symmetry generates the others, else all legs."""
    if _is_generated(mechanism):
        tables = [("[reference_leg]", leg_values(mechanism, 0))]
    else:
        legs = range(len(mechanism.legs))
        tables = [("[[legs]]", leg_values(mechanism, leg)) for leg in legs]
    text = ""
    for heading, values in tables:
        document = tomlkit.document()
        update_table(document, values, {})
        text += f"\n{heading}\n{document.as_string()}"
    return text
