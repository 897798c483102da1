"""Mutants that no case killed as a log in SARIF 2.1.0: each is located in the model."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from scbm import __version__
from scbm.cases.coverage import MutantStatus
from scbm.model.visible_text import escaped_data
from scbm.mutation.mutation_operators import MUTATIONS
from scbm.mutation.report.mutation_summary import change_in_words
from scbm.reports.ci.sarif import SARIF_SCHEMA, artifact_of, region_of
from scbm.reports.ci.xml_text import portable

if TYPE_CHECKING:
    from scbm.mutation.mutant_results import MutantResult
    from scbm.mutation.report.mutation_summary import MutationSummary

_LEVELS = {MutantStatus.SURVIVED: "warning", MutantStatus.UNDECIDED: "note"}


def mutation_sarif(summary: MutationSummary) -> str:
    """Return a SARIF log with one run: a rule for each operator, a result for each mutant that no case killed."""
    log = {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [_run(summary)]}
    return json.dumps(escaped_data(log), indent=2, ensure_ascii=False) + "\n"


def _run(summary: MutationSummary) -> dict[str, Any]:
    return {
        "tool": {
            "driver": {
                "name": "scbm",
                "semanticVersion": __version__,
                "rules": [_rule(name, mutation.summary) for name, mutation in MUTATIONS.items()],
            }
        },
        "automationDetails": {"id": f"scbm-mutate/{summary.model.name}/"},
        "invocations": [{"commandLine": summary.command, "executionSuccessful": True}],
        "columnKind": "unicodeCodePoints",
        "artifacts": [{"location": artifact_of(portable(summary.file))}],
        "results": [_result(result, summary) for result in summary.not_killed],
        "properties": {"score": summary.counts.score.percent, "mutants": summary.counts.total},
    }


def _rule(name: str, summary: str) -> dict[str, Any]:
    sentence = f"{summary[0].upper()}{summary[1:]}, and no case of the suite fails."
    return {
        "id": name,
        "name": name.title().replace("-", ""),
        "shortDescription": {"text": "A change that no case notices"},
        "fullDescription": {"text": sentence},
        "help": {"text": f"{sentence} Add a case or an expectation that fails on the changed model."},
        "defaultConfiguration": {"level": "warning"},
    }


def _known(result: MutantResult) -> str:
    """Return what is known of a mutant that no case killed, as a sentence."""
    if result.witness is None:
        because = f": {result.reason}" if result.reason else ""
        return f"It is undecided whether any run differs{because}."
    if result.is_killable:
        return f"The case {result.witness.name} would notice it: `scbm mutate --witnesses` writes it."
    return f"A run differs, and {result.reason}."


def _result(result: MutantResult, summary: MutationSummary) -> dict[str, Any]:
    mutant = result.mutant
    place, _ = summary.places.find(mutant.path)
    fingerprint = sha256(f"{mutant.operator}\0{mutant.name}".encode()).hexdigest()[:32]
    message = f"no case notices this change of {mutant.owner}: {change_in_words(mutant)}\n{_known(result)}"
    return {
        "ruleId": mutant.operator,
        "ruleIndex": list(MUTATIONS).index(mutant.operator),
        "level": _LEVELS[result.status],
        "message": {"text": message},
        "locations": [{"physicalLocation": region_of(replace(place, file=portable(place.file)))}],
        "partialFingerprints": {"scbmMutant/v1": fingerprint, "primaryLocationLineHash": f"{fingerprint}:1"},
        "properties": {"mutant": mutant.name, "before": mutant.before, "after": mutant.after},
    }
