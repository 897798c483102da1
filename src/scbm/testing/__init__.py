"""Test cases: drawing them, running them, judging them, and adding up what they visit (paper, Section VI)."""

from scbm.testing.campaign import Campaign, CaseResult, Execution, Tester
from scbm.testing.cases import Case, Origin
from scbm.testing.generation import RandomCases
from scbm.testing.json_report import FORMAT_VERSION, campaign_json
from scbm.testing.requirements import Violation, find_violations
from scbm.testing.verdicts import Verdict, judge

__all__ = [
    "FORMAT_VERSION",
    "Campaign",
    "Case",
    "CaseResult",
    "Execution",
    "Origin",
    "RandomCases",
    "Tester",
    "Verdict",
    "Violation",
    "campaign_json",
    "find_violations",
    "judge",
]
