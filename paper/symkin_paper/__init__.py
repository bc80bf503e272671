# SPDX-License-Identifier: MIT
"""The paper behind symkin reproduced: its figures 6 to 10, and what they say about its claims.

With this package installed beside symkin, ``symkin study paper`` runs its study and judges it.
"""

from symkin.study.extension import StudyExtension
from symkin_paper.claims import Claim, Judgement, judge
from symkin_paper.evidence import Evidence, SliceErrors
from symkin_paper.findings import (
    STUDY_FILE,
    LocalErrors,
    PaperFindings,
    local_errors,
    paper_calls,
    study_paper,
)
from symkin_paper.page import paper_page

__all__ = [
    "STUDY",
    "Claim",
    "Evidence",
    "Judgement",
    "LocalErrors",
    "PaperFindings",
    "SliceErrors",
    "judge",
    "local_errors",
    "paper_calls",
    "paper_page",
    "study_paper",
]

STUDY = StudyExtension(STUDY_FILE, calls=paper_calls, findings=study_paper, page=paper_page)
