"""The arguments of certificates by name: how a certificate writes each of them, what checks it, and the whole check.

To add one: a class beside the others in `certificate`, and an entry in `ARGUMENTS`. `check_certificate` says whether a
certificate proves its claims.
"""

from __future__ import annotations

import json
from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from scbm.model import FIRST_PLANNER, GoalOrder, PlanSet, RunPlans
from scbm.proofcheck.certificate import (
    Awaits,
    CertificateFlaw,
    Fact,
    GoalRuns,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
    claimable_obligations,
)
from scbm.proofcheck.runs_check import check_runs
from scbm.proofcheck.structure_check import check_structure
from scbm.proofcheck.values_check import check_values

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel, Value
    from scbm.model.json_reader import JsonPath
    from scbm.proofcheck.certificate import Certificate, ClaimedObligation, Queue
    from scbm.proofcheck.certificate_parts import CertificateParts


_FACTS = {fact.name.lower(): fact for fact in Fact}
_AWAITS = {awaits.value: awaits for awaits in Awaits}
_MIN_PARTS, _MAX_PARTS = 3, 4


class ArgumentFormat(Struct, frozen=True):
    """How certificates write an argument, and what checks it.

    Attributes:
        keys: the keys of a certificate with this argument, beside those of all certificates.
        read: gets the reader of parts and the JSON object, and returns the argument. It refuses a part by `refuse`.
        write: returns the lines of the argument, one `"key": value` for each of `keys`.
        check: gets the claimed obligations, the argument and the model, and returns all flaws: none is a proof.
    """

    keys: tuple[str, ...]
    read: Callable[[CertificateParts, dict[str, Any]], Any]
    write: Callable[[Any], list[str]]
    check: Callable[[Sequence[ClaimedObligation], Any, BehaviorModel], Iterator[CertificateFlaw]]


def json_text(value: object) -> str:
    """Return a value as JSON on one line."""
    return json.dumps(value, ensure_ascii=False)


def json_list(lines: Iterable[str]) -> str:
    """Return elements that are JSON already as a list, each on a line of its own."""
    return "[\n" + ",\n".join(lines) + "\n]"


# facts of the model file


def _read_facts(parts: CertificateParts, document: dict[str, Any]) -> StructureArgument:
    def fact(value: object, path: JsonPath) -> Fact:
        if not isinstance(value, str) or value not in _FACTS:
            parts.refuse(path, f"a fact is one of {', '.join(_FACTS)}")
        return _FACTS[value]

    return StructureArgument(parts.each(document["facts"], ("facts",), fact))


def _write_facts(argument: StructureArgument) -> list[str]:
    return [f'"facts": {json_text([fact.name.lower() for fact in argument.facts])}']


# values of variables


def _read_values(parts: CertificateParts, document: dict[str, Any]) -> ValuesArgument:
    value: object = document["values"]
    if not isinstance(value, dict):
        parts.refuse(("values",), "expected an object of variables, each with a list of values")
    sets: Iterable[tuple[str, tuple[Value, ...]]] = (
        (parts.word(name, ("values",)), parts.values(values, ("values", name))) for name, values in value.items()
    )
    return ValuesArgument(tuple(sets))


def _write_values(argument: ValuesArgument) -> list[str]:
    lines = (f"{json_text(name)}: {json_text(allowed)}" for name, allowed in argument.values)
    return ['"values": {\n' + ",\n".join(lines) + "\n}"]


# situations of runs


def _read_runs(parts: CertificateParts, document: dict[str, Any]) -> RunsArgument:
    goals, plans = GoalOrder(document["goals"]), PlanSet(document["plans"])
    is_of_states = plans is PlanSet.ANY

    def situation(value: object, path: JsonPath) -> Situation:
        return _read_situation(parts, value, path, is_of_states=is_of_states)

    def runs(value: object, path: JsonPath) -> GoalRuns:
        read = parts.keys(value, ("goal", *(["planned"] if is_of_states else []), "situations"), path)
        situations = parts.each(read["situations"], (*path, "situations"), situation)
        planned = parts.words(read["planned"], (*path, "planned")) if is_of_states else ()
        return GoalRuns(parts.word(read["goal"], (*path, "goal")), situations, planned)

    variables = parts.words(document["variables"], ("variables",))
    return RunsArgument(variables, parts.each(document["runs"], ("runs",), runs), goals, plans)


def _read_situation(parts: CertificateParts, value: object, path: JsonPath, *, is_of_states: bool) -> Situation:
    if not isinstance(value, list) or not _MIN_PARTS <= len(value) <= _MAX_PARTS:
        parts.refuse(path, "a situation is a list of values, queue, requests in flight, and the awaited thing")
    values = parts.values(value[0], (*path, 0))
    queue: Queue = None
    if is_of_states and value[1] is not None:
        queue = parts.values(value[1], (*path, 1))
    elif not is_of_states:
        queue = parts.words(value[1], (*path, 1)) or None
    in_flight = parts.words(value[2], (*path, 2))
    if len(value) < _MAX_PARTS:
        return Situation(values, queue, in_flight)
    if not isinstance(value[3], str) or value[3] not in _AWAITS:
        parts.refuse((*path, 3), f"the awaited thing of a situation is one of {', '.join(_AWAITS)}")
    return Situation(values, queue, in_flight, _AWAITS[value[3]])


def _write_runs(argument: RunsArgument) -> list[str]:
    is_of_states = argument.plans is PlanSet.ANY
    goals = (_runs_text(runs, is_of_states=is_of_states) for runs in argument.runs)
    return [f'"variables": {json_text(argument.variables)}', f'"runs": {json_list(goals)}']


def _runs_text(runs: GoalRuns, *, is_of_states: bool) -> str:
    planned = f', "planned": {json_text(runs.planned)}' if is_of_states else ""
    situations = (_situation_text(situation, is_of_states=is_of_states) for situation in runs.situations)
    return f'{{"goal": {json_text(runs.goal)}{planned}, "situations": {json_list(situations)}}}'


def _situation_text(situation: Situation, *, is_of_states: bool) -> str:
    """Return the values, the queue, the requests in flight, and what the situation awaits, if anything."""
    queue = situation.queue if is_of_states else situation.queue or ()
    parts: list[object] = [situation.values, queue, situation.in_flight]
    if situation.awaits is not Awaits.NOTHING:
        parts.append(situation.awaits.value)
    return json.dumps(parts, ensure_ascii=False, separators=(",", ":"))


ARGUMENTS: dict[str, ArgumentFormat] = {
    StructureArgument.kind: ArgumentFormat(("facts",), _read_facts, _write_facts, check_structure),
    ValuesArgument.kind: ArgumentFormat(("values",), _read_values, _write_values, check_values),
    RunsArgument.kind: ArgumentFormat(("variables", "runs"), _read_runs, _write_runs, check_runs),
}
"""The arguments by the names that certificates give them under `argument`, the cheapest first."""


MAX_FLAWS = 20
"""Maximum number of flaws that are reported."""


def check_certificate(certificate: Certificate, model: BehaviorModel) -> tuple[CertificateFlaw, ...]:
    """Return the first flaws of a certificate; none if it proves its claims for this model.

    Args:
        certificate: a certificate of any origin; the check trusts nothing in it.
        model: the model. The caller compares it with `certificate.digest`.
    """
    return tuple(islice(_flaws(certificate, model), MAX_FLAWS))


def _flaws(certificate: Certificate, model: BehaviorModel) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the claims themselves, or else of the argument."""
    if certificate.model != model.name:
        yield CertificateFlaw(
            "the certificate", f"it is one of the model {certificate.model}, and this is {model.name}"
        )
        return
    known = {str(obligation): obligation for obligation in claimable_obligations(model)}
    names = certificate.claims
    flaws = [
        CertificateFlaw(f"claim {name}", "the model has no such obligation") for name in names if name not in known
    ]
    flaws += [
        CertificateFlaw(f"claim {name}", "it is made twice") for name, times in Counter(names).items() if times > 1
    ]
    if not names:
        flaws.append(CertificateFlaw("the claims", "there are none"))
    flaws += _flaws_of_planner(certificate, model)
    argument = certificate.argument
    yield from flaws or ARGUMENTS[argument.kind].check([known[name] for name in names], argument, model)


def _flaws_of_planner(certificate: Certificate, model: BehaviorModel) -> list[CertificateFlaw]:
    """Return why the runs of a certificate are not those of the model. Of planners the canonical one is checked."""
    flaws = []
    if certificate.goals is GoalOrder.SINGLE and model.runs.goals is GoalOrder.SEQUENCE:
        reason = "it is about runs with one goal each, and goals of the model follow each other: write `goals: single`"
        flaws.append(CertificateFlaw("the goals", f"{reason} under `runs:` if they do not"))
    if certificate.is_for_any_plan:
        if certificate.planner is not None:
            flaws.append(CertificateFlaw("the planner", f"its plans are `{certificate.plans}`, so it must be `null`"))
        return flaws
    if model.runs.plans is RunPlans.DRAWN:
        reason = "it is about canonical plans, and plans of the model are drawn: close the model again"
        flaws.append(CertificateFlaw("the plans", f"{reason}, or leave out `plans: drawn` under `runs:`"))
    known, used = FIRST_PLANNER.name, model.planner.name or FIRST_PLANNER.name
    if certificate.planner != FIRST_PLANNER:
        flaws.append(CertificateFlaw("the planner", f"claims about its runs are checked for `{FIRST_PLANNER}` alone"))
    if used != known:
        flaws.append(CertificateFlaw("the planner", f"the runs of the model are planned by `{used}`"))
    return flaws
