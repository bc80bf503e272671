# SPDX-License-Identifier: MIT
"""Whether an estimate is as far from the drawing as tolerances and priors say."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from symkin import _core
from symkin.values import Array, Value, record

_RANK = 1e-9  # of the largest singular value
_GROWS = 1.5  # so that 87% of the intervals of trusted robots at three tolerances hold
LIMIT = 5e-4  # share of sound robots that are doubted for being too far, and for being too near


@record
class DrawingConflict(Value):
    """How far an estimate is from the drawing, against what tolerances or priors say.

    The way from the drawing has independent components, of which each is standard normal if the
    robot is one of those that are made within the tolerances.

    Attributes
    ----------
    directions : int
        Components that the observations show, k.
    q : float
        The sum of their squares: chi-square of k for a sound robot.
    p_large, p_small : float
        Probabilities of a robot so far from its drawing, and so near.
    ratio : float
        q / k.
    factor : float
        By which the tolerances would have to be multiplied, most likely.
    as_drawn : float
        Twice the logarithm of how much likelier that factor is than zero, a robot exactly as drawn.
    """

    directions: int
    q: float
    p_large: float
    p_small: float
    ratio: float
    factor: float
    as_drawn: float = math.nan  # of results that did not have it

    derived: ClassVar[tuple[str, ...]] = ("variance_factor",)

    @property
    def variance_factor(self) -> float:
        """On the priors' variances, so that intervals hold for robots of wider tolerances.

        The ratio itself is right on average; but of the robots at three tolerances those are
        trusted that are near the drawing by chance. This is enough for these, and leaves three of
        four sound robots as they are.
        """
        return max(1.0, _GROWS * (self.ratio**2 - 1))


def widened_by(covariance: Array, prior_rows: Array, noise: float, priors: float) -> Array:
    """Covariance of estimates whose noise and priors vary more than declared, by these factors.

    Of the covariance C of an estimate by priors of information P the part C P C is that of robots
    that are not as drawn, so that it grows with the larger factor; the rest is the noise's.
    """
    apart = prior_rows @ covariance
    return np.asarray(noise * covariance + max(priors - noise, 0.0) * apart.T @ apart)


def conflict_of(
    change: Array, covariance: Array, priors: Array, relations: Array | None = None
) -> DrawingConflict | None:
    """Compare the change of unknowns from the drawing with their priors' standard deviations.

    An unknown without a prior, infinite, takes no part. None if none is left, or nothing of them is
    known. `relations` (k, unknowns) are rows that priors make standard normal besides.
    """
    if relations is not None and len(relations):
        # In combinations of which the priors say that they are independent and standard normal.
        own = np.isfinite(priors) & (priors > 0)
        rows = np.vstack([(np.eye(len(change)) / np.where(own, priors, 1.0))[own], relations])
        sizes = 1 / np.linalg.norm(rows, axis=0).clip(min=1e-300)
        _, singular, right = np.linalg.svd(rows * sizes, full_matrices=False)
        shown = singular > _RANK * singular[0]
        whitened = singular[shown, None] * right[shown] / sizes
        change, covariance = whitened @ change, whitened @ covariance @ whitened.T
        priors = np.ones(len(change))
    kept = np.isfinite(priors) & (priors > 0)
    inner = covariance[np.ix_(kept, kept)]
    if not kept.any() or not np.isfinite(inner).all() or not np.isfinite(change[kept]).all():
        return None
    found = _core.drawing_conflict(change[kept], inner, priors[kept])
    if not found.directions:
        return None
    return DrawingConflict(
        found.directions,
        found.q,
        found.p_large,
        found.p_small,
        found.ratio,
        found.factor,
        found.as_drawn,
    )


def after_priors(
    change: Array, covariance: Array, priors: Array, tolerances: Array
) -> tuple[Array, Array, Array]:
    """Return change, covariance and priors as if tolerances had been priors where there are none.

    By the rules for normal errors, from an estimate without them; priors stay infinite where there
    is no tolerance either.
    """
    new = ~np.isfinite(priors) & (tolerances > 0)
    if not new.any():
        return change, covariance, priors
    across = covariance[:, new]
    gain = np.linalg.solve(covariance[np.ix_(new, new)] + np.diag(tolerances[new] ** 2), across.T).T
    return (
        change - gain @ change[new],
        covariance - gain @ across.T,
        np.where(new, tolerances, priors),
    )
