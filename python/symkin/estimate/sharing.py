# SPDX-License-Identifier: MIT
"""Parameters that legs share by their roles: as symmetries carry legs onto each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from symkin import _core
from symkin.errors import SymkinError, did_you_mean
from symkin.estimate.ties import ONE_DRAW, meaning_of
from symkin.model.chains import CURVATURE_TERMS
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry.roles import RoleImage, role_images
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array

_BY_ROLE = " by role"  # of a tie: behind the name of a parameter

_NOTHING = 1e-6  # of a tolerance that one of another parameter brings


def followers_by_role(
    mechanism: Mechanism, scalars: Sequence[str], groups: Sequence[Sequence[int]]
) -> dict[int, dict[int, float]]:
    """Of shared scalars that do not move by the amount of the first of their group: what they do.

    By the symmetry of the drawing, of scalars by their places: firsts of groups, and by which
    factors it moves with them. Raises `SymkinError` for a parameter whose change is, in another
    leg, also one of a parameter that is not shared.
    """
    shared = [group for group in groups if len(group) > 1]
    if not any(_own(mechanism, scalars[each]) for group in shared for each in group):
        return {}
    roles = _Roles(mechanism, scalars, groups)
    found = {}
    for group in shared:
        for scalar in group[1:]:
            terms = roles.terms(group[0], scalar)
            if terms != {group[0]: 1.0}:
                found[scalar] = terms
    return found


def written_tie(mechanism: Mechanism, text: str) -> tuple[str, ...]:
    """Return a tie as it is, or those that ``base_angle by role`` stands for."""
    stated, meaning = meaning_of(text)
    name = stated.removesuffix(_BY_ROLE)
    if "=" in stated or name == stated:
        return (text,)
    # One draw of the workshop, whatever stands between the legs.
    meaning = meaning or ONE_DRAW
    space = "" if meaning.startswith(",") else " "
    return tuple(f"{each}{space}{meaning}" for each in ties_by_role(mechanism, name.strip()))


def ties_by_role(mechanism: Mechanism, name: str) -> tuple[str, ...]:
    """Write the ties by which a parameter, of any leg, keeps the drawing's symmetry.

    Such as ``-leg1.base_angle + 3.14159 rad = leg2.base_angle``. Raises `SymkinError` if no leg is
    carried onto another, or the parameter means nothing in one of them.
    """
    if name not in mechanism.parameter_names:
        raise SymkinError(
            f'tie "{name}{_BY_ROLE}": {name} is no parameter of the legs'
            f"{did_you_mean(name, mechanism.parameter_names)}"
        )
    place, images = mechanism.parameter_names.index(name), role_images(mechanism)
    texts = []
    for leg, image in enumerate(images):
        if image.reference == leg or place not in mechanism.estimated[leg]:
            continue
        row = image.by[place]
        if not np.isfinite(row).all():
            raise SymkinError(
                f'tie "{name}{_BY_ROLE}": leg{leg + 1}.{name} means nothing where its joint is, on '
                "the axis that it is counted about"
            )
        origin = image.reference
        held = set(mechanism.estimated[origin])
        terms = [(float(row[each]), each) for each in sorted(held) if abs(row[each]) > _NOTHING]
        units = mechanism.parameter_units(leg)
        if any(mechanism.parameter_units(origin)[each] != units[place] for _, each in terms):
            raise SymkinError(
                f'tie "{name}{_BY_ROLE}": leg{leg + 1}.{name} goes with lengths and angles of leg '
                f"{origin + 1}, since it is carried by a {image.element.words}"
            )
        carried, _ = _core.carried_leg(mechanism.straight, origin, image.element.core, leg)
        rest = float(carried[place]) - sum(
            by * float(mechanism.parameters[origin, each]) for by, each in terms
        )
        rest = 0.0 if abs(rest) < 1e-12 else rest
        summed = sum_in_words(
            (by, f"leg{origin + 1}.{mechanism.parameter_names[each]}") for by, each in terms
        )
        sign = "-" if rest < 0 else "+"
        more = f" {sign} {abs(rest):.15g} {units[place]}".rstrip() if rest else ""
        texts.append(f"{summed}{more} = leg{leg + 1}.{name}")  # which follows, being last
    if not texts:
        raise SymkinError(
            f'tie "{name}{_BY_ROLE}" ties nothing: no symmetry carries a leg of '
            f'"{mechanism.name}" onto another'
        )
    return tuple(texts)


def sum_in_words(terms: Iterable[tuple[float, str]]) -> str:
    """Write ``-leg1.x + 0.5 * leg1.y``."""
    text = " ".join(
        f"{'-' if factor < 0 else '+'} {'' if abs(factor) == 1 else f'{abs(factor)!r} * '}{name}"
        for factor, name in terms
    )
    return f"-{text[2:]}" if text.startswith("- ") else text.removeprefix("+ ")


def _own(mechanism: Mechanism, name: str) -> tuple[int, str] | None:
    """Leg (from 0) and name of a parameter of a leg or a term of its sensor; else None."""
    block, _, own = name.partition(".")
    if not block.startswith("leg") or own not in (*mechanism.parameter_names, *CURVATURE_TERMS):
        return None
    return int(block[3:]) - 1, own


class _Roles:
    def __init__(
        self, mechanism: Mechanism, scalars: Sequence[str], groups: Sequence[Sequence[int]]
    ) -> None:
        self.mechanism, self.scalars = mechanism, scalars
        self.images = role_images(mechanism)
        self.names = mechanism.parameter_names
        self.first_of = {each: group[0] for group in groups for each in group}
        self.place = {name: number for number, name in enumerate(scalars)}
        self.tolerances = np.asarray(parameter_tolerances(mechanism))

    def terms(self, first: int, scalar: int) -> dict[int, float]:
        """What a scalar does where `first`, of the same sort, and others that are shared move."""
        of_first, of_scalar = (_own(self.mechanism, self.scalars[i]) for i in (first, scalar))
        if of_first is None or of_scalar is None:
            return {first: 1.0}
        (origin, own), (leg, _) = of_first, of_scalar
        start, image = self.images[origin], self.images[leg]
        gains = self.mechanism.sensor_gains
        counted = 1 if gains[origin] * gains[leg] > 0 else -1  # sensors that count the other way
        if own == "sensor_gain":
            return {first: float(counted)}
        if image.reference != start.reference:  # of another orbit: nothing says how
            return {first: 1.0}
        if own in CURVATURE_TERMS:
            even = own != "sensor_sine"
            return {first: float(start.sign * image.sign * (1 if even else counted))}
        return self._carried(first, scalar, _between(start, image))

    def _carried(self, first: int, scalar: int, by: Array) -> dict[int, float]:
        origin, own = self._leg_and_name(first)
        leg, _ = self._leg_and_name(scalar)
        row = by[self.names.index(own)]
        name = self.scalars[scalar]
        if not np.isfinite(row).all():
            raise SymkinError(
                f"shared: {name} means nothing where its joint is, on the axis that it is counted "
                "about; free it by itself, or leave it out"
            )
        self._require_free(name, leg, by[:, self.names.index(own)])
        own_tolerance = self.tolerances[leg][self.names.index(own)]
        terms: dict[int, float] = {}
        for place in self.mechanism.estimated[origin]:
            brings = abs(row[place]) * self.tolerances[origin][place]
            if brings <= _NOTHING * own_tolerance:
                continue
            other = self.place[f"leg{origin + 1}.{self.names[place]}"]
            self._require(name, scalar, other)
            terms[self.first_of[other]] = terms.get(self.first_of[other], 0.0) + float(row[place])
        return terms

    def _require(self, name: str, scalar: int, other: int) -> None:
        """Refuse what also moves with a parameter that is not shared."""
        together = self.first_of.get(other)
        leg = self.scalars[scalar].partition(".")[0]
        mate = self.place[f"{leg}.{self.scalars[other].partition('.')[2]}"]
        if together is None or self.first_of.get(mate) != together:
            element = self.images[int(leg[3:]) - 1].element.words
            raise SymkinError(
                f"shared: {name} also moves with {self.scalars[other]}, since leg "
                f"{leg[3:]} is carried by a {element}; share "
                f"{self.scalars[other].partition('.')[2]} too"
            )

    def _require_free(self, name: str, leg: int, moved: Array) -> None:
        """Refuse what would move a parameter of the leg that the sensor's offset stands for."""
        roles = self.mechanism.parameter_roles(leg)
        for place, role in enumerate(roles):
            held = place not in self.mechanism.estimated[leg] and not role.is_constant
            if held and not role.is_given and not abs(moved[place]) <= _NOTHING:
                raise SymkinError(
                    f"shared: {name} would move leg{leg + 1}.{self.names[place]}, which is held "
                    "there, since the sensor's offset does the same; leave it out"
                )

    def _leg_and_name(self, scalar: int) -> tuple[int, str]:
        found = _own(self.mechanism, self.scalars[scalar])
        assert found is not None
        return found


def _between(start: RoleImage, image: RoleImage) -> Array:
    """Derivatives of one leg's parameters by another's of the same orbit."""
    given = np.asarray(np.isfinite(start.by).all(axis=1))
    inverse = np.linalg.pinv(np.where(given.reshape(-1, 1), start.by, np.eye(len(start.by))))
    known = np.asarray(np.isfinite(image.by).all(axis=1))
    result = np.full_like(image.by, np.nan)
    result[known] = image.by[known] @ inverse
    return np.where(np.abs(result) < 1e-9, 0.0, result)
