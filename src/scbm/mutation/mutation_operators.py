"""The mutation operators as a table: which sites of a model each one changes, and how (decision 50)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from msgspec import Struct

from scbm.mutation import mutation_sites as sites
from scbm.mutation import site_edits as edits
from scbm.mutation.expression_edits import other_thresholds, other_values, other_variables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.model import BehaviorModel
    from scbm.mutation.mutants import Mutant
    from scbm.mutation.mutation_sites import Site
    from scbm.mutation.site_edits import SiteEdits

T = TypeVar("T")


class MutationOperator(Struct, Generic[T], frozen=True):
    """A mutation operator.

    Attributes:
        group: the group that `--operators` can name instead of the operators in it.
        summary: what the operator changes, for help and documentation.
        sites: yields the sites of a model that it changes, in the order of the file.
        edits: yields what the value of a site becomes.
    """

    group: str
    summary: str
    sites: Callable[[BehaviorModel], Iterator[Site[T]]]
    edits: SiteEdits[T]

    def mutants(self, model: BehaviorModel, name: str) -> Iterator[Mutant]:
        """Yield the mutants of a model in the order of the file.

        The loader accepts each of them without its bindings. Some may equal the model or each other.

        Args:
            model: the model.
            name: the name of the operator.
        """
        for site in self.sites(model):
            for edit in self.edits(site, model):
                yield site.mutant(name, edit)


MUTATIONS: dict[str, MutationOperator[Any]] = {
    "guard-drop": MutationOperator(
        "guards", "a conjunct of a guard is left out", sites.guards, edits.each_conjunct(edits.drop)
    ),
    "guard-negate": MutationOperator(
        "guards", "a conjunct of a guard is negated", sites.guards, edits.each_conjunct(edits.negate)
    ),
    "guard-value": MutationOperator(
        "guards",
        "a guard compares with the next value of the domain",
        sites.guards,
        edits.each_comparison("value", other_values),
    ),
    "guard-variable": MutationOperator(
        "guards",
        "a guard compares the next variable that has the same domain",
        sites.guards,
        edits.each_comparison("variable", other_variables),
    ),
    "guard-threshold": MutationOperator(
        "guards",
        "a guard compares an integer with one less or one more",
        sites.guards,
        edits.each_comparison("threshold", other_thresholds),
    ),
    "guard-move": MutationOperator(
        "guards",
        "a conjunct moves between `g` and `gr`, so the planner ignores it or sees it",
        lambda model: sites.moves(model, "g", "gr"),
        edits.move_conjunct,
    ),
    "action-drop": MutationOperator(
        "actions",
        "an action of a pre- or postcondition is left out",
        sites.planned_actions,
        edits.each_item(edits.drop),
    ),
    "action-value": MutationOperator(
        "actions",
        "an action assigns the next value of the domain or another sum, or counts in the other direction",
        sites.all_actions,
        edits.each_item(edits.assign_other),
    ),
    "action-move": MutationOperator(
        "actions",
        "an action moves between `a` and `ar`, so the planner ignores it or sees it",
        lambda model: sites.moves(model, "a", "ar"),
        edits.move_action,
    ),
    "clean-up-drop": MutationOperator(
        "clean-up",
        "an action of `failed`, of `timedout` or of an automatic transition is left out",
        sites.clean_up,
        edits.each_item(edits.drop_unless_last),
    ),
    "deadline-none": MutationOperator(
        "deadlines",
        "an operation has no `deadline` (and no `timedout`), or no `disabled_deadline`",
        sites.droppable_deadlines,
        edits.other_deadline(lambda _: None),
    ),
    "deadline-shorter": MutationOperator(
        "deadlines", "a deadline is a tenth", sites.deadlines, edits.other_deadline(lambda ns: ns // 10)
    ),
    "deadline-longer": MutationOperator(
        "deadlines", "a deadline is ten times as long", sites.deadlines, edits.other_deadline(lambda ns: ns * 10)
    ),
    "transition-drop": MutationOperator(
        "transitions",
        "an automatic transition, or the `failed` transition of an operation, is left out",
        sites.droppable_transitions,
        edits.leave_out,
    ),
    "transition-swap": MutationOperator(
        "transitions",
        "two neighbouring automatic transitions change places",
        lambda model: sites.neighbours(model, "automatic_transitions"),
        edits.swap,
    ),
    "trigger-other": MutationOperator(
        "resources",
        "an operation assigns the trigger of the next resource",
        sites.operation_actions,
        edits.each_item(edits.trigger_other),
    ),
    "request-drop": MutationOperator(
        "resources",
        "the requests to a resource do not carry one of their variables",
        sites.requests,
        edits.each_item(edits.drop),
    ),
    "request-other": MutationOperator(
        "resources",
        "the requests to a resource carry the next declared variable instead of one of theirs",
        sites.requests,
        edits.each_item(edits.carry_other),
    ),
    "operation-drop": MutationOperator(
        "operations",
        "an operation is left out, unless something else in the model reads or assigns its state",
        sites.droppable_operations,
        edits.leave_out,
    ),
    "operation-swap": MutationOperator(
        "operations",
        "two neighbouring operations change places",
        lambda model: sites.neighbours(model, "operations"),
        edits.swap,
    ),
    "initial-value": MutationOperator(
        "initial-values",
        "the nominal initial value of a variable is the next one of its domain",
        sites.initial_values,
        edits.begin_with_other,
    ),
    "environment-drop": MutationOperator(
        "environment", "an environment transition is left out", sites.droppable_environment, edits.leave_out
    ),
    "environment-guard": MutationOperator(
        "environment",
        "a conjunct of the guard of an environment transition is left out or negated",
        lambda model: sites.environment(model, "guard"),
        edits.each_conjunct(edits.drop, edits.negate),
    ),
    "environment-action": MutationOperator(
        "environment",
        "an action of an environment transition is left out, or assigns the next value of the domain",
        lambda model: sites.environment(model, "actions"),
        edits.each_item(edits.drop_unless_last, edits.assign_other),
    ),
}
"""The mutation operators by their names, in the order of reports."""
