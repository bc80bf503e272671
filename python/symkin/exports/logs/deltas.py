# SPDX-License-Identifier: MIT
"""Terminal logs of delta printers: Marlin's G33, G30, G29 and M48, RepRapFirmware's G30 and G32.

A probe touches the bed where the controller, by the geometry that it knew then, has the nozzle: the
carriages' ways from their endstops are what that geometry makes of x, y and z, and the height is
zero. Sources: Marlin 2.1 src/gcode/calibrate/G33.cpp, M48.cpp, G30.cpp, M665.cpp, M666.cpp;
RepRapFirmware 3 RandomProbePointSet.cpp and LinearDeltaKinematics.cpp.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from symkin.exports.firmware import NOMINAL_DEGREES, LinearDelta
from symkin.exports.logs.log import Asked, ImportedLog, Log, LogFormat
from symkin.exports.printers import few_heights, printer_of, workspace_of
from symkin.values import Array

_NUMBER = r"[-+]?\d+(?:\.\d*)?|[-+]?\.\d+"
# Directions of G33's points, degrees; c is the middle.
_G33 = {"x": 210.0, "yz": 30.0, "y": 330.0, "zx": 150.0, "z": 90.0, "xy": 270.0}
_MOST_ROWS = 100_000


@dataclass
class _Printer:
    """Geometry as the log has it so far; mm and degrees."""

    radius: float | None = None
    rods: tuple[float, ...] = ()
    height: float | None = None
    trims: tuple[float, ...] = (0.0, 0.0, 0.0)
    stops: tuple[float, ...] = (0.0, 0.0, 0.0)  # how much lower the endstops are counted (Marlin)
    tilt: tuple[float, ...] = (0.0, 0.0)  # of the bed: what carriages rise by for x and for y
    printed: float | None = None

    def missing(self) -> list[str]:
        """What the geometry lacks."""
        wanted = {"rods": self.rods, "delta radius": self.radius, "height": self.height}
        return [name for name, value in wanted.items() if not value]

    def delta(self) -> LinearDelta:
        """The geometry, m and rad."""
        assert self.radius is not None
        assert self.height is not None
        arms = np.array(self.rods * (3 // len(self.rods)))
        heights = self.height - np.array(self.stops)
        with np.errstate(invalid="ignore", over="ignore"):
            ends = heights + np.sqrt(arms**2 - self.radius**2)
        return LinearDelta(
            self.radius * 1e-3,
            np.radians(np.add(NOMINAL_DEGREES, self.trims)),
            arms * 1e-3,
            ends * 1e-3,
            np.ones(3),
        )


@dataclass
class _Rows:
    """What was probed, with the geometry that was known then."""

    points: list[tuple[float, float, float]] = field(default_factory=list)
    printers: list[_Printer] = field(default_factory=list)

    def add(self, printer: _Printer, x: float, y: float, z: float) -> None:
        self.points.append((x, y, z))
        self.printers.append(dataclasses.replace(printer))


def _numbers(text: str) -> dict[str, float]:
    """Words of a command or an answer: letters and a number behind them."""
    found = re.findall(rf"([A-Za-z]+)\s*:?\s*({_NUMBER})", text)
    return {name.lower(): float(value) for name, value in found}


def _imported(
    log: Log, kind: str, rows: _Rows, last: _Printer, left: Sequence[str], repeats: Sequence[float]
) -> ImportedLog:
    """The table and the printer that a log tells of."""
    if len(rows.points) > _MOST_ROWS:
        raise log.error(f"has {len(rows.points)} probed points; expected at most {_MOST_ROWS}")
    printers = [_completed(each, last) for each in rows.printers]
    lacking = last.missing()
    if lacking:
        raise log.error(
            f"says nothing of the {' and '.join(lacking)}; add what the printer answers to "
            f"{'M665 and M666' if kind == REPRAP.title else 'M503'} to the log"
        )
    deltas = [each.delta() for each in printers]
    final = last.delta()
    for each in (*deltas, final):
        if not 0 < each.radius < each.arms.min() or not np.isfinite(each.endstops).all():
            raise log.error(
                f"has rods of {1e3 * each.arms.min():g} mm and a delta radius of "
                f"{1e3 * each.radius:g} mm; expected rods longer than a positive radius"
            )
    # Ways count from the endstops that the last geometry knows; where they are has not moved.
    ways = [
        _carriages(delta, np.array(point) * 1e-3, each.tilt) - delta.endstops
        for each, delta, point in zip(printers, deltas, rows.points, strict=True)
    ]
    columns = {}
    if ways:
        if not np.isfinite(ways).all():
            bad = int(np.flatnonzero(~np.isfinite(ways).all(axis=1))[0])
            x, y, _ = rows.points[bad]
            raise log.error(f"probed x {x:g} y {y:g} mm, which its rods do not reach")
        columns = {f"psi_{leg + 1}_m": np.array(ways)[:, leg] for leg in range(3)}
        columns["height_m"] = np.zeros(len(ways))
    mechanism = printer_of(
        log.path.stem,
        final.legs((0.0, 0.0, 0.0)),
        workspace_of(final, (last.printed or last.radius or 0.0) * 1e-3),
        few=few_heights(len(ways)),
        probe=float(np.sqrt(np.mean(np.square(repeats)))) * 1e-3 if repeats else None,
    )
    took = (
        *[f"{len(ways)} probed points"] * bool(ways),
        "the printer's geometry, as the log has it last",
        *[f"how well the probe repeats, of {len(repeats)} M48"] * bool(repeats),
    )
    return ImportedLog(kind, columns, mechanism, took, tuple(left))


def _completed(early: _Printer, last: _Printer) -> _Printer:
    """Geometry of a row; what was not said until then as it was said first."""
    return dataclasses.replace(
        early,
        radius=early.radius or last.radius,
        rods=early.rods or last.rods,
        height=early.height or last.height,
    )


def _carriages(delta: LinearDelta, point: Array, tilt: Sequence[float]) -> Array:
    """Heights of the carriages' joints with the nozzle there, above a bed that is tilted."""
    towers = delta.radius * np.column_stack([np.cos(delta.angles), np.sin(delta.angles)])
    across = np.square(towers - point[:2]).sum(axis=1)
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(point[2] + point[:2] @ tilt + np.sqrt(delta.arms**2 - across))


def _is_configuration(log: Log) -> bool:
    """Whether it is Klipper's, which may quote any command in its macros."""
    return bool(re.search(rb"^\s*\[printer\]", log.data, re.MULTILINE))


def _is_marlin(log: Log) -> bool:
    return not _is_configuration(log) and bool(
        re.search(r"G33 Auto Calibrate|M48 Z-Probe Repeatability|\bBed X:", log.text, re.M)
        or re.search(r"^\W*(?:echo:)?\s*M665\s.*\bL\s*\d.*\bS\s*\d", log.text, re.M)
    )


def _read_marlin(log: Log, asked: Asked) -> ImportedLog:
    printer, rows = _Printer(), _Rows()
    left: list[str] = []
    repeats: list[float] = []
    unplaced = calibrations = 0
    for line in log.lines:
        said = line.strip()
        settings = re.match(r"(?:.*?[>:]\s*)?(M66[56])\b(.*)", said)
        if settings and "Unknown" not in said:
            _set_marlin(printer, settings[1], _numbers(settings[2]))
        elif said.startswith(".Height:") or re.match(r"\.\s*(Tx|T[xyz]:)", said):
            _set_by_g33(printer, _numbers(said))
        elif re.match(r"\.\s+(?:c:|yz:|x:|zx:|xy:)", said):
            for name, value in _numbers(said).items():
                if name == "c":
                    rows.add(printer, 0.0, 0.0, value)
                elif name in _G33 and asked.radius is None:
                    unplaced += 1
                elif name in _G33 and asked.radius is not None:
                    x, y = 1e3 * asked.radius * _direction(_G33[name])
                    rows.add(printer, x, y, value)
        elif (bed := re.match(rf".*Bed X:\s*({_NUMBER})\s*Y:\s*({_NUMBER})\s*Z:\s*({_NUMBER})",
                              said)):  # fmt: skip
            rows.add(printer, *map(float, bed.groups()))
        elif spread := re.match(rf".*Standard Deviation:\s*({_NUMBER})", said):
            repeats.append(float(spread[1]))
        calibrations += said.startswith("Iteration")
    if unplaced:
        raise log.error(
            f"has {unplaced} points of G33, whose log does not say how far from the middle they "
            "are; say it: --radius 80mm (DELTA_PRINTABLE_RADIUS less the probe's offset and "
            "PROBING_MARGIN)"
        )
    if calibrations:
        left.append(f"what Marlin made of them in {calibrations} iterations: its deviations")
    if rows.points and asked.radius is not None and any("Auto Calibrate" in x for x in log.lines):
        left.append("that G33 may have averaged several points of a circle into one")
    if calibrations and not rows.points:
        left.append("the points of G33, which it prints with V2 or V3 alone")
    if not rows.points and not repeats:
        raise log.error(
            "has no probed points: G33 prints them with V2 or V3, G30 and G29 V4 do as Bed X: ..."
        )
    return _imported(log, MARLIN.title, rows, printer, left, repeats)


def _direction(degrees: float) -> Array:
    angle = np.radians(degrees)
    return np.array([np.cos(angle), np.sin(angle)])


def _set_marlin(printer: _Printer, command: str, said: dict[str, float]) -> None:
    if command == "M666":
        printer.stops = _said(said, "xyz", printer.stops)
        return
    printer.radius = said.get("r", printer.radius)
    printer.height = said.get("h", printer.height)
    if "l" in said:
        trims = (said.get(name, 0.0) for name in "abc")  # of the rods
        printer.rods = tuple(said["l"] + each for each in trims)
    elif any(name in said for name in "abc") and printer.rods:
        return
    printer.trims = _said(said, "xyz", printer.trims)


def _said(
    said: dict[str, float], names: Sequence[str], old: tuple[float, ...]
) -> tuple[float, ...]:
    """What is said of three towers, or else what was known."""
    return tuple(said.get(name, value) for name, value in zip(names, old, strict=True))


def _set_by_g33(printer: _Printer, said: dict[str, float]) -> None:
    printer.height = said.get("height", printer.height)
    printer.radius = said.get("radius", printer.radius)
    printer.stops = _said(said, ("ex", "ey", "ez"), printer.stops)
    printer.trims = _said(said, ("tx", "ty", "tz"), printer.trims)


MARLIN = LogFormat("marlin", "Marlin's terminal", _is_marlin, _read_marlin)


def _is_reprap(log: Log) -> bool:
    return not _is_configuration(log) and bool(
        re.search(r"bed probe heights:|Diagonals? [\d.:]+, delta radius", log.text, re.I)
        or re.search(r"^\W*G30\s+P\d+\s", log.text, re.M)
    )


def _read_reprap(log: Log, asked: Asked) -> ImportedLog:
    printer, rows = _Printer(), _Rows()
    left: list[str] = []
    places: dict[int, tuple[float, float]] = {}
    calibrated = failed = unplaced = 0
    for line in log.lines:
        said = line.strip().partition(";")[0]
        if re.search(r"delta radius", said, re.I):
            _set_by_report(printer, said)
        elif re.search(r"Endstop adjustments", said):
            stops, _, tilt = said.partition("tilt")
            printer.stops = tuple(-each for each in _xyz(stops))
            printer.tilt = tuple(each / 100 for each in _xyz(tilt)[:2])
        elif command := re.match(r"(?:.*?>\s*)?(M66[56])\s+(.*)", said):
            _set_reprap(printer, command[1], command[2])
        elif point := re.match(r"(?:.*?>\s*)?G30\s+(.*)", said):
            words = _numbers(point[1])
            if "p" in words and {"x", "y"} <= words.keys():
                if words["p"] == 0:
                    places = {}
                places[int(words["p"])] = words["x"], words["y"]
        elif probed := re.search(r"bed probe heights:(.*?)(?:, mean|$)", said, re.I):
            for number, text in enumerate(_heights(probed[1])):
                if text is None:
                    failed += 1
                elif number not in places:
                    unplaced += 1
                else:
                    rows.add(printer, *places[number], text)
        calibrated += "Calibrated" in said
    if unplaced:
        raise log.error(
            f"has {unplaced} probed heights and no positions for them; put the commands G30 P0 "
            "X... Y... of bed.g above them, all of them in their order"
        )
    left += [f"{failed} points whose probing failed"] * bool(failed)
    left += [f"{calibrated} calibrations that the firmware made of them"] * bool(calibrated)
    if not rows.points:
        raise log.error(
            'has no probed heights ("bed probe heights: ..."): the last G30 of bed.g prints them '
            "with S-1"
        )
    if asked.radius is not None:
        left.append("the radius: the commands say where was probed")
    return _imported(log, REPRAP.title, rows, printer, left, ())


def _heights(text: str) -> Iterator[float | None]:
    for each in re.findall(rf"not set|probing failed|{_NUMBER}", text):
        yield None if each in ("not set", "probing failed") else float(each)


def _xyz(text: str) -> tuple[float, ...]:
    found = {k.lower(): float(v) for k, v in re.findall(rf"\b([XYZ])\s*({_NUMBER})", text)}
    return tuple(found.get(axis, 0.0) for axis in "xyz")


def _set_by_report(printer: _Printer, said: str) -> None:
    """The answer to M665: Diagonals 215.000:215.000:215.000, delta radius 105.600, ..."""
    _set_rods(printer, r"Diagonals?\s+", said, re.I)
    for name, words in (
        ("radius", "delta radius"), ("height", "homed height"), ("printed", "bed radius")
    ):  # fmt: skip
        found = re.search(rf"{words}\s+({_NUMBER})", said, re.I)
        if found:
            setattr(printer, name, float(found[1]))
    printer.trims = _xyz(said)


def _set_rods(printer: _Printer, before: str, text: str, flags: int = 0) -> None:
    """One length for all towers, or three with colons between, if they are there."""
    if rods := re.search(rf"{before}((?:{_NUMBER})(?::(?:{_NUMBER}))*)", text, flags):
        values = tuple(map(float, rods[1].split(":")))
        printer.rods = values if len(values) in (1, 3) else values[:1]


def _set_reprap(printer: _Printer, command: str, words: str) -> None:
    said = _numbers(words)
    if command == "M666":
        parts = {name: value / 100 if name in "ab" else -value for name, value in said.items()}
        printer.stops = _said(parts, "xyz", printer.stops)
        printer.tilt = _said(parts, "ab", printer.tilt)
        return
    _set_rods(printer, "L", words)
    printer.radius = said.get("r", printer.radius)
    printer.height = said.get("h", printer.height)
    printer.printed = said.get("b", printer.printed)
    printer.trims = _said(said, "xyz", printer.trims)


REPRAP = LogFormat("reprap", "RepRapFirmware's console", _is_reprap, _read_reprap)
