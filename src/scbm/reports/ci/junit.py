"""Write the cases of a store as JUnit XML, for Jenkins, GitLab and others (docs/reference/report-formats.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from scbm.model.visible_text import counted
from scbm.reports.ci.xml_text import portable, xml_text
from scbm.reports.figure_table import short_of_goal_in_words
from scbm.reports.status_lines import status_warnings, united_in_words
from scbm.reports.stored_cases import again, again_words, place_of, smallest_by_label, smallest_lines
from scbm.store import Drawn

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.store import History, SmallestCase, StoredCase

_SECONDS = len("2026-11-21T12:00:00")
"""Length of a timestamp to the second, the form that Ant introduced and tools still expect."""


def junit_xml(history: History) -> str:
    """Return a JUnit file: one suite, named as the model, with each case as a test. Times are seconds of the runs.

    It is valid by the schema of Jenkins' xUnit plugin, which allows several failures of one test. Jenkins and GitLab
    show only one of them, so a test has one failure element that names all failures.
    """
    lost = sum(case.is_lost for case in history.cases)
    counts = {"tests": str(len(history.cases)), "failures": str(len(history.failed) - lost), "errors": str(lost)}
    time = _seconds(history.ended_ns)
    root = Element("testsuites", {"name": "scbm", "time": time, **counts})
    suite = SubElement(root, "testsuite", {"name": history.model.name, "time": time, **counts, "skipped": "0"})
    suite.set("timestamp", history.runs[-1].started[:_SECONDS])
    suite.set("file", portable(history.source.path))
    properties = SubElement(suite, "properties")
    for name, value in (*_properties(history), *_requirements(history)):
        SubElement(properties, "property", {"name": name, "value": value})
    smallest = smallest_by_label(history)
    for label, case in zip(history.labels, history.cases, strict=True):
        _add_case(suite, label, case, history, smallest.get(label, ()))
    return xml_text(root)


def _requirements(history: History) -> Iterator[tuple[str, str]]:
    for each in history.requirements:
        yield f"{'built_in' if each.is_built_in else 'requirement'}/{each.name}", each.words


def _properties(history: History) -> Iterator[tuple[str, str]]:
    yield "model", history.model.name
    yield "model_file", portable(history.source.path)
    yield "command", history.runs[-1].command
    seeds = dict.fromkeys(case.recipe.seed for case in history.cases if isinstance(case.recipe, Drawn))
    if seeds:
        yield "seed", ", ".join(map(str, seeds))
    over_nodes = sum(case.is_over_nodes for case in history.cases)
    if over_nodes:
        yield "cases_over_nodes", str(over_nodes)
    figure = history.coverage.figure
    yield "scbm_ias", str(figure)
    yield "obligations_visited", str(figure.visited)
    yield "obligations", str(figure.of)
    if history.lifted is not None:
        lifted = history.lifted.figure
        yield "lifted", str(lifted)
        yield "lifted_obligations_visited", str(lifted.visited)
        yield "lifted_obligations", str(lifted.of)
        if history.others:
            yield "lifted_from", united_in_words(history.lifted)
    yield from _beside_failures(history)
    if history.decided is not None:
        yield "of_what_can_be_covered", str(history.decided.coverable)
        for status, count in history.decided.counts.items():
            yield f"obligations_{status.value}", str(count)
        yield "obligations_visited_by_force", str(history.decided.forced)
        for sentence in history.decided.assumptions:
            yield "assumption", sentence
        for warning in status_warnings(history.decided):
            yield "warning", warning


def _beside_failures(history: History) -> Iterator[tuple[str, str]]:
    """Yield what fails no case, and is worth a look."""
    if history.short_count:
        yield "cases_short_of_goal", short_of_goal_in_words(history.short_count, history.short)
    if history.hazards:
        yield "hazards_at_devices", str(len(history.hazards))


def _add_case(suite: Element, label: str, case: StoredCase, history: History, smallest: Sequence[SmallestCase]) -> None:
    test = SubElement(suite, "testcase", {"name": label, "classname": history.model.name})
    test.set("time", _seconds(case.ended_ns))
    place = place_of(case, history)
    if not case.verdict.passed:
        _add_failure(test, case, history, smallest)
    output = [f"ran {place}"] if place else []
    if case.verdict.is_short:
        reasons = ", ".join(excuse.words for excuse in dict.fromkeys(case.verdict.excuses))
        output.append(f"passed short of the goal ({case.verdict.end.replace('_', ' ')}), excused by {reasons}")
    output += [f"hazard: {hazard}" for hazard in case.hazards]
    if output:
        SubElement(test, "system-out").text = "\n".join(output)


def _add_failure(test: Element, case: StoredCase, history: History, smallest: Sequence[SmallestCase]) -> None:
    first, *others = case.verdict.failures
    more = f" (and {counted(len(others), 'more failure')})" if others else ""
    tag = (
        "error" if case.is_lost else "failure"
    )  # in JUnit, a test that could not be carried out is an error, not a failure
    failure = SubElement(test, tag, {"type": first.kind.value, "message": f"{first}{more}"})
    lines = (*_failure_lines(case, history), *(line for each in smallest for line in smallest_lines(each)))
    failure.text = "\n".join(lines)


def _failure_lines(case: StoredCase, history: History) -> Iterator[str]:
    """Return the lines about a case that failed: failures, goal, end, place and command."""
    for failure in case.verdict.failures:
        yield f"{failure.kind.value} {failure.subject}: {failure}"
    yield f"goal: {case.goal}"
    where = place_of(case, history) or "simulated"
    yield f"ended: {case.verdict.end.replace('_', ' ')} after {_seconds(case.ended_ns)} s {where}"
    command = again(case, portable(history.source.path), history.runs)
    if command:
        yield f"{again_words(case)}: {command}"


def _seconds(time_ns: int) -> str:
    """Return nanoseconds as seconds with three decimals, the most that the schema of Jenkins allows."""
    return f"{time_ns / 1e9:.3f}"
