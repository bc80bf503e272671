# SPDX-License-Identifier: MIT
"""All that tells results: loading this module registers every kind that there is a page of."""

from symkin.show import acceptance as acceptance
from symkin.show import check as check
from symkin.show import estimate as estimate
from symkin.show import evaluation as evaluation
from symkin.show import measurements as measurements
from symkin.show import mechanism as mechanism
from symkin.show import observability as observability
from symkin.show import plan as plan
from symkin.show import run as run
from symkin.show import study as study
from symkin.show import symmetry as symmetry
from symkin.show import workspace as workspace
