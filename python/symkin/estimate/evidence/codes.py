# SPDX-License-Identifier: MIT
"""The closed list of what may be said of an estimate: a code, what it says, and what to do.

Sentences are made from here alone. `{legs}` and `{rows}` name what a finding is about, `{options}`
what to ask `identify` for, in the language of who asks; the rest are the finding's figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Code(NamedTuple):
    """What is said in a sentence, and what to do about it, if there is anything.

    `usual` are the figures of a finding that does not say otherwise, such as an older one.
    """

    says: str
    remedy: str = ""
    usual: Mapping[str, str] = MappingProxyType({})


# Mistakes that are found by correcting them; as a doubt, a likely cause.
CAUSES: Mapping[str, Code] = {
    "gross-errors": Code(
        "gross errors in rows {rows}{what}: a robust loss (cauchy) finds {count} of {total} poses "
        "that do not fit the others, whose chi-square is {after:.3g} per degree of freedom",
        "look at these rows, or identify with {options}",
    ),
    "columns-exchanged": Code(
        "the readings of {legs} are in the columns of legs {columns}", "exchange the columns"
    ),
    "working-mode": Code("{which}", "set working_mode so in the file"),
    "opposite-sign": Code(
        "the readings of {legs} have the opposite sign",
        "negate the column{s}, or the sensor_gain of the drawing",
    ),
    "unit-of-readings": Code(
        "the readings of {legs} look like {unit}", "name the column{s} by the true unit"
    ),
    "zero-half-a-turn-off": Code(
        "the sensor{s} of {legs} {was} set to zero half a turn off the drawing's zero",
        "change sensor_offset in the drawing by half a turn",
    ),
    "gain": Code(
        "the readings of {legs} grow {rates} times as fast as the drawing's",
        "correct sensor_gain, or the unit",
    ),
    "zero": Code(
        "the sensor{s} of {legs} {was} set to zero {shifts} {unit} off the drawing's zero",
        "identify with a wide prior of sensor_offset",
    ),
    "unit-of-lengths": Code(
        "lengths that were observed are {unit}", "give them in metres, or name the columns so"
    ),
    "convention-of-poses": Code(
        "in the measured poses {convention}", "{do}", {"do": "correct the table"}
    ),
    "rows-shifted": Code(
        "the readings of {legs} stand {shift} in the table",
        "move the column{s} {back}",
        {"back": "back"},
    ),
    "rows-in-another-unit": Code(
        "{what} of rows {rows} are {unit}, those of the others {usual}",
        "give all of them in {usual}",
        {"what": "the positions", "usual": "metres"},
    ),
    "rows-of-another-robot": Code(
        "the rows from row {row} on are of another robot than those before, or it was altered "
        "between: each part fits by itself",
        "identify each part by itself",
    ),
    "rows-far-off": Code(
        "{which} {be} far from what the drawing and the other rows say of {it}, as where a digit "
        "or a sign is mistyped",
        "put {it} right, or leave {it} out",
    ),
    "rows-out-of-order": Code("{what}", "take the file as it was: only whole rows may be sorted"),
    "frame-not-as-drawn": Code(
        "{whose}{evidence}: {moved}turned by about {angle:.3g} degrees",
        "identify with {options}",
        {"whose": "the frame of the measurements is not the drawing's"},
    ),
    "held-is-wrong": Code(
        "parameters that are held or shared are not as they are said to be{evidence}",
        "free them{help}",
    ),
    "drawn-wrong": Code(
        "the {name} of {legs} is {amount}, so it may be wrong in the drawing",
        "correct it in the drawing",
    ),
}

DOUBTS: Mapping[str, Code] = {
    **CAUSES,
    "search-ended": Code(
        "Ctrl-C ended the search for a cause: that none is named says nothing", "identify again"
    ),
    "tests-ended": Code(
        "Ctrl-C ended the tests, so it is not known what else speaks against the estimate",
        "identify again",
    ),
    # Too little was measured.
    "parameters-alike": Code(
        "{legs}: the poses hardly tell its parameters apart (condition number {size:.3g})",
        "measure further out, choose poses with a plan, or identify with {options}",
    ),
    "nothing-to-spare": Code(
        "{who}no pose to spare, so the noise cannot be checked and nothing can speak against the "
        "estimate: measure more"
    ),
    "little-to-spare": Code(
        "{legs}: only {poses} to spare, so the noise can hardly be checked", "measure more"
    ),
    "others-say-little": Code(
        "left out one by one, the heights are predicted to {left_out} by the others, {size:.2g} "
        "times the {fitted} of the fit: so few cannot say that it is right elsewhere",
        "probe more points",
    ),
    "many-rejected": Code("{legs}: the robust loss rejects {count} of its {total} poses"),
    "rows-without-pose": Code("no pose explains row{n} {rows}, which {verb} left out"),
    "leg-not-read": Code("{legs} has no reading: its parameters stay where the priors have them"),
    "parameters-unknown": Code(
        "the measurements say nothing of {names}: the standard deviation is more than {size:g} "
        "times the tolerance, so the drawing knows better"
    ),
    "not-examined": Code(
        "chi-square or parameters are not a sound robot's; what of, was looked into for the first "
        "{examined} such robots of the fleet alone",
        "identify this robot by itself",
    ),
    # Residuals against the declared noise.
    "noise-hides-robot": Code(
        "the estimated noise is {size:.3g} times what is declared, and so large that the drawing "
        "knows the end effector as well: readings and poses may not belong together",
        "look whether every row's readings are those of its pose",
    ),
    "residuals-large": Code(
        "{who}chi-square is {ratios} per degree of freedom ({degrees} of them), above {limits} "
        "which 1 of 1000 sound robots exceeds: residuals are {size:.2g} times what the declared "
        "noise explains{by_kind}; {then}"
    ),
    "few-far-off": Code(
        "half of the residuals are only {size:.2g} times as large as declared: some poses are far "
        "off; look at them, or use a robust loss"
    ),
    "residuals-small": Code(
        "{who}chi-square is {ratios} per degree of freedom ({degrees} of them), below {limits} "
        "which 1 of 1000 sound robots falls short of: {why}{by_kind}",
        "identify with {options}",
    ),
    # What rows show by themselves.
    "other-working-mode": Code(
        "{legs}: the readings are those of working mode {mode:+d}, but the mechanism has "
        "{drawn:+d}: set working_mode = {mode}"
    ),
    "some-in-other-mode": Code(
        "{legs}: {count} of {total} readings (the first in row {first}) are those of the other "
        "working mode ({mode:+d})"
    ),
    "out-of-reach": Code(
        "{legs}: the calibrated model cannot take {count} of {total} measured poses; that of row "
        "{first} is {milli:.3g} m{unit} beyond its reach"
    ),
    "turns-away": Code(
        "{legs}: all readings are {turns} away from the sensor's zero that the mechanism has, "
        "which the gain and the offset then have to explain",
        "move the column by as much, or declare reading_wraps = true in the drawing if the sensor "
        "shows each turn the same",
    ),
    "turns-lost": Code(
        "{legs}: {count} of {total} readings are a turn away from the others (rows {rows}): the "
        "sensor wrapped or was reset; add the turn, since the gain would have to explain it"
    ),
    "rows-copied": Code(
        "{count} of {total} poses are copies of others (first: row {first}): they agree a thousand "
        "times better than the declared noise of measuring them allows, so they add no "
        "information; the standard deviations are too small",
        "leave rows {rows} out",
    ),
    "columns-copied": Code(
        "the readings of {legs} are the same in all {count} rows, as where a column was copied",
        "look where the columns come from",
    ),
    "rows-computed": Code(
        "{count} rows ({rows}) are computed from {model} to the last digit, as in a table of "
        "planned poses: not measured",
        "leave them out, or measure there",
    ),
    "stands-still": Code(
        "{what} is the same in rows {first} to {last}, to the last digit, while the others move, "
        "and by the drawing so should it: it stood still, or was not read",
        "look at the sensor and its cable, and measure these rows again",
    ),
    "readings-coarse": Code(
        "the readings of {legs} take only {count} values in steps of {size:.3g} {unit}: rounded, "
        "repeated, or of a coarse sensor"
    ),
    "readings-scatter": Code(
        "what {whose} shows scatters by {amount} more than noise explains{when}: a joint of that "
        "leg or the sensor has play, or single readings are wrong{evidence}",
        "look for what is loose there",
        {"when": ""},
    ),
    "point-scatters": Code(
        "{whose} scatters by {amount} along each axis more than noise explains{when}: it is loose "
        "on the platform, or the measuring device sees it badly{evidence}",
        "fasten it, or leave its columns out",
        {"when": ""},
    ),
    "rows-scatter": Code(
        "what is measured{when} scatters {times} times as much as the declared noise, and in the "
        "other rows as declared: the measuring device, or what it stands on, is worse "
        "there{evidence}",
        "look what was different then; leave these rows out, or measure them again",
    ),
    "rows-unlike": Code(
        "{these} not fit the others: look at the measurement, or use a robust loss"
    ),
    # What the residuals depend on.
    "sensor-curved": Code(
        "{whose}: the residuals contain a square of the reading{amount}: the sensors are not "
        "linear, as with a spool that fills, a rope that stretches or a slipping drive{evidence}",
        "identify with {options}{help}",
    ),
    "sensor-eccentric": Code(
        "{whose}: the residuals repeat with each turn of the sensor{amount}: an encoder or a spool "
        "runs out of true{evidence}",
        "identify with {options}{help}",
    ),
    "bed-bowed": Code(
        "a bed that is not flat, its rim {amount} above its middle, explains the heights better"
        "{evidence}: either it is bowed, or the robot is farther from the drawing than the "
        "tolerances say",
        "lay a straightedge on the bed; identify with {options} if it is",
    ),
    "depends-on-pose": Code(
        "{whose}: the residuals depend on the pose, most on {terms}{amount}: something bends or "
        "sags, a joint is not where the chain has it, or the measuring device is distorted"
        "{evidence}"
    ),
    "sags": Code(
        "measured positions are off in {component} by {amount} at the outermost pose, with the "
        "square of the distance from the middle: something bends or sags, or the measuring device "
        "is distorted{evidence}"
    ),
    "device-distorted": Code(
        "the measured positions are distorted, which explains all that noise does not: "
        "{terms}{evidence}",
        "calibrate the measuring device, or measure with another",
    ),
    # What changed while it was measured.
    "drifts": Code(
        "{whose} drifts by {amount} from the first to the last row{evidence}",
        "identify with {options}, or measure again once the robot is warm",
    ),
    "steps": Code(
        "{whose} is different by {amount} from row {rows} on: something slipped or was moved or "
        "homed again{evidence}",
        "identify with {options}, or leave out the rows before or after",
    ),
    "points-exchanged": Code(
        "points {which} stand in each other's columns in row{n} {rows}, by the distances among "
        "them",
        "put each in the columns that are its own",
    ),
    "point-moved": Code(
        "point {which} is elsewhere on the platform from row {rows} on: it was knocked, or put "
        "back otherwise",
        "name its columns from there on as those of another point, p{another}",
    ),
    "grows": Code(
        "all lengths grow by {amount}, as with the temperature{evidence}",
        "identify with {options}, or measure at one temperature",
    ),
    "has-backlash": Code(
        "{whose} depends by {amount} on the side from which it comes to rest: backlash or friction"
        "{evidence}",
        "identify with {options}, or come to every pose from one side",
    ),
    "clock-late": Code(
        "the measuring device shows where the robot was {amount} before its readings: the clocks "
        "of the two are not alike{evidence}",
        "identify with {options}, or measure at rest",
    ),
    "lags": Code(
        "measured {shown} stay behind by {amount} of the last move: the robot had not come to "
        "rest, or the measuring device smooths or is late{evidence}",
        "wait longer before a pose is measured",
        {"shown": "positions"},
    ),
    "sessions-noise": Code(
        "the noise of session {session} is {times} times that of the others{evidence}",
        "identify with {options}, or state standard deviations by columns",
    ),
    "sessions-offsets": Code(
        "what the sensors show differs between the sessions, most {largest} by {amount} from the "
        "last: the robot was homed anew, or a zero moved{evidence}",
        "identify with {options}",
    ),
    "sessions-frames": Code(
        "where the robot stands to the measuring device differs between the sessions, most "
        "{largest} by {amount} from the last: the device or the robot was moved{evidence}",
        "identify with {options}",
    ),
    "sessions-moved": Code(
        "offsets of the sensors {which} the frame of the measuring device differ between the "
        "sessions, most {largest} by {amount} from the last{evidence}",
        "identify with {options}; what is known to be as it was can be left out of that",
    ),
    "neighbours-alike": Code(
        "residuals of neighbouring rows are alike: something drifts in the order of measuring, "
        "such as a warming structure, a slipping drive or a moving target{evidence}"
    ),
    "neighbours-opposite": Code(
        "residuals of neighbouring rows are opposite: the rows alternate between two states, such "
        "as two directions of approach (backlash){evidence}"
    ),
    "noise-along": Code(
        "positions scatter along {axis} of the measuring device {size:.2g} times as much as across "
        "it, which explains all that the declared noise does not{evidence}",
        "identify with {options}, or declare it: along, in the [noise]",
    ),
    "legs-together": Code(
        "residuals of legs {pairs} vary together more than the declared noise of the pose "
        "explains: its position and orientation parts are not in the declared proportion to each "
        "other and to the readings'{evidence}"
    ),
    "estimators-disagree": Code(
        "the estimators implicit and joint disagree by more than the noise explains: the declared "
        "split of the noise between pose and readings is wrong, or the model lacks something"
        "{evidence}"
    ),
    # The drawing and its tolerances.
    "moved-together": Code(
        "the parameters of all legs moved together: {movement}, which explains {share:.0%} of "
        "their distance from the drawing",
        "look at the frames and the scale of the measuring device",
    ),
    "far-from-drawing": Code(
        "the robot is further from the drawing than its tolerances or priors say (chi-square "
        "{size:.3g} for {count} combinations that the observations show): they would have to be "
        "{factor:.2g} times as wide",
        "look at drawing, units and frames, or give wider tolerances",
    ),
    "near-drawing": Code(
        "the robot is nearer to the drawing than robots are made (chi-square {size:.3g} for "
        "{count} combinations that the observations show): noise alone may make them, as of "
        "numbers that were computed from the drawing",
        "were they measured? Then the robot needs no calibration, or tolerances are far too wide",
    ),
    "computed-from-drawing": Code(
        "these numbers were computed from the drawing: it explains the observations better than "
        "noise lets a real robot's be explained"
    ),
    "tie-strained": Code(
        'the tie "{tie}" does not hold so well: all else has its left side larger by {amount}, '
        "which is {times:.1f} standard deviations (p {p:.1g})",
        "leave the tie out, or say how well it really holds",
    ),
    "parameters-far": Code("parameters are further from the drawing than is plausible: {names}"),
}

NOTES: Mapping[str, Code] = {
    "tolerances-wide": Code(
        "The robot is nearer to the drawing than its tolerances say (chi-square {size:.3g} for "
        "{count} combinations that the observations show): {factor:.2g} of them would do, and "
        "what rests on them is known better than is told. They are standard deviations; limits of "
        "a drawing are two to three of these."
    ),
    "search-cut-short": Code(
        "Not every correction was tried, as of so many legs there are too many: that no cause is "
        "named says less than for a robot with few legs."
    ),
    "columns-unread": Code("{words}"),
    "robots-left": Code(
        "Ctrl-C ended it: the robots until then are identified, those after them are not."
    ),
    "rows-apart": Code(
        "{words}, so that the whole table was held in memory; sorted by robot, it is read a part "
        "at a time"
    ),
    "names-alike": Code(
        "{words} differ by zeros in front, spaces or case alone, and are different robots here: if "
        "they are one, write its name alike in all rows"
    ),
    "cause-shared": Code(
        "{count} of {examined} doubtful robots that were looked into have one cause, of which it "
        "is typical that {words}: it may be of the drawing, of a fixture or of the table rather "
        "than of robots; correct it once, and identify all again"
    ),
    "screened": Code(
        "A robot that fits passed the tests of noise and tolerance; symkin identify makes more of "
        "a single one, as were made here of those that did not pass."
    ),
    "settings-changed": Code("{words}"),
    "heights": Code("{words}"),
    "parameters-unneeded": Code(
        "the measurements say nothing of {names}: the standard deviation is more than {size:g} "
        "times the tolerance; the end effector is known better than by the drawing nevertheless"
    ),
    "parameters-weak": Code(
        "the drawing knows {names} better than the measurements do; what moves the platform, "
        "combinations of them, is measured better"
    ),
    "rows-unguarded": Code(
        "a gross error in {which} would not be seen, since the estimate follows it: measure more "
        "poses near it"
    ),
    "gauge": Code("{words}: parameters and deviations depend on it."),
    "priors-stand": Code(
        "The data say next to nothing of {names}: what stands there is the prior."
    ),
    "points-unseen": Code(
        "The points of [frames] were measured in no row: distances are of the target",
        "if the distances are of one of them, write its place as target in [frames]",
    ),
    "left-to-gravity": Code("{words}; no accuracy of poses at given readings can be told."),
    "held-as-exact": Code(
        "{names} {be} held and taken as exact",
        "declare how far off {it} may be: assume, in the file [assumed]",
    ),
    "unseen": Code(
        "missed in 1 of 10 robots or more: {names}; in brackets how many times "
        "the error to expect at these poses that would move the end effector",
        "if the robot may have it, identify with {options}",
    ),
    "noise-estimated": Code(
        "The noise was estimated from the same observations, so that chi-square says nothing of "
        "the model.{kept}"
    ),
    "legs-interchangeable": Code(
        "The observations do not show which leg is which: with the readings of the legs in the "
        "order {orders} the estimate is as good. See by hand that every column is of the leg that "
        "it names."
    ),
    "sensors-curved": Code(
        "The calibrated sensors are curved: everything but identification leg by leg uses them."
    ),
    "left-out": Code("Left out as blunders: {names}."),
}
