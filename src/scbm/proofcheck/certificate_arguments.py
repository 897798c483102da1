"""The arguments of certificates by name: how a certificate has each of them, what checks it, and the whole check.

To add one: a class beside the others in `certificate`, and an entry in `ARGUMENTS`. `check_certificate` says whether a
certificate proves its claims.
"""

from __future__ import annotations

import json
from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, Any

from msgspec import Struct, to_builtins

from scbm.model import FIRST_PLANNER, GoalOrder, PlanSet, RunPlans
from scbm.proofcheck.certificate import (
    Awaits,
    CertificateFlaw,
    ContinuationsArgument,
    RequirementsArgument,
    RequirementSetsArgument,
    RunsArgument,
    SetsArgument,
    StructureArgument,
    ValuesArgument,
    claimable_obligations,
    claimable_requirements,
)
from scbm.proofcheck.continuations_check import check_continuations
from scbm.proofcheck.requirements_check import check_requirements
from scbm.proofcheck.runs_check import check_runs
from scbm.proofcheck.sets.requirement_sets_check import check_requirement_sets
from scbm.proofcheck.sets.sets_check import check_sets
from scbm.proofcheck.structure_check import check_structure
from scbm.proofcheck.values_check import check_values

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.proofcheck.certificate import Certificate, GoalRuns, Situation


class ArgumentFormat(Struct, frozen=True):
    """How certificates write an argument, and what checks it.

    Attributes:
        record: the class of the argument; its fields are keys of a certificate, beside those of all certificates.
        write: returns the lines of the argument, one `"key": value` for each of these keys.
        check: gets what is claimed, the argument and the model, and returns all flaws: none is a proof.
        claimable: returns everything that it may be about.
        noun: what a claim is about.
    """

    record: type[Any]
    write: Callable[[Any], list[str]]
    check: Callable[[Sequence[Any], Any, BehaviorModel], Iterator[CertificateFlaw]]
    claimable: Callable[[BehaviorModel], Sequence[object]] = claimable_obligations
    noun: str = "obligation"


def json_text(value: object) -> str:
    """Return a value as JSON on one line."""
    return json.dumps(value, ensure_ascii=False)


def json_list(lines: Iterable[str]) -> str:
    """Return elements that are JSON already as a list, each on a line of its own."""
    return "[\n" + ",\n".join(lines) + "\n]"


def _write_facts(argument: StructureArgument) -> list[str]:
    return [f'"facts": {json_text(argument.facts)}']


def _write_values(argument: ValuesArgument) -> list[str]:
    lines = (f"{json_text(name)}: {json_text(allowed)}" for name, allowed in argument.values.items())
    return ['"values": {\n' + ",\n".join(lines) + "\n}"]


def _write_runs(argument: RunsArgument) -> list[str]:
    is_of_states = argument.plans is PlanSet.ANY
    goals = (_runs_text(runs, is_of_states=is_of_states) for runs in argument.runs)
    return [f'"variables": {json_text(argument.variables)}', f'"runs": {json_list(goals)}']


def _write_continuations(argument: ContinuationsArgument) -> list[str]:
    rests = json_list(map(json_text, argument.rests))
    answers = json_list(json.dumps(to_builtins(each), ensure_ascii=False) for each in argument.answers)
    return [*_write_runs(argument), f'"rests": {rests}', f'"answers": {answers}']


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


def _write_sets(argument: SetsArgument) -> list[str]:
    nodes = json_list(json.dumps(node, separators=(",", ":")) for node in argument.nodes)
    names = f'"variables": {json_text(argument.variables)}'
    lines = [names, f'"nodes": {nodes}', f'"reached": {argument.reached}, "dead": {argument.dead}']
    canonical = (("layers", argument.layers), ("choices", argument.choices))
    return [*lines, *(f'"{key}": {json_text(numbers)}' for key, numbers in canonical if numbers)]


def _write_requirement_sets(argument: RequirementSetsArgument) -> list[str]:
    return [*_write_sets(argument), f'"watched": {json_text(argument.watched)}']


ARGUMENTS: dict[str, ArgumentFormat] = {
    StructureArgument.kind: ArgumentFormat(StructureArgument, _write_facts, check_structure),
    ValuesArgument.kind: ArgumentFormat(ValuesArgument, _write_values, check_values),
    RunsArgument.kind: ArgumentFormat(RunsArgument, _write_runs, check_runs),
    SetsArgument.kind: ArgumentFormat(SetsArgument, _write_sets, check_sets),
    RequirementsArgument.kind: ArgumentFormat(
        RequirementsArgument, _write_runs, check_requirements, claimable_requirements, "requirement"
    ),
    RequirementSetsArgument.kind: ArgumentFormat(
        RequirementSetsArgument,
        _write_requirement_sets,
        check_requirement_sets,
        claimable_requirements,
        "requirement",
    ),
    ContinuationsArgument.kind: ArgumentFormat(
        ContinuationsArgument, _write_continuations, check_continuations, claimable_requirements, "requirement"
    ),
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
    form = ARGUMENTS[certificate.argument.kind]
    known = {str(each): each for each in form.claimable(model)}
    names = certificate.claims
    flaws = [
        CertificateFlaw(f"claim {name}", f"the model has no such {form.noun}") for name in names if name not in known
    ]
    flaws += [
        CertificateFlaw(f"claim {name}", "it is made twice") for name, times in Counter(names).items() if times > 1
    ]
    if not names:
        flaws.append(CertificateFlaw("the claims", "there are none"))
    flaws += _flaws_of_planner(certificate, model)
    yield from flaws or form.check([known[name] for name in names], certificate.argument, model)


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
