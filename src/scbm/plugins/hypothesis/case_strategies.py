"""Strategies for whole cases."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from hypothesis import note
from hypothesis import strategies as st
from hypothesis.vendor.pretty import for_type_by_name

from scbm.cases import Case, Network, Origin
from scbm.files import Scope, parse_requirement, write_case
from scbm.model import Requirement
from scbm.plugins.hypothesis.clause_strategies import goals, initial_states, networks
from scbm.plugins.hypothesis.clause_strategies import injections as any_injections
from scbm.plugins.hypothesis.clause_strategies import outcomes as any_outcomes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hypothesis.strategies import DrawFn, SearchStrategy
    from hypothesis.vendor.pretty import RepresentationPrinter

    from scbm.cases import Injection, OutcomeRule
    from scbm.model import BehaviorModel, Predicate, State

_Part = TypeVar("_Part")

_SEEDS = st.integers(0, 2**32 - 1)


def cases(  # noqa: PLR0913 - the parts of a case
    model: BehaviorModel,
    *,
    goal: SearchStrategy[tuple[str, Predicate]] | None = None,
    initial: SearchStrategy[State] | None = None,
    outcomes: bool | SearchStrategy[tuple[OutcomeRule, ...]] = True,
    injections: bool | SearchStrategy[tuple[Injection, ...]] = False,
    network: bool | SearchStrategy[Network] = False,
    requirements: Mapping[str, str] | None = None,
) -> SearchStrategy[Case]:
    """Return a strategy for cases of a model. Hypothesis shows a failing one as a case file, which can be saved.

    Nothing is left to chance in them but the fate of messages, if the network says so; then a seed is drawn, too.

    Args:
        model: what is tested.
        goal: what runs are for; the goals of the model, if missing.
        initial: where runs begin; the initial states that the model allows, if missing.
        outcomes: what becomes of requests: drawn or plain, or a strategy of your own.
        injections: what is changed on the way: drawn or nothing, or a strategy of your own.
        network: how messages travel: drawn or at once, or a strategy of your own.
        requirements: further requirements, by name, as in a case file.

    Raises:
        InputError: a requirement is wrong, or the model has no goals or no initial state.
    """
    drawn_goal = goals(model) if goal is None else goal
    drawn_initial = initial_states(model) if initial is None else initial
    drawn_outcomes = _either(outcomes, any_outcomes(model), ())
    drawn_injections = _either(injections, any_injections(model), ())
    drawn_network = _either(network, networks(model), Network())
    asked = _read(requirements or {}, model)

    @st.composite
    def case(draw: DrawFn) -> Case:
        name, predicate = draw(drawn_goal)
        drawn = Case(
            "found",
            name,
            predicate,
            draw(drawn_initial),
            draw(drawn_outcomes),
            draw(drawn_injections),
            draw(drawn_network),
            requirements=asked,
        )
        if drawn.network.draws:
            drawn = replace(drawn, origin=Origin(draw(_SEEDS)))
        note(_File(drawn, model))
        return drawn

    return case()


def _either(asked: bool | SearchStrategy[_Part], drawn: SearchStrategy[_Part], plain: _Part) -> SearchStrategy[_Part]:  # noqa: FBT001 - it is one of the two that users may give
    if isinstance(asked, bool):
        return drawn if asked else st.just(plain)
    return asked


def _read(requirements: Mapping[str, str], model: BehaviorModel) -> tuple[Requirement, ...]:
    scope = Scope.of(model)
    return tuple(
        Requirement(name, parse_requirement(sentence, scope, file=f"requirement {name}"))
        for name, sentence in requirements.items()
    )


class _File:
    """The file of a case, written only when Hypothesis shows it: for the smallest failing case."""

    def __init__(self, case: Case, model: BehaviorModel) -> None:
        self._case = case
        self._model = model

    def __repr__(self) -> str:
        return f"The case as a file:\n\n{write_case(self._case, self._model, None)}"


def _show(case: Case, printer: RepresentationPrinter, cycle: bool) -> None:  # noqa: ARG001, FBT001 - as the printer calls it
    """A case in the report of Hypothesis, which shows its file."""
    printer.text(f"<case {case.name}: goal {case.goal}>")


for_type_by_name(Case.__module__, Case.__name__, _show)
