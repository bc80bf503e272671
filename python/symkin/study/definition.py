# SPDX-License-Identifier: MIT
"""What a study compares: TOML files, and the cells that their lists stand for."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import itertools
import json
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypedDict, get_args

from symkin.analysis.observability import RowKind
from symkin.errors import StudyFileError, SymkinError, did_you_mean
from symkin.estimate.options import Estimator, Loss, PoseUse
from symkin.files.mechanism_file import read_mechanism
from symkin.files.mechanism_writer import mechanism_text
from symkin.model.mechanism import Mechanism
from symkin.planning.selection import Criterion, Design, SelectionMethod
from symkin.storage.toml_file import (
    Kind,
    WrongValueError,
    boolean,
    choice,
    dotted,
    list_of,
    quantity,
    read_toml,
    schema_version,
    table,
    text,
    whole,
)
from symkin.study.extension import KNOWN, StudyExtension, extension_named, extension_names
from symkin.values import record
from symkin.version import version

StudyKind = Literal["accuracy", "cost", "symmetry"]
_BUILTIN = Path(__file__).parent / "builtin"
_PER_PARAMETER = re.compile(r"(\d+(?:\.\d+)?) ?p")
_MOST_CELLS = 10_000


@record
class Cell:
    """One way to plan, measure and identify.

    Attributes
    ----------
    id : str
        Its name: the same in every study where nothing else is compared, unique in each.
    mechanism : str
        The mechanism's name.
    design, rows, criterion, method, use_symmetry, margin_sigmas
        As `make_plan` takes them.
    pose_count : int
        Poses that each leg is identified from.
    noise_level, tolerance_level : float
        How many times the noise and the tolerances are those of the mechanism. The estimator knows
        of the noise; the plan is made for the mechanism's own.
    estimator, use, loss
        As `identify` takes them; `use` is its `poses`.
    """

    id: str
    mechanism: str
    design: Design
    rows: RowKind
    criterion: Criterion
    method: SelectionMethod
    use_symmetry: bool
    margin_sigmas: float
    pose_count: int
    noise_level: float
    tolerance_level: float
    estimator: Estimator
    use: PoseUse
    loss: Loss

    @property
    def plan_key(self) -> tuple[Any, ...]:
        """What its plan depends on."""
        return (
            self.mechanism, self.design, self.rows, self.criterion, self.method,
            self.use_symmetry, self.margin_sigmas, self.pose_count,
        )  # fmt: skip

    @property
    def robot_key(self) -> tuple[str, float]:
        """What its robots depend on."""
        return self.mechanism, self.tolerance_level

    @property
    def measured_key(self) -> tuple[Any, ...]:
        """What its measurements depend on."""
        return (*self.plan_key, self.noise_level, self.tolerance_level)


def _pose_count() -> Kind:
    number = whole(1, 10**6)

    def read(raw: Any) -> int | str:
        if not isinstance(raw, str):
            return int(number.read(raw))
        if not _PER_PARAMETER.fullmatch(raw):
            raise WrongValueError(
                f'is "{raw}"; expected a number, or a text such as "3p" for three times as many as '
                "a leg has parameters that are estimated"
            )
        return raw

    return Kind(read, {"type": ["integer", "string"]})


def _mechanism() -> Kind:
    def read(raw: Any) -> str | Mechanism:
        if isinstance(raw, Mechanism):
            return raw
        name: str = text().read(raw)
        return name

    return Kind(read, {"type": "string"})


def _several(kind: Kind) -> Kind:
    """A list of values, or one of them; as a tuple."""
    items = list_of(kind, 1, 1000)

    def read(raw: Any) -> tuple[Any, ...]:
        values = list(raw) if isinstance(raw, list | tuple) else [raw]
        read: tuple[Any, ...] = tuple(items.read(values))
        for at, value in enumerate(read):
            if value in read[:at]:
                raise WrongValueError(f"has {value!r} twice; expected each once")
        return read

    return Kind(read, {"anyOf": [kind.schema, items.schema]})


def _words(values: Any) -> Kind:
    return _several(choice(*get_args(values)))


# The lists that are multiplied, in the order in which cells stand: the last changes fastest. A
# `Cell` has one of each in this order.
_FACTORS: dict[str, Kind] = {
    "mechanisms": _several(_mechanism()),
    "designs": _words(Design),
    "rows": _words(RowKind),
    "criteria": _words(Criterion),
    "methods": _words(SelectionMethod),
    "use_symmetry": _several(boolean()),
    "margin_sigmas": _several(quantity("1", "not negative")),
    "pose_counts": _several(_pose_count()),
    "noise_levels": _several(quantity("1", "positive")),
    "tolerance_levels": _several(quantity("1", "positive")),
    "estimators": _words(Estimator),
    "use": _words(PoseUse),
    "losses": _words(Loss),
}
_SETTINGS: dict[str, Kind] = {
    "schema": schema_version(1),
    "title": text(200),
    "kind": choice(*get_args(StudyKind)),
    "robots": whole(1, 10**7),
    "seed": whole(0, 2**63 - 1),
    "evaluation_poses": whole(1, 10**6),
    "candidates": whole(1, 10**7),
    "legs": _several(whole(2, 64)),
    "reading_noises": _several(quantity("1", "not negative", "in the sensor's unit")),
    "repetitions": whole(1, 1000),
}
_OF_COST = ("legs", "repetitions")
_NOT_OF_COST = (
    "designs", "methods", "use_symmetry", "margin_sigmas", "noise_levels", "tolerance_levels",
    "estimators", "use", "losses", "cell", "robots", "evaluation_poses",
)  # fmt: skip
_STUDY = table(
    _SETTINGS | _FACTORS | {"cell": list_of(table({"id": text(200)} | _FACTORS), 1, _MOST_CELLS)},
    ("mechanisms",),
)


def _refuse_unused(given: Mapping[str, Any]) -> None:
    """Refuse what the kind of study would pass over in silence."""
    kind = given.get("kind", "accuracy")
    unused = _NOT_OF_COST if kind == "cost" else _OF_COST
    for name in given:
        if name in unused or (name == "reading_noises" and kind != "symmetry"):
            raise WrongValueError(f"changes nothing in a study of {kind}", (name,))
        if kind == "cost" and name in ("rows", "criteria", "pose_counts") and len(given[name]) > 1:
            raise WrongValueError(
                f"has {len(given[name])} values; a study of cost times one combination of each "
                "mechanism",
                (name,),
            )


class CellLists(TypedDict, total=False):
    """What a product of its own says: lists, and the name of a single combination."""

    id: str
    mechanisms: tuple[str | Mechanism, ...]
    designs: tuple[Design, ...]
    rows: tuple[RowKind, ...]
    criteria: tuple[Criterion, ...]
    methods: tuple[SelectionMethod, ...]
    use_symmetry: tuple[bool, ...]
    margin_sigmas: tuple[float, ...]
    pose_counts: tuple[int | str, ...]
    noise_levels: tuple[float, ...]
    tolerance_levels: tuple[float, ...]
    estimators: tuple[Estimator, ...]
    use: tuple[PoseUse, ...]
    losses: tuple[Loss, ...]


@dataclass(frozen=True, kw_only=True)
class StudyDefinition:
    """What a study compares; the attributes are the keys of its file.

    Every combination of the lists is a cell. With `cell`, every one of its tables is such a product
    by itself, in which the lists of the study stand for those that it leaves out.

    Attributes
    ----------
    mechanisms : tuple of str or Mechanism
        Names of shipped mechanisms, files, or mechanisms.
    kind : {"accuracy", "cost", "symmetry"}
        What is asked: what accuracy a protocol gives; what it costs to compute; how much asymmetry
        it bears.
    title : str
        Of its page.
    designs, rows, criteria, methods, use_symmetry, margin_sigmas
        As `make_plan` takes them, each a tuple.
    pose_counts : tuple of int or str
        Poses that each leg is identified from; ``"3p"`` is three times as many as a leg has
        parameters that are estimated, those that are held left out. By default the mechanism's.
    noise_levels, tolerance_levels : tuple of float
        Multiples of the mechanism's noise and tolerances.
    estimators, use, losses
        As `identify` takes them, each a tuple.
    cell : tuple of mappings
        Products of their own, each of the lists above and perhaps, for a single combination, an
        ``id``.
    robots : int
        Simulated robots in each cell.
    seed : int
        Of candidates, plans, robots and noise.
    evaluation_poses : int
        Poses of the workspace over which errors are taken.
    candidates : int or None
        Poses to choose from, by default the mechanism's.
    legs : tuple of int
        Numbers of legs of a study of cost.
    repetitions : int
        How often a study of cost measures each time.
    reading_noises : tuple of float
        Standard deviations of the readings, in the sensor's unit, that a study of symmetry lets the
        selection ignore.
    name : str
        Of the file, or of the built-in study.

    Raises
    ------
    SymkinError
        Naming the key and the valid values.
    """

    mechanisms: tuple[str | Mechanism, ...]
    kind: StudyKind = "accuracy"
    title: str = ""
    designs: tuple[Design, ...] = ("legs",)
    rows: tuple[RowKind, ...] = ("noise_aware",)
    criteria: tuple[Criterion, ...] = ("O1",)
    methods: tuple[SelectionMethod, ...] = ("exchange",)
    use_symmetry: tuple[bool, ...] = (True,)
    margin_sigmas: tuple[float, ...] = (3.0,)
    pose_counts: tuple[int | str, ...] = ()
    noise_levels: tuple[float, ...] = (1.0,)
    tolerance_levels: tuple[float, ...] = (1.0,)
    estimators: tuple[Estimator, ...] = ("implicit",)
    use: tuple[PoseUse, ...] = ("all",)
    losses: tuple[Loss, ...] = ("none",)
    cell: tuple[CellLists, ...] = ()
    robots: int = 1000
    seed: int = 1
    evaluation_poses: int = 1000
    candidates: int | None = None
    legs: tuple[int, ...] = tuple(range(2, 13))
    repetitions: int = 5
    reading_noises: tuple[float, ...] = ()
    name: str = ""

    def __post_init__(self) -> None:
        """Refuse what means nothing, naming the key."""
        given = {
            each.name: getattr(self, each.name)
            for each in dataclasses.fields(self)
            if each.name != "name" and getattr(self, each.name) not in (None, ())
        }
        given |= {"cell": [dict(each) for each in self.cell]} if self.cell else {}
        try:
            values = _STUDY.read(given)
            usual = {each.name: each.default for each in dataclasses.fields(self)}
            _refuse_unused({n: each for n, each in values.items() if each != usual[n]})
        except WrongValueError as error:
            raise SymkinError(f"{dotted(error.keys)}: {error}") from error
        values["cell"] = tuple(map(MappingProxyType, values.get("cell", ())))
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def arguments(self) -> dict[str, Any]:
        """What a copy needs: the values, and the mechanisms, whose files may not be where it is."""
        values = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        values["cell"] = tuple(dict(each) for each in self.cell)
        return values | {"files": dict(self._files)}

    @classmethod
    def of_arguments(
        cls, *, files: Mapping[str, Mechanism] | None = None, **values: Any
    ) -> StudyDefinition:
        """Return the definition of such a copy."""
        made = cls(**values)
        made._files.update(files or {})
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the values, since cells are read-only."""
        return functools.partial(StudyDefinition.of_arguments, **self.arguments), ()

    @functools.cached_property
    def loaded(self) -> Mapping[str, Mechanism]:
        """The mechanisms by their names.

        Raises
        ------
        SymkinError
            For a file that cannot be read, or two mechanisms of one name.
        """
        given = [
            *self.mechanisms,
            *(each for cell in self.cell for each in cell.get("mechanisms", ())),
        ]
        found: dict[str, Mechanism] = {}
        for each in given:
            mechanism = self._mechanism(each)
            if found.setdefault(mechanism.name, mechanism) is not mechanism:
                raise SymkinError(
                    f'mechanisms: two have the name "{mechanism.name}"; expected different names'
                )
        return found

    @functools.cached_property
    def cells(self) -> tuple[Cell, ...]:
        """All combinations, in their order.

        Raises
        ------
        SymkinError
            For combinations that occur twice, an ``id`` of several, or as `loaded`.
        """
        _ = self.loaded  # two mechanisms of one name would look like cells that occur twice
        cells = tuple(self._cells())
        repeated = [name for name, count in Counter(each.id for each in cells).items() if count > 1]
        if repeated:
            raise SymkinError(f'two cells are "{repeated[0]}"; expected each combination once')
        if len(cells) > _MOST_CELLS:
            raise SymkinError(f"the study has {len(cells)} cells; expected at most {_MOST_CELLS}")
        return cells

    @functools.cached_property
    def digest(self) -> str:
        """What its rows depend on, as a SHA-256: all but the number of robots and the title."""
        values = {
            "symkin": version(),
            "kind": self.kind,
            "cells": [dataclasses.asdict(cell) for cell in self.cells],
            "mechanisms": {name: mechanism_text(each) for name, each in self.loaded.items()},
            "seed": self.seed,
            "evaluation_poses": self.evaluation_poses,
            "candidates": self.candidates,
        }
        if self.kind == "cost":
            values |= {"legs": self.legs, "repetitions": self.repetitions}
        return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()

    def replace(self, **changes: Any) -> StudyDefinition:
        """Return it with other values.

        Mechanisms that are given replace those of single cells too.
        """
        if "mechanisms" in changes:
            changes["cell"] = tuple(
                {name: value for name, value in each.items() if name != "mechanisms"}
                for each in changes.get("cell", self.cell)
            )
        return dataclasses.replace(self, **changes)

    @functools.cached_property
    def _files(self) -> dict[str, Mechanism]:
        """What was read, each file once."""
        return {}

    def _mechanism(self, given: str | Mechanism) -> Mechanism:
        if isinstance(given, Mechanism):
            return given
        if given not in self._files:
            self._files[given] = read_mechanism(given)
        return self._files[given]

    def _cells(self) -> Iterator[Cell]:
        own = {name: getattr(self, name) for name in _FACTORS}
        for place, group in enumerate(self.cell or ({},)):
            lists = own | {name: value for name, value in group.items() if name != "id"}
            lists["pose_counts"] = lists["pose_counts"] or (None,)
            combinations = list(itertools.product(*lists.values()))
            if "id" in group and len(combinations) > 1:
                raise SymkinError(
                    f'cell[{place + 1}].id: "{group["id"]}" names {len(combinations)} '
                    "combinations; expected one"
                )
            name = str(group.get("id", ""))
            for values in combinations:
                yield self._cell(dict(zip(lists, values, strict=True)), name)

    def _cell(self, values: dict[str, Any], name: str) -> Cell:
        mechanism = self._mechanism(values["mechanisms"])
        counted = _counted(values["pose_counts"], mechanism)
        own = values | {"mechanisms": mechanism.name, "pose_counts": counted}
        cell = Cell(name, *own.values())  # of which the lists have the order
        return cell if name else dataclasses.replace(cell, id=_identifier(cell))


def _counted(count: int | str | None, mechanism: Mechanism) -> int:
    if count is None:
        return mechanism.protocol.pose_count
    if isinstance(count, int):
        return count
    factor = _PER_PARAMETER.fullmatch(count)
    assert factor is not None  # it was checked
    return max(1, round(float(factor[1]) * max(mechanism.estimated_counts)))


def _identifier(cell: Cell) -> str:
    """What is always said, then what is unusual."""
    parts = [
        cell.mechanism, cell.design, cell.rows, cell.criterion, str(cell.pose_count),
        cell.estimator, cell.use,
    ]  # fmt: skip
    parts += [cell.method] if cell.method != "exchange" else []
    parts += [] if cell.use_symmetry else ["each-leg"]
    parts += [f"margin-{cell.margin_sigmas:g}"] if cell.margin_sigmas != 3 else []
    parts += [cell.loss] if cell.loss != "none" else []
    parts += [f"noise-{cell.noise_level:g}"] if cell.noise_level != 1 else []
    parts += [f"tolerance-{cell.tolerance_level:g}"] if cell.tolerance_level != 1 else []
    return "/".join(parts)


def builtin_studies() -> list[str]:
    """Return the names of the studies that symkin and packages installed beside it bring."""
    return sorted({path.stem for path in _BUILTIN.glob("*.toml")} | {*extension_names()})


def builtin_text(name: str) -> str:
    """Return the file of a built-in study.

    Raises
    ------
    SymkinError
        If there is none of this name, naming those that there are.
    """
    names = builtin_studies()
    if name not in names:
        raise SymkinError(
            f'there is no study "{name}"{_known(name, names)} (built in: {", ".join(names)})'
        )
    return _builtin_file(name).read_text(encoding="utf-8")


def load_study(name_or_path: str | os.PathLike[str]) -> StudyDefinition:
    """Read a study from a TOML file, or a built-in one by name.

    Parameters
    ----------
    name_or_path : str or path
        A file, or ``"protocols"``, ``"cost"`` or ``"symmetry"``, or with the package symkin-paper
        ``"paper"``. Mechanisms that a file names by files are looked for beside it.

    Raises
    ------
    StudyFileError
        With the file, the line and the key at fault, the expectation, and for a misspelt key or
        word the nearest valid one.
    """
    path = _located(Path(name_or_path))
    source = read_toml(path, StudyFileError)
    try:
        values = _STUDY.read(source.values)
        values.pop("schema", None)
        _refuse_unused(values)
    except WrongValueError as error:
        raise source.error(error.keys, str(error)) from error
    for lists in (values, *values.get("cell", ())):
        if "mechanisms" in lists:
            lists["mechanisms"] = tuple(_beside(path, each) for each in lists["mechanisms"])
    values["cell"] = tuple(values.get("cell", ()))
    definition = source.call(("cell",), lambda: StudyDefinition(**values, name=path.stem))
    source.call(("mechanisms",), lambda: definition.loaded)
    source.call(("cell",), lambda: definition.cells)
    return definition


def _located(path: Path) -> Path:
    is_name = path.name == str(path) and path.suffix != ".toml"
    if not is_name or path.is_file():
        return path
    names = builtin_studies()
    if path.name not in names:
        raise StudyFileError(
            f"is neither a file nor a built-in study{_known(path.name, names)} "
            f"(built in: {', '.join(names)})",
            path,
        )
    return _builtin_file(path.name)


def _builtin_file(name: str) -> Path:
    extension = extension_named(name)
    return extension.file if extension else _BUILTIN / f"{name}.toml"


def _known(name: str, names: list[str]) -> str:
    if name in KNOWN:
        return f", and the package that brings it is not installed ({KNOWN[name]})"
    return did_you_mean(name, names)


def has_cells_of(definition: StudyDefinition, file: Path) -> bool:
    """Whether a study has all cells of another, as they are there."""
    return set(load_study(file).cells) <= set(definition.cells)


def extension_of(definition: StudyDefinition) -> tuple[str, StudyExtension] | None:
    """Return the name and the extension of a study whose cells a definition has, if any."""
    for name in extension_names():
        extension = extension_named(name)
        if extension is not None and has_cells_of(definition, extension.file):
            return name, extension
    return None


def _beside(path: Path, mechanism: str) -> str:
    beside = path.parent / mechanism
    return str(beside) if Path(mechanism).suffix == ".toml" or beside.is_file() else mechanism
