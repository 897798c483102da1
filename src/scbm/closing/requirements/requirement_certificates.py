"""The certificates of requirements that hold in all runs: one for each exploration that decided some of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.proofs.proofs import planner_of_proofs, runs_argument
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.files import digest_of
from scbm.model import PlanSet
from scbm.model.requirements import BuiltIn
from scbm.proofcheck import Certificate, RequirementsArgument
from scbm.proofcheck.certificate import ClaimedRequirement

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.closing.requirements.blocking_search import BlockingSearch
    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import BehaviorModel


def claim_of(key: RequirementKey) -> str:
    """Return how certificates name a requirement."""
    return str(ClaimedRequirement(key.name, key.is_built_in))


def requirement_certificates(
    model: BehaviorModel, proved: Mapping[RequirementKey, AllRuns], continued: BlockingSearch | None
) -> Iterator[tuple[str, Certificate]]:
    """Yield the certificates of requirements, each with its name.

    Args:
        model: the model.
        proved: the runs that prove a requirement, for each of them.
        continued: the search that has found that `non_blocking` holds; `None` if no certificate can say that.
    """
    claims: dict[int, list[RequirementKey]] = {}
    for key, runs in proved.items():
        if runs.proves:
            claims.setdefault(id(runs), []).append(key)
    names: dict[str, int] = {}
    for keys in claims.values():
        runs = proved[keys[0]]
        found = runs_argument(runs)
        name = RequirementsArgument.kind if runs.plans is PlanSet.ANY else f"{RequirementsArgument.kind}-{runs.plans}"
        names[name] = names.get(name, 0) + 1
        watched = RequirementsArgument(found.variables, found.runs, found.goals, found.plans)
        planner = planner_of_proofs(model) if runs.plans is PlanSet.CANONICAL else None
        certificate = Certificate(model.name, digest_of(model), tuple(map(claim_of, keys)), watched, planner)
        yield name if names[name] == 1 else f"{name}-{names[name]}", certificate
    if continued is not None:
        key = RequirementKey(BuiltIn.NON_BLOCKING.value, is_built_in=True)
        argument = continued.certificate
        planner = planner_of_proofs(model)
        yield argument.kind, Certificate(model.name, digest_of(model), (claim_of(key),), argument, planner)
