"""Failures as a log in SARIF 2.1.0 for code scanning: each cause is located in the model."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from scbm import __version__
from scbm.cases.coverage import Decision
from scbm.files import read_located
from scbm.model import Place
from scbm.model.visible_text import counted, escaped_data
from scbm.reports.ci.xml_text import is_absolute, portable
from scbm.reports.stored_cases import again, again_words, asked_for, causes_of, place_of, smallest_lines
from scbm.store import Written
from scbm.testing import FailureKind
from scbm.testing.built_in_requirements import part_to_change
from scbm.testing.decided_requirements import RequirementStatus

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files import Places
    from scbm.reports.stored_cases import Cause
    from scbm.store import History

SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"

_MAX_NAMED = 3
"""Maximum number of cases that a message names; the properties of a result have all."""

_RULES = {
    FailureKind.REQUIREMENT: ("A requirement was broken", "A run came into a state that a requirement forbids."),
    FailureKind.BUILT_IN: (
        "A built-in requirement was broken",
        "A run broke a rule of the request protocol, or did not recover from its only fault (semantics 7.12).",
    ),
    FailureKind.EXPECTATION: ("An expectation was not met", "Something that a case expects did not come of its run."),
    FailureKind.LIVELOCK: ("Automatic transitions repeat", "Automatic transitions enable each other without end."),
    FailureKind.MODEL_ERROR: ("The model is wrong", "A run reached a state in which the model defines no next step."),
    FailureKind.NOT_REACHED: (
        "A goal was not reached",
        "A goal was not reached in a run without injected faults.",
    ),
    FailureKind.IMPOSSIBLE: (
        "A change is impossible",
        "A case lists a change from outside that nothing in the model could make at its moment, so it is no run.",
    ),
    FailureKind.LOST: ("A run was not finished", "A node was lost during the run. This is not a fault of the model."),
}
"""The title and the description of each kind of failure."""


def sarif_log(history: History) -> str:
    """Return a SARIF log with one run: a rule for each kind of failure, a result for each cause.

    Raises:
        InputError: the source of the history is not a model.
    """
    log = {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [_run(history)]}
    return json.dumps(escaped_data(log), indent=2, ensure_ascii=False) + "\n"


def _run(history: History) -> dict[str, Any]:
    _, places = read_located(history.source.text, portable(history.source.path))
    results = [_result(cause, history, places) for cause in causes_of(history)]
    results += [*_status_results(history, places), *_hazard_results(history, places)]
    results += _requirement_results(history, places)
    rules = _rules(history)
    order = [rule["id"] for rule in rules]
    files = dict.fromkeys((portable(history.source.path), *_case_files(history)))
    return {
        "tool": {
            "driver": {
                "name": "scbm",
                "semanticVersion": __version__,
                "rules": rules,
            }
        },
        "automationDetails": {"id": f"scbm/{history.model.name}/"},
        "invocations": [{"commandLine": history.runs[-1].command, "executionSuccessful": True}],
        "columnKind": "unicodeCodePoints",
        "artifacts": [{"location": artifact_of(file)} for file in files],
        "results": [{"ruleId": each["ruleId"], "ruleIndex": order.index(each["ruleId"]), **each} for each in results],
        **_status_properties(history),
    }


_REQUIREMENT = "requirement_in_all_runs"

_STATUS_RULES = {
    "waived": ("A waived obligation", "A person decided that this obligation need not be covered."),
    "visited_waiver": ("A waiver that is not needed", "A case visits an obligation although a waiver excuses it."),
    "expired_waiver": ("An expired waiver", "A waiver does not count any more."),
    "ignored_certificate": ("A certificate that does not count", "It has flaws, or is about another model."),
}
"""The title and the description of what statuses add; the level of waived obligations is `note`, else `warning`."""


_HAZARD = "hazard"
_HAZARD_WORDS = (
    "A hazard at a device",
    "A simulated device does work that the runner no longer waits for, or works at two requests at once.",
)


def _status_rule(rule: str, title: str, sentence: str) -> dict[str, Any]:
    return {
        "id": rule,
        "name": rule.title().replace("_", ""),
        "shortDescription": {"text": title},
        "fullDescription": {"text": sentence},
        "help": {"text": f"{sentence} `scbm report STORE` shows the status of each obligation."},
        "defaultConfiguration": {"level": _level(rule)},
    }


def _level(rule: str) -> str:
    return "note" if rule == "waived" else "warning"


def _status_properties(history: History) -> dict[str, Any]:
    """Return both figures and the number of obligations of each status, if statuses are known."""
    statuses = history.decided
    if statuses is None:
        return {}
    counts = {status.value: count for status, count in statuses.counts.items()}
    figures = {"scbmIas": history.coverage.figure.percent, "ofWhatCanBeCovered": statuses.coverable.percent}
    figures["visitedByForce"] = statuses.forced
    return {"properties": {**figures, "statuses": counts, "assumptions": list(statuses.assumptions)}}


def _status_results(history: History, places: Places) -> Iterator[dict[str, Any]]:
    """Yield a result for each waived obligation, which is suppressed, and for what does not count."""
    statuses = history.decided
    if statuses is None:
        return
    for entry in statuses.with_status(Decision.WAIVED):
        name = str(entry.obligation)
        result = _status_result("waived", f"{name} is waived: {entry.reason}", name, places)
        yield result | {"suppressions": [{"kind": "external", "justification": entry.reason}]}
    for waiver in statuses.visited_waivers:
        message = f"a case visits {waiver.obligation}, so its waiver is not needed: {waiver}"
        yield _status_result("visited_waiver", message, waiver.obligation, places)
    for waiver in statuses.expired_waivers:
        message = f"the waiver of {waiver.obligation} has expired: {waiver}"
        yield _status_result("expired_waiver", message, waiver.obligation, places)
    for sentence in statuses.ignored:
        yield _status_result("ignored_certificate", f"a certificate does not count: {sentence}", "", places)


def _status_result(rule: str, message: str, obligation: str, places: Places) -> dict[str, Any]:
    subject, _, aspect = obligation.partition("/")
    path = ("automatic_transitions", aspect) if subject == "automatic" else ("operations", subject)
    place, _ = places.find(path if obligation else ("behavior_model",))
    return _warning(rule, message, place, obligation or message)


def _warning(rule: str, message: str, place: Place, subject: str) -> dict[str, Any]:
    """Return a result that is no failure; two results with one rule and one subject are the same one."""
    fingerprint = sha256(f"{rule}\0{subject}".encode()).hexdigest()[:16]
    return {
        "ruleId": rule,
        "level": _level(rule),
        "message": {"text": message},
        "locations": [{"physicalLocation": region_of(place)}],
        "partialFingerprints": {"scbmCause/v1": fingerprint, "primaryLocationLineHash": f"{fingerprint}:1"},
    }


def _hazard_results(history: History, places: Places) -> Iterator[dict[str, Any]]:
    """Yield a result for the hazards of one kind at one device."""
    groups: dict[tuple[str, str], list[str]] = {}
    for label, hazard in history.hazards:
        groups.setdefault((hazard.resource, hazard.kind), []).append(f"{hazard}, in {label}")
    for (resource, kind), (first, *others) in groups.items():
        more = f", and {counted(len(others), 'more hazard')} of this kind" if others else ""
        place, _ = places.find(("resources", resource))
        yield _warning(_HAZARD, f"{first}{more}", place, f"{resource} {kind}")


_REQUIREMENT_KINDS = {
    RequirementStatus.HOLDS: ("pass", "none"),
    RequirementStatus.HOLDS_CANONICAL: ("pass", "none"),
    RequirementStatus.HOLDS_PLANNER: ("pass", "none"),
    RequirementStatus.VIOLATED: ("fail", "error"),
    RequirementStatus.CASES_ONLY: ("informational", "none"),
    RequirementStatus.OFF: ("notApplicable", "none"),
}
"""The kind and the level of a result about a requirement; any other one is open."""


def _requirement_results(history: History, places: Places) -> Iterator[dict[str, Any]]:
    """Yield a result for each decided requirement, at its line: how many cases check it, and what closing says."""
    for each in history.requirements:
        if each.decision is None and not each.off:
            continue
        status = RequirementStatus.OFF if each.decision is None else each.decision.status
        kind, level = _REQUIREMENT_KINDS.get(status, ("open", "none"))
        is_own = not (each.is_built_in or each.is_asked)
        place, _ = places.find(("requirements", each.name) if is_own else ("behavior_model",))
        fingerprint = sha256(f"{_REQUIREMENT}\0{each.is_built_in}\0{each.name}".encode()).hexdigest()[:16]
        yield {
            "ruleId": _REQUIREMENT,
            "kind": kind,
            "level": level,
            "message": {"text": f"{each.name} is {each.long_words}"},
            "locations": [{"physicalLocation": region_of(place)}],
            "partialFingerprints": {"scbmCause/v1": fingerprint, "primaryLocationLineHash": f"{fingerprint}:1"},
        }


def _rules(history: History) -> list[dict[str, Any]]:
    """Return the rules: those about statuses only if statuses are known, that about hazards only if there are some."""
    rules = [_rule(kind, *words) for kind, words in _RULES.items()]
    if history.decided is not None:
        rules += [_status_rule(rule, *words) for rule, words in _STATUS_RULES.items()]
    if history.hazards:
        rules.append(_status_rule(_HAZARD, *_HAZARD_WORDS))
    if history.decisions or history.model.requirements_off:
        sentence = "Cases check it, and `scbm close --requirements --store` decides it in all runs."
        rules.append(_status_rule(_REQUIREMENT, "What is known of a requirement", sentence))
    return rules


def _rule(kind: FailureKind, title: str, sentence: str) -> dict[str, Any]:
    return {
        "id": kind.value,
        "name": kind.value.title().replace("_", ""),
        "shortDescription": {"text": title},
        "fullDescription": {"text": sentence},
        "help": {"text": f"{sentence} `scbm run` and `scbm replay` show the run of a case, moment by moment."},
        "defaultConfiguration": {"level": "error"},
        "properties": {"precision": "very-high", "problem.severity": "error", "tags": ["testing"]},
    }


def _result(cause: Cause, history: History, places: Places) -> dict[str, Any]:
    kind = cause.failure.kind
    place = _place(cause, history, places)
    fingerprint = _fingerprint(cause, place)
    return {
        "ruleId": kind.value,
        "level": "error",
        "message": {"text": _message(cause, history)},
        "locations": [{"physicalLocation": region_of(place)}],
        "partialFingerprints": {"scbmCause/v1": fingerprint, "primaryLocationLineHash": f"{fingerprint}:1"},
        "properties": {
            "subject": cause.failure.subject,
            "goal": cause.case.goal,
            "cases": list(cause.labels),
            **_smallest(cause),
        },
    }


def _message(cause: Cause, history: History) -> str:
    """Return the failure, the cases that have it, and the command that reproduces the first one."""
    named = ", ".join(cause.labels[:_MAX_NAMED])
    more = len(cause.labels) - _MAX_NAMED
    others = f" and {counted(more, 'more case')}" if more > 0 else ""
    place = place_of(cause.case, history)
    ran = f"\nran {place}" if place else ""
    command = again(cause.case, portable(history.source.path), history.runs)
    how = f"\n{again_words(cause.case)}: {command}" if command else ""
    small = "".join(f"\n{line}" for line in smallest_lines(cause.smallest))
    return f"{cause.failure}\nin {named}{others}{ran}{how}{small}"


def _smallest(cause: Cause) -> dict[str, Any]:
    """Return the smallest case as a property: its file, its size and that of the case before, and what matters."""
    small = cause.smallest
    if small is None:
        return {}
    sizes = {"operations": small.operations, "operationsBefore": small.operations_before}
    return {"smallestCase": {"file": small.path, **sizes, "matters": list(small.matters)}}


def _place(cause: Cause, history: History, places: Places) -> Place:
    """Return the location of a cause: the model, or a case file with requirements of its own."""
    failure, recipe = cause.failure, cause.case.recipe
    known = [requirement.name for requirement in history.model.requirements]
    is_own = failure.kind is FailureKind.REQUIREMENT and failure.subject not in known
    place, _ = places.find(_path(cause))
    if isinstance(recipe, Written) and (is_own or failure.kind in (FailureKind.EXPECTATION, FailureKind.IMPOSSIBLE)):
        return Place(portable(recipe.path), 1)
    return place


def _path(cause: Cause) -> tuple[str, ...]:
    """Return the path of the keys in the model that were violated."""
    match cause.failure.kind:
        case FailureKind.REQUIREMENT:
            return ("requirements", cause.failure.subject)
        case FailureKind.BUILT_IN:
            return part_to_change(cause.failure.message) or ("behavior_model",)
        case FailureKind.NOT_REACHED:
            return ("goals", cause.case.goal)
        case FailureKind.LIVELOCK:
            return ("automatic_transitions",)
        case _:
            return ("behavior_model",)


def region_of(place: Place) -> dict[str, Any]:
    """Return a place as a physical location."""
    region = {"startLine": max(1, place.line)}
    if place.column:
        region |= {"startColumn": place.column, "endColumn": place.column + place.length}
    return {"artifactLocation": artifact_of(place.file), "region": region}


def artifact_of(file: str) -> dict[str, str]:
    """Return a portable path as a URI; a relative path starts from the root of the repository."""
    address = quote(file, safe="/:")
    if is_absolute(file):
        return {"uri": f"file:///{address.removeprefix('/')}"}
    return {"uri": f"./{address}" if ":" in address.split("/")[0] else address, "uriBaseId": "%SRCROOT%"}


def _case_files(history: History) -> Iterator[str]:
    """Return the files of the written cases that failed."""
    return (portable(case.recipe.path) for case in history.failed if isinstance(case.recipe, Written))


def _fingerprint(cause: Cause, place: Place) -> str:
    """Return the fingerprint of a cause: kind, subject, goal or file, as these stay when lines and values change."""
    kind = cause.failure.kind
    parts = [kind.value, cause.failure.subject, place.file]
    if kind is FailureKind.REQUIREMENT:
        parts += filter(None, [asked_for(cause.failure, cause.case.recipe)])
    if kind is FailureKind.NOT_REACHED:
        parts.append(cause.case.goal)
    if kind is FailureKind.EXPECTATION:
        parts.append(cause.case.name)
    return sha256(json.dumps(parts).encode()).hexdigest()[:32]
