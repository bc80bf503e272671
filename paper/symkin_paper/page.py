# SPDX-License-Identifier: MIT
"""The paper, judged: every figure beside the paper's words, and what symkin does about it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from symkin.analysis.workspace import least_reach_margin
from symkin.model.poses import pose_rows
from symkin.present import Group, Image, Page, Section, Table
from symkin.show.images import plotted
from symkin.show.units import in_units
from symkin.show.wording import (
    NONE,
    decimals_of,
    fixed,
    milli,
    plural,
    quoted,
    setting,
    significant,
)
from symkin.study.result import StudyResult
from symkin.study.summaries import CellSummary, ErrorFigure, Ratio
from symkin_paper.claims import Claim, Verdict
from symkin_paper.findings import (
    EACH_LEG,
    EQUAL_EFFORT,
    PAPER,
    TRADITIONAL,
    PaperFindings,
    study_paper,
)

# Of one claim, and of several.
_TOLD: dict[Verdict, tuple[str, str]] = {
    "holds": ("holds", "hold"),
    "holds partly": ("holds partly", "hold partly"),
    "does not hold": ("does not hold", "do not hold"),
    "not decided": ("is not decided by so few robots", "are not decided by so few robots"),
}

_COLUMNS = (
    "Errors are root mean squares over robots and poses of the workspace, with 95% intervals, and "
    "beside them their ratio to what is expected to first order, with its standard error. "
    "Intervals hold: the share of the parameters' 95% intervals that hold the true value. Every "
    "protocol has the same robots."
)

# What the figures call the cells of Fig. 9.
FIG_9_CELLS = {
    "traditional, 24 poses": TRADITIONAL,
    "traditional, 72 poses": EQUAL_EFFORT,
    "divide and conquer,\nchosen for each leg, 72 poses": EACH_LEG,
    "divide and conquer,\nmapped, 72 poses": PAPER,
}

_JOINT = "joint, the paper's poses"
_ORBITS = "joint, orbits of 24 poses"

# And those of what symkin makes of it, with the paper's first.
HEADLINE_CELLS = {
    "the paper, 72 poses": PAPER,
    "traditional, 24 poses": TRADITIONAL,
    "traditional, 72 poses": EQUAL_EFFORT,
    "implicit, the paper's 72": "implicit, the paper's poses",
    "joint, the paper's 72": _JOINT,
    "joint, noise-aware 72": "joint, noise-aware rows",
    "joint, its own 72": "joint, 72 poses",
    "joint, 24 in orbits": _ORBITS,
    "joint, 24 for all legs": "joint, 24 poses",
}
_OURS = tuple(HEADLINE_CELLS.values())[3:]
_TOLERANCES = (
    ("paper, small errors", "traditional, small errors"),
    (PAPER, TRADITIONAL),
    ("paper, large errors", "traditional, large errors"),
)
_FURTHER = {
    "Five-bar (the 5R of the authors' earlier paper; dimensions are symkin's)": "5bar: ",
    "Hexapod (Jugglebot)": "hexapod: ",
}


@in_units("mm,mrad")  # the paper's
def paper_page(study: StudyResult, findings: PaperFindings | None = None) -> Page:
    """Tell what became of the paper's figures and claims.

    Parameters
    ----------
    study : StudyResult
        Of the study ``"paper"``.
    findings : PaperFindings, optional
        Of it, by default `study_paper` of it.

    Returns
    -------
    Page
    """
    found = study_paper(study) if findings is None else findings
    evidence = found.evidence
    return Page(
        title="The paper, done again and judged",
        subtitle="Durango et al. (2010), Symmetrical Observability of Kinematic Parameters in "
        f"Symmetrical Parallel Mechanisms, sections 4 to 6; {plural(study.robots, 'robot')} a cell",
        headlines=[
            _headline("Divide and conquer over traditional", evidence.against_traditional, 72, 24),
            _headline("The same at equal effort", evidence.against_equal_effort, 72, 72),
            *_our_headlines(study),
        ],
        judgement=_judgement(found),
        paragraphs=[_counted(found.claims), *_in_short(study)],
        sections=[
            _overview(found),
            _identification(study, found),
            _improvements(study),
            _local(found),
            _workspace(found),
            _selection(found),
            _observability(found),
            _assumptions(study, found),
            *_further(study),
        ],
    )  # fmt: skip


def _counted(claims: Sequence[Claim]) -> str:
    verdicts = Counter(claim.verdict for claim in claims)
    told = [f"{number} {_TOLD[each][number > 1]}" for each in _TOLD if (number := verdicts[each])]
    return (
        f"Of {len(claims)} claims in sections 4 to 6, judged by figures and told below beside the "
        f"paper's words, {', '.join(told)}."
    )


def _judgement(found: PaperFindings) -> str:
    """The central claim in words."""
    by_name = {claim.name: claim for claim in found.claims}
    central = by_name["Better than the traditional method"]
    effort = by_name["The same at equal measuring effort"]
    return (
        f"That divide and conquer is more accurate than the traditional method {_as_told(central)} "
        f"with 72 measured poses against 24, and {_as_told(effort)} with 72 against 72"
    )


def _as_told(claim: Claim) -> str:
    return "is not decided" if claim.verdict == "not decided" else claim.verdict


def _headline(
    name: str, ratios: tuple[Ratio, Ratio], measured: int, compared: int
) -> tuple[str, str, str]:
    position, orientation = (f"{each.value:.2f}" for each in ratios)
    remark = f"times, position and orientation; {measured} measured poses against {compared}"
    return name, f"{position}, {orientation}", remark


def _our_headlines(study: StudyResult) -> list[tuple[str, str, str]]:
    headlines = []
    for name, cell in (
        ("Joint estimate over the paper's", _JOINT),
        ("Joint, orbits, over the paper's", _ORBITS),
    ):
        found = study.compare(cell, PAPER)
        measured = [study.cells[each].measured_poses for each in (cell, PAPER)]
        headlines.append(_headline(name, (found.position, found.orientation), *measured))
    return headlines


def _in_short(study: StudyResult) -> list[str]:
    cells = study.cells
    divided, traditional, equal = (cells[each] for each in (PAPER, TRADITIONAL, EQUAL_EFFORT))
    joint, orbits = (cells[each] for each in (_JOINT, _ORBITS))
    return [
        f"The paper's protocol measures {divided.measured_poses} poses (24 a leg) and leaves "
        f"{_errors(divided)}. The traditional method leaves {_errors(traditional)} with "
        f"{traditional.measured_poses} poses, and {_errors(equal)} with {equal.measured_poses}: in "
        "the paper's comparison divide and conquer has three times as many measured poses, of "
        "which every leg uses a third.",
        f"symkin uses every pose for every leg and weighs the legs together: {_errors(joint)} from "
        f"the paper's own {joint.measured_poses} measurements, and {_errors(orbits)} from "
        f"{orbits.measured_poses} poses in orbits under the symmetry.",
    ]


def _errors(cell: CellSummary) -> str:
    return f"{milli(cell.position.rms, 'm')} and {milli(cell.orientation.rms, 'rad')}"


def _overview(found: PaperFindings) -> Section:
    rows = [(claim.name, claim.place, claim.verdict) for claim in found.claims]
    table = Table("", ("Claim", "Place", "Verdict"), [Group(rows)], wordy=True, brief=True)
    return Section("claims", "All claims", (), [table])


def _claims(found: PaperFindings, figure: int) -> Table:
    """The paper's words beside what the figures say."""
    rows = [
        (f"{quoted(claim.quotation)} ({claim.place})", claim.verdict, claim.sentence)
        for claim in found.claims
        if claim.figure == figure
    ]
    return Table("", ("The paper", "Verdict", "Figures"), [Group(rows)], wordy=True)


def _identification(study: StudyResult, found: PaperFindings) -> Section:
    cells = {name: study.cells[cell] for name, cell in FIG_9_CELLS.items()}
    figure = Image(
        "fig9",
        "Errors before and after identification by four protocols, logarithmic scale.",
        f"After Fig. 9: end-effector errors over the workspace, root mean squares of "
        f"{plural(study.robots, 'robot')} and {plural(study.definition.evaluation_poses, 'pose')}, "
        "before (mm and mrad) and after identification.",
        plotted("protocol_errors", cells),
    )
    table = _cell_table("Errors after identification", study, FIG_9_CELLS.values(), brief=True)
    title = "Identification (section 6.5, Fig. 9)"
    return Section("identification", title, [_COLUMNS], [figure, table, _claims(found, 9)])


def _improvements(study: StudyResult) -> Section:
    cells = {name: study.cells[cell] for name, cell in HEADLINE_CELLS.items()}
    figure = Image(
        "improvements",
        "Errors after identification by the paper's protocols and symkin's.",
        "End-effector errors after identification, root mean squares; the number is that of "
        "measured poses.",
        plotted("protocol_errors", cells, before=False),
    )
    rows = []
    for cell in _OURS:
        found, summary = study.compare(cell, PAPER), study.cells[cell]
        ratios = [_interval(each) for each in (found.position, found.orientation)]
        rows.append((cell, str(summary.measured_poses), *ratios))
    columns = ("Protocol", "Measured poses", "Position", "Orientation")
    caption = "Error over that of the paper's protocol with 72 measured poses, the same robots"
    ratios_table = Table(f"{caption} (95% interval)", columns, [Group(rows)], brief=True)
    errors = _cell_table("Errors after identification", study, _OURS, brief=True)
    paragraphs = [
        "The paper identifies a leg from its own third of the poses, counts every closure alike, "
        "and treats the legs as if they shared no measured pose. The estimator implicit uses all "
        "poses for every leg and weighs closures by what the noise does to them; joint takes into "
        "account that the legs share the noise of a pose; orbits are poses that serve all legs at "
        "once; and symkin's own poses are chosen by the expected error, not by O_1."
    ]
    title = "What symkin does about it"
    return Section("improvements", title, paragraphs, [figure, ratios_table, errors])


def _cell_table(
    caption: str, study: StudyResult, names: Iterable[str], *, brief: bool = False
) -> Table:
    cells = {name: study.cells[name] for name in names}
    kinds = [("Position, mm", [each.position for each in cells.values()])]
    turns = [each.orientation for each in cells.values()]
    if any(each.rms > 0 for each in turns):
        kinds.append(("Orientation, mrad", turns))
    rows = [[name, str(cell.measured_poses)] for name, cell in cells.items()]
    columns = ["Protocol", "Measured"]
    for label, errors in kinds:
        columns += [label, "Over expected"]
        for row, error in zip(rows, errors, strict=True):
            row += _figures(error)
    for row, cell in zip(rows, cells.values(), strict=True):
        row += [f"{100 * cell.coverage:.1f}%", str(cell.failed)]
    columns += ["Intervals hold", "Failed"]
    return Table(caption, columns, [Group(rows)], brief=brief)


def _figures(error: ErrorFigure) -> tuple[str, str]:
    reach = 1e3 * (error.high - error.low) / 2
    decimals = decimals_of(reach)
    return (
        _with_reach(fixed(1e3 * error.rms, decimals), fixed(reach, decimals)),
        _with_reach(fixed(error.ratio, 3), fixed(error.ratio_error, 3)),
    )


def _with_reach(value: str, reach: str) -> str:
    return f"{value}\N{NO-BREAK SPACE}\N{PLUS-MINUS SIGN}\N{NO-BREAK SPACE}{reach}"


def _interval(ratio: Ratio) -> str:
    return f"{fixed(ratio.value, 3)} ({fixed(ratio.low, 3)}{NONE}{fixed(ratio.high, 3)})"


def _local(found: PaperFindings) -> Section:
    angles = ", ".join(setting(each.orientation) for each in found.local)
    figure = Image(
        "fig10",
        "Maps of the position error at three orientations, for two methods.",
        f"After Fig. 10: position error of the calibrated robots at \N{GREEK SMALL LETTER PHI} = "
        f"{angles} rad, in mm, root mean square over robots; all maps have one scale.",
        plotted("local_errors", found.local, module="symkin_paper.figures"),
    )
    return Section("local", "Local errors (section 6.5, Fig. 10)", (), [figure, _claims(found, 10)])


def _workspace(found: PaperFindings) -> Section:
    figure = Image(
        "fig6",
        "Clouds of the readings at the poses of the workspace.",
        "After Figs. 6a to 6d: the active-joint workspace, rad. Rotations carry the colours onto "
        "each other.",
        plotted("active_joints", found.workspace),
    )
    title = "Symmetry of workspace and readings (sections 4, 6.1 to 6.3, Fig. 6)"
    return Section("workspace", title, (), [figure, _claims(found, 6)])


def _selection(found: PaperFindings) -> Section:
    figure = Image(
        "fig7",
        "The chosen poses in the cloud of readings.",
        "After Fig. 7: the 24 poses chosen for leg 1 and their images for the other legs in the "
        "active-joint workspace (small dots), rad.",
        plotted("chosen_readings", found.plan, found.workspace.sample),
    )
    title = "Chosen poses (sections 5.1 and 6.4, Fig. 7)"
    return Section("selection", title, (), [figure, _claims(found, 7)])


def _observability(found: PaperFindings) -> Section:
    names = found.mechanism.parameter_names
    figure = Image(
        "fig8",
        "Bars of the observability of each parameter, alike for all legs.",
        "After Fig. 8: |R_ii| of the three legs at their poses, in rad per m, rad and gain.",
        plotted("observability", names, found.r_diagonals),
    )
    title = "Symmetrical observability (section 5, Fig. 8)"
    return Section("observability", title, (), [figure, _claims(found, 8)])


def _assumptions(study: StudyResult, found: PaperFindings) -> Section:
    """What the paper does not say, and what depends on it."""
    mechanism = found.mechanism
    tolerances, workspace = mechanism.tolerances, mechanism.workspace
    assert workspace is not None
    rows = [
        ("Standard deviation of the kinematic errors",
         f"{milli(tolerances.length, 'm')}, {milli(tolerances.angle, 'rad')}, "
         f"{setting(tolerances.gain)} of the gain", "see the table below"),
        ("Limits of the workspace",
         f"legs {milli(least_reach_margin(mechanism), 'm')} from the end of their reach, condition "
         f"number up to {setting(workspace.conditioning_limit)}, the box of the mechanism's file",
         f"of 3RRR; all {plural(len(pose_rows(found.plan.candidates)), 'pose')} drawn from it are "
         "candidates (--margin-sigmas 0)"),
        ("Sign of the working mode", "-1 turns the elbow to the right",
         "with the other sign a singularity parts the paper's three slices"),
        ("Noise of the readings", "none", "the paper has noise of the measured poses only"),
        ("Solver of the traditional method", "the same Gauss-Newton, every leg from all poses",
         "the legs share no parameter, so one step for all is one step for each"),
        ("Poses out of reach", "replaced by spares", "the paper does not mention any"),
        ("Errors of Figs. 9 and 10",
         f"root mean squares over {plural(study.robots, 'robot')}",
         "the paper seems to show one robot"),
        ("RMSE", "against the poses that the calibrated robots take",
         "the paper's seems to be against measured poses, with their noise"),
        ("Poses over which errors are taken",
         f"{plural(study.definition.evaluation_poses, 'pose')} of the pool", "the paper: 30 000"),
        ("Sign of the estimate", "subtracted in Eq. 26", "as printed, the iteration diverges"),
    ]  # fmt: skip
    table = Table("", ("What", "Here", "Remark"), [Group(rows)], wordy=True)
    levels = []
    for divided, traditional in _TOLERANCES:
        level = study.definition.cells[[c.id for c in study.definition.cells].index(divided)]
        compared = study.compare(divided, traditional)
        levels.append(
            (setting(level.tolerance_level, digits=2),
             milli(study.cells[divided].position.before, "m"), _errors(study.cells[divided]),
             _interval(compared.position), _interval(compared.orientation),
             str(study.cells[divided].replaced))
        )  # fmt: skip
    columns = (
        "Kinematic errors, times these", "Position before", "Paper's protocol",
        "Position over traditional, 24", "Orientation over it", "Poses replaced",
    )  # fmt: skip
    sensitivity = Table("What depends on the kinematic errors", columns, [Group(levels)])
    title = "What the paper does not say: symkin's assumptions"
    return Section("assumptions", title, (), [table, sensitivity])


def _further(study: StudyResult) -> list[Section]:
    parts, paragraphs = [], [
        "The same protocols on mechanisms with two and six legs, whose files are shipped."
    ]  # fmt: skip
    for caption, prefix in _FURTHER.items():
        names = [name for name in study.cells if name.startswith(prefix)]
        if names:
            parts.append(_cell_table(caption, study, names))
            paragraphs.append(_against_paper(study, caption.partition(" (")[0], names))
    return [Section("further", "Further mechanisms", paragraphs, parts)] if parts else []


def _against_paper(study: StudyResult, title: str, names: Sequence[str]) -> str:
    """The position errors of other protocols over those of the first, the paper's."""
    paper, *others = names
    told = [
        f"{name.partition(': ')[2]} ({study.cells[name].measured_poses} measured poses) "
        f"{significant(study.compare(name, paper).position.value, 2)} times"
        for name in others
    ]
    return (
        f"{title}: over the position error of the paper's protocol "
        f"({study.cells[paper].measured_poses} measured poses) have {', '.join(told)}."
    )
