# SPDX-License-Identifier: MIT
"""Selection of the poses to measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin._core import SymmetryElement
from symkin.errors import NotIdentifiableError, SymkinError, one_of
from symkin.measurements import pose_rows
from symkin.mechanism import Mechanism
from symkin.observability import RowKind, noise_of, with_combinations
from symkin.result import Value, field, record
from symkin.symmetry import symmetry_group

if TYPE_CHECKING:
    from symkin.workspace import WorkspaceSample

__all__ = ["Certificate", "Criterion", "LegRows", "Selection", "SelectionMethod", "select_poses"]

SelectionMethod = Literal["exchange", "sun_hollerbach", "exhaustive", "random", "all"]
Criterion = Literal["O1", "O2", "O3", "O4", "O5", "expected_error"]


@record
class Certificate(Value):
    """How far a selection can be from the best possible one.

    Efficiencies of the determinant are ``(det M / bound)**(1/p)``: 1 for the best, and no selection
    exceeds it.

    Attributes
    ----------
    efficiency : float
        By the criterion that was optimised, against what no selection of distinct poses exceeds:
        of the determinant for O1, value over bound for O2 to O5, bound over value for
        "expected_error".
    o1_efficiency : float
        Of the determinant (O1), against the bound for distinct poses, whatever the criterion.
    efficiency_repeats : float
        Of the determinant, against the Kiefer-Wolfowitz bound, which lets a pose be measured more
        than once.
    proven_optimal : bool
        No other selection is better by more than rounding.
    """

    efficiency: float
    o1_efficiency: float
    efficiency_repeats: float
    proven_optimal: bool


@record
class Selection(Value):
    """Candidates chosen for measurement.

    Attributes
    ----------
    indices : ndarray of int, shape (N,)
        Rows of the candidates, from 0, ascending.
    log_det : float
        Logarithm of det(C'C) of the chosen rows (and of the prior).
    criterion : str
        What was optimised.
    criterion_value : float
        Its value: O1 to O5, or trace(M^-1 B).
    certificate : Certificate
        How far it can be from the best.
    spares : ndarray of int
        Further candidates, in the order in which they add most to the chosen ones.
    nodes : int
        Nodes of the proof's search tree; 0 without one.
    """

    indices: NDArray[np.intp] = field(number=True)
    log_det: float
    criterion: Criterion
    criterion_value: float
    certificate: Certificate
    spares: NDArray[np.intp] = field(number=True)
    nodes: int


class LegRows:
    """Observability rows of one leg at candidate poses, made when a selection needs them.

    Many candidates then need no array of rows, and all threads make them. The rows are those of
    `observability_rows`.

    Parameters
    ----------
    mechanism : Mechanism
        Its noise weighs the rows of kind "noise_aware".
    leg : int
        From 0.
    poses : WorkspaceSample, or array_like of shape (n, coordinates)
        Candidate poses.
    kind : {"paper", "noise_aware"}
        See `observability_rows`.
    orbit : sequence of SymmetryElement or str, optional
        Elements of the mechanism's group, such as ``("r0", "r1", "r2")``. Each candidate then
        stands for all poses to which they carry it (see `map_poses`), and brings one row for each
        element: that of the leg at the carried pose. Measured at whole orbits, legs that the group
        carries onto each other are all seen equally well.

    Raises
    ------
    SymkinError
        For a leg that does not exist or poses of the wrong shape.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        leg: int,
        poses: ArrayLike | WorkspaceSample,
        kind: RowKind = "paper",
        *,
        orbit: Sequence[SymmetryElement | str] = ("r0",),
    ) -> None:
        group = symmetry_group(mechanism)
        elements = [group.parse(each) if isinstance(each, str) else each for each in orbit]
        self.core = _core.LegRows(
            mechanism.core,
            leg,
            pose_rows(poses),
            one_of("kind of rows", kind, _core.RowKind.__members__),
            noise_of(mechanism.noise),
            group.core,
            elements,
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Candidates, rows of each, parameters."""
        return self.core.size, self.core.rows_per_pose, self.core.parameters


def select_poses(
    rows: ArrayLike | LegRows,
    count: int,
    seed: int = 1,
    *,
    method: SelectionMethod = "exchange",
    criterion: Criterion = "O1",
    spares: int = 0,
    required: Sequence[int] = (),
    forbidden: ArrayLike | None = None,
    prior: ArrayLike | None = None,
    coordinates: ArrayLike | None = None,
    minimum_distance: float = 0.0,
    scale: ArrayLike | None = None,
    error_weight: ArrayLike | None = None,
    time_limit: float = 10.0,
    threads: int = 0,
    memory_limit: int = 768 << 20,
    parameter_names: Sequence[str] | None = None,
) -> Selection:
    """Choose the candidates whose measurement tells most of the parameters (Eqs. 12, 13).

    Parameters
    ----------
    rows : array_like, shape (n, p) or (n, r, p), or LegRows
        One row of the identification matrix a candidate, or r of them (the whole mechanism at
        once: one a leg); see `observability_rows`. An array of C-contiguous float64 is not copied.
    count : int
        Number of poses to choose, the required ones included.
    seed : int
        Of what is random. The same seed gives the same poses on any number of threads.
    method : {"exchange", "sun_hollerbach", "exhaustive", "random", "all"}
        Approximate design, rounding and exchange; Sun and Hollerbach's add and drop, for
        comparison; the exchange with a proof by branch and bound; and two baselines.
    criterion : {"O1", "O2", "O3", "O4", "O5", "expected_error"}
        The observability index, or trace(M^-1 B) with B = `error_weight`.
    spares : int
        Number of further candidates, to replace poses that cannot be taken.
    required : sequence of int
        Candidates that must be chosen.
    forbidden : array_like of bool, shape (n,), optional
        Candidates that must not be chosen.
    prior : array_like, shape (p, p), optional
        Information matrix of what is measured already.
    coordinates : array_like, shape (n, m), optional
        Where the candidates are, for
    minimum_distance : float
        between any two chosen ones, in the unit of `coordinates`.
    scale : array_like, shape (p,), optional
        Unit of each parameter in O1 to O5 and in messages, such as its tolerance; O1 chooses the
        same in any.
    error_weight : array_like, shape (p, p), optional
        B of the expected error.
    time_limit : float
        Of the proof, s.
    threads : int
        0 for as many as the machine has.
    memory_limit : int
        Bytes in which the rows of `LegRows` are kept. More are made again in each of the passes
        over all candidates, usually four: as many times slower, but in little memory.
    parameter_names : sequence of str, optional
        To name the combinations that nothing shows in the error message.

    Raises
    ------
    NotIdentifiableError
        If no choice of so many candidates shows all parameters; names the combination.
    SymkinError
        For options that contradict each other, or rows that are not finite.
    """
    options = _core.SelectionOptions()
    options.count, options.seed, options.spare_count = count, seed, spares
    options.method = one_of("method", method, _core.SelectionMethod.__members__)
    options.criterion = one_of("criterion", criterion, _core.Criterion.__members__)
    options.required = list(required)
    options.minimum_distance, options.time_limit_s = minimum_distance, time_limit
    options.threads, options.memory_limit_bytes = threads, memory_limit
    if forbidden is not None:
        options.forbidden = np.asarray(forbidden, dtype=bool)
    for name, array in (
        ("prior", prior),
        ("coordinates", coordinates),
        ("column_scale", scale),
        ("error_weight", error_weight),
    ):
        if array is not None:
            setattr(options, name, np.ascontiguousarray(array, dtype=np.float64))
    try:
        result = _select(rows, options)
    except NotIdentifiableError as error:
        raise with_combinations(error, parameter_names, options.column_scale) from None
    return _selection(result, criterion)


def _select(rows: ArrayLike | LegRows, options: _core.SelectionOptions) -> _core.Selection:
    if isinstance(rows, LegRows):
        return _core.select_poses(rows.core, options)
    values = np.ascontiguousarray(rows, dtype=np.float64)
    if values.ndim not in (2, 3):
        raise SymkinError(f"rows have {values.ndim} dimensions; expected (n, p) or (n, r, p)")
    per_pose = values.shape[1] if values.ndim == 3 else 1
    return _core.select_poses(values.reshape(-1, values.shape[-1]), per_pose, options)


def _selection(result: _core.Selection, criterion: Criterion) -> Selection:
    certificate = result.certificate
    return Selection(
        indices=np.array(result.indices, dtype=np.intp),
        log_det=result.log_det,
        criterion=criterion,
        criterion_value=result.criterion_value,
        certificate=Certificate(
            efficiency=certificate.criterion_efficiency,
            o1_efficiency=certificate.efficiency_distinct,
            efficiency_repeats=certificate.efficiency_repeats,
            proven_optimal=certificate.proven_optimal,
        ),
        spares=np.array(result.spares, dtype=np.intp),
        nodes=result.nodes,
    )
