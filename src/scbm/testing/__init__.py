"""Test cases at work: drawing them, running and judging them, making them small, adding up what they visit.

Paper, Section VI; semantics 7.
"""

from scbm.testing.answers import Answers
from scbm.testing.campaign import Campaign, CaseResult
from scbm.testing.chance import reaction_stream
from scbm.testing.choices import Choice
from scbm.testing.faults import draw_network
from scbm.testing.findings import MOST_SHRUNK, Finding, find_causes
from scbm.testing.generation import RandomCases
from scbm.testing.json_report import FORMAT_VERSION, campaign_json, coverage_json
from scbm.testing.requirements import Violation, find_violations
from scbm.testing.shrinking import Shrinker, Shrunk
from scbm.testing.sizes import Size
from scbm.testing.suites import WrittenCase, find_case_files, load_suite, save_cases
from scbm.testing.tester import Execution, Tester
from scbm.testing.verdicts import Failure, FailureKind, Outcomes, Verdict, judge

__all__ = [
    "FORMAT_VERSION",
    "MOST_SHRUNK",
    "Answers",
    "Campaign",
    "CaseResult",
    "Choice",
    "Execution",
    "Failure",
    "FailureKind",
    "Finding",
    "Outcomes",
    "RandomCases",
    "Shrinker",
    "Shrunk",
    "Size",
    "Tester",
    "Verdict",
    "Violation",
    "WrittenCase",
    "campaign_json",
    "coverage_json",
    "draw_network",
    "find_case_files",
    "find_causes",
    "find_violations",
    "judge",
    "load_suite",
    "reaction_stream",
    "save_cases",
]
