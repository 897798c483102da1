"""The certificates of requirements that hold in all runs: one for each exploration or set that decided some of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.closing.proofs.proofs import planner_of_proofs, runs_argument
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.closing.symbolic.requirement_sets import RequirementSets
from scbm.files import digest_of
from scbm.model import PlanSet
from scbm.model.requirements import BuiltIn
from scbm.proofcheck import Certificate, RequirementsArgument
from scbm.proofcheck.certificate import ClaimedRequirement

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.closing.requirements.blocking_search import BlockingSearch
    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import BehaviorModel
    from scbm.proofcheck import Argument

    Proof: TypeAlias = AllRuns | RequirementSets
    """The runs that do not violate a requirement, or the set that has all their situations."""


def claim_of(key: RequirementKey) -> str:
    """Return how certificates name a requirement."""
    return str(ClaimedRequirement(key.name, key.is_built_in))


def requirement_certificates(
    model: BehaviorModel, proved: Mapping[RequirementKey, Proof], continued: BlockingSearch | None
) -> Iterator[tuple[str, Certificate]]:
    """Yield the certificates of requirements, each with its name.

    Args:
        model: the model.
        proved: the runs or the set that prove a requirement, for each of them.
        continued: the search that has found that `non_blocking` holds; `None` if no certificate can say that.
    """
    claims: dict[int, list[RequirementKey]] = {}
    for key, proof in proved.items():
        if isinstance(proof, RequirementSets) or proof.proves:
            claims.setdefault(id(proof), []).append(key)
    names: dict[str, int] = {}
    for keys in claims.values():
        proof = proved[keys[0]]
        argument = _argument(proof, keys)
        name = argument.kind if proof.plans is PlanSet.ANY else f"{argument.kind}-{proof.plans}"
        names[name] = names.get(name, 0) + 1
        planner = planner_of_proofs(model) if proof.plans is PlanSet.CANONICAL else None
        certificate = Certificate(model.name, digest_of(model), tuple(map(claim_of, keys)), argument, planner)
        yield name if names[name] == 1 else f"{name}-{names[name]}", certificate
    if continued is not None:
        key = RequirementKey(BuiltIn.NON_BLOCKING.value, is_built_in=True)
        argument = continued.certificate
        planner = planner_of_proofs(model)
        yield argument.kind, Certificate(model.name, digest_of(model), (claim_of(key),), argument, planner)


def _argument(proof: Proof, keys: Sequence[RequirementKey]) -> Argument:
    if isinstance(proof, RequirementSets):
        return proof.argument([key.name for key in keys])
    found = runs_argument(proof)
    return RequirementsArgument(found.variables, found.runs, found.goals, found.plans)
