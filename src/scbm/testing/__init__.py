"""Draws, runs, judges and shrinks test cases, and adds up the obligations that they visit.

Paper, Section VI; semantics 7.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.testing.batches.campaign_runs import StopRule, run_campaign
    from scbm.testing.batches.campaign_work import CampaignWork
    from scbm.testing.batches.worker_processes import WorkerProcesses
    from scbm.testing.campaign import Campaign, CaseResult
    from scbm.testing.campaign_result import MAX_SHRUNK, CampaignResult, Finding, find_causes
    from scbm.testing.campaign_results_json import FORMAT_VERSION, campaign_json, coverage_json
    from scbm.testing.continuations.unjudged import Unjudged
    from scbm.testing.random_cases import RandomCases, draw_network
    from scbm.testing.random_streams import reaction_stream
    from scbm.testing.real_drivers import Answers
    from scbm.testing.requirement_monitors import Violation, find_violations
    from scbm.testing.shrinking.case_sizes import Choice, Size
    from scbm.testing.shrinking.shrinker import Shrinker, Shrunk
    from scbm.testing.tester import Execution, Tester
    from scbm.testing.verdicts import Excuse, ExcuseRules, Failure, FailureKind, Outcomes, Verdict, judge
    from scbm.testing.written_cases import WrittenCase, case_texts, find_case_files, load_suite

__all__ = [
    "FORMAT_VERSION",
    "MAX_SHRUNK",
    "Answers",
    "Campaign",
    "CampaignResult",
    "CampaignWork",
    "CaseResult",
    "Choice",
    "Excuse",
    "ExcuseRules",
    "Execution",
    "Failure",
    "FailureKind",
    "Finding",
    "Outcomes",
    "RandomCases",
    "Shrinker",
    "Shrunk",
    "Size",
    "StopRule",
    "Tester",
    "Unjudged",
    "Verdict",
    "Violation",
    "WorkerProcesses",
    "WrittenCase",
    "campaign_json",
    "case_texts",
    "coverage_json",
    "draw_network",
    "find_case_files",
    "find_causes",
    "find_violations",
    "judge",
    "load_suite",
    "reaction_stream",
    "run_campaign",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "batches.campaign_runs": "StopRule run_campaign",
        "batches.campaign_work": "CampaignWork",
        "batches.worker_processes": "WorkerProcesses",
        "campaign": "Campaign CaseResult",
        "campaign_result": "MAX_SHRUNK CampaignResult Finding find_causes",
        "campaign_results_json": "FORMAT_VERSION campaign_json coverage_json",
        "continuations.unjudged": "Unjudged",
        "shrinking.case_sizes": "Choice Size",
        "real_drivers": "Answers",
        "random_cases": "RandomCases draw_network",
        "random_streams": "reaction_stream",
        "requirement_monitors": "Violation find_violations",
        "shrinking.shrinker": "Shrinker Shrunk",
        "tester": "Execution Tester",
        "verdicts": "Excuse ExcuseRules Failure FailureKind Outcomes Verdict judge",
        "written_cases": "WrittenCase case_texts find_case_files load_suite",
    },
)
