"""One automaton for each variable of a model: its values are nodes, and each way to change the value is an edge.

An edge starts from the values that the guard `g && gr` of its maker allows: a value is allowed if some values of the
other variables satisfy the guard with it. An effect at the end of an operation also starts from the values that the
variable can have then: those allowed at the start of the operation, as its start leaves them, and what automatic
transitions, the environment, replies and published values make of them meanwhile.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.drawing.model_changes import MakerKind, model_changes, within
from scbm.drawing.value_groups import guards_and_goals, value_groups
from scbm.model import Add, And, Assign, Constant, Domain, InitialStates, Reference
from scbm.model.normal_form import bits_of, normal_form
from scbm.model.satisfiability import satisfiable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.drawing.model_changes import ChangeMaker, ModelChange
    from scbm.drawing.value_groups import ValueGroup
    from scbm.model import Action, BehaviorModel, Variable
    from scbm.model.normal_form import NormalForm

ANY_OTHER = -1
"""The source of an edge that starts from all groups but its target."""

_MAX_BRANCHES = 10_000
"""Maximum number of branches of the search for values of the other variables; beyond it an edge is a bound."""


class ChangeEdge(Struct, frozen=True):
    """A way to change the value of a variable.

    Attributes:
        maker: who makes the change.
        source: the number of the group of values before it, or `ANY_OTHER`.
        target: the number of the group after it.
        is_meanwhile: whether the variable has the value before only if something has changed it during the operation.
        is_bound: whether the search met its limit, so that the guard may exclude the value before.
    """

    maker: ChangeMaker
    source: int
    target: int
    is_meanwhile: bool = False
    is_bound: bool = False


class Automaton(Struct, frozen=True):
    """The values of a variable, and everything that changes it.

    Attributes:
        variable: the variable.
        groups: its values: the nodes.
        edges: the changes, those of one maker together.
    """

    variable: Variable
    groups: tuple[ValueGroup, ...]
    edges: tuple[ChangeEdge, ...]


class ModelAutomata(Struct, frozen=True):
    """The automata of a model.

    Attributes:
        model: the model.
        automata: one for each declared variable, in the order of the model.
        carried: the variables that are written for requests only: no guard, goal or action reads them.
    """

    model: BehaviorModel
    automata: tuple[Automaton, ...]
    carried: tuple[str, ...]

    @staticmethod
    def of(model: BehaviorModel) -> ModelAutomata:
        """Return the automata of a model."""
        read, changes = _read(model), model_changes(model)
        in_requests = dict.fromkeys(name for resource in model.resources for name in resource.request)
        carried = tuple(v.name for v in model.variables if v.name in in_requests and v.name not in read)
        begin = normal_form(model.initial_states, model.space)
        values = InitialStates(model).beginnings(is_open=True)
        starts = [[bits_of(map(v.domain.index, each[v.name])) for v in model.space] for each in values]
        found = [_VariableChanges(model, variable, changes) for variable in model.variables]
        return ModelAutomata(model, tuple(each.automaton(begin, starts) for each in found), carried)

    @property
    def drawn(self) -> tuple[Automaton, ...]:
        """The automata that a picture of the whole model shows."""
        return tuple(each for each in self.automata if each.edges and each.variable.name not in self.carried)

    @property
    def unchanged(self) -> tuple[str, ...]:
        """The variables that nothing changes."""
        return tuple(each.variable.name for each in self.automata if not each.edges)


def _read(model: BehaviorModel) -> dict[str, None]:
    """Return the variables that a guard, a goal or an action reads."""
    outside = (action for each in model.environment for action in each.actions)
    actions = (name for action in (*model.actions, *outside) for name in action.reads())
    return dict.fromkeys((*actions, *(name for predicate in guards_and_goals(model) for name in predicate.reads())))


class _VariableChanges:
    """The changes of one variable, as steps between groups of its values."""

    def __init__(self, model: BehaviorModel, variable: Variable, changes: Sequence[ModelChange]) -> None:
        self._space = model.running_space
        self._variable = variable
        self._groups = value_groups(model, variable)
        self._group_of = {value: number for number, group in enumerate(self._groups) for value in group.values}
        self._bits = [bits_of(map(variable.domain.index, group.values)) for group in self._groups]
        name = variable.name
        self._changes = [each for each in changes if each.action_on(name) is not None or each.values_given(name)]

    def automaton(self, begin: NormalForm, starts: Sequence[Sequence[int]]) -> Automaton:
        """Return the automaton, with one edge from any other value where all others have the same one.

        Args:
            begin: the predicate that holds where runs begin.
            starts: the values of all variables there, as bits; one of these holds.
        """
        place = self._space.position(self._variable.name)
        narrowed = [[(*each[:place], each[place] & bits, *each[place + 1 :]) for each in starts] for bits in self._bits]
        allowed = [any(s[place] and satisfiable(begin, s) is not False for s in each) for each in narrowed]
        known = {each.maker: self._steps(each) for each in self._changes if each.start is None}
        others = [edge for found in known.values() for edge in found if edge.maker.kind is not MakerKind.START]
        edges: list[ChangeEdge] = []
        for change in self._changes:
            found = known[change.maker] if change.start is None else self._at_end(change, change.start, others)
            edges += self._merged(found)
        groups = (replace(each, is_allowed=known) for each, known in zip(self._groups, allowed, strict=True))
        return Automaton(self._variable, tuple(groups), tuple(edges))

    def _at_end(self, change: ModelChange, start: ModelChange, others: Sequence[ChangeEdge]) -> list[ChangeEdge]:
        """Return the edges of the end of an operation, from the values that the variable can have then."""
        begun = self._after_start(start)
        return [
            replace(e, is_meanwhile=e.source not in begun, is_bound=e.is_bound or begun.get(e.source, False))
            for e in self._steps(change, _closure(begun, others))
        ]

    def _after_start(self, start: ModelChange) -> dict[int, bool]:
        """Return the groups that the variable can be in after a start, each with whether that is a bound only."""
        if start.action_on(self._variable.name) is not None:
            begun: dict[int, bool] = {}
            for step in self._steps(start, keeps=True):
                begun[step.target] = begun.get(step.target, True) and step.is_bound
            return begun
        form = normal_form(start.guard, self._space)
        found = {number: self._can_hold(form, bits) for number, bits in enumerate(self._bits)}
        return {number: answer is None for number, answer in found.items() if answer is not False}

    def _steps(
        self, change: ModelChange, sources: Iterable[int] | None = None, *, keeps: bool = False
    ) -> list[ChangeEdge]:
        """Return the edges of a change from some groups, or from all.

        Args:
            change: the change.
            sources: the numbers of the groups.
            keeps: whether a change that leaves the value as it is counts, too.
        """
        action = change.action_on(self._variable.name)
        tests = self._tests(change, action)
        found = []
        for source in range(len(self._groups)) if sources is None else sources:
            for target, form in tests:
                answer = self._leads(form, action, source, target, keeps=keeps)
                if answer is not False:
                    found.append(ChangeEdge(change.maker, source, target, is_bound=answer is None))
        return found

    def _tests(self, change: ModelChange, action: Action | None) -> list[tuple[int, NormalForm]]:
        """Return the groups that a change may lead to, each with where its guard holds and its action leads there."""
        form = normal_form(change.guard, self._space)
        match action:
            case None:
                given = dict.fromkeys(self._group_of[value] for value in change.values_given(self._variable.name))
                return [(target, form) for target in given]
            case Assign(_, Constant(value)):
                return [(self._group_of[value], form)]
            case Add() | Assign(_, Reference()):
                return [(target, form) for target in range(len(self._groups))]
            case Assign(_, term):
                return [
                    (number, normal_form(And((change.guard, *within(term, Domain(group.values)))), self._space))
                    for number, group in enumerate(self._groups)
                ]

    def _leads(self, form: NormalForm, action: Action | None, source: int, target: int, *, keeps: bool) -> bool | None:
        """Return whether a change can lead from one group to another; `None` if the search met its limit."""
        before, after = self._bits[source], self._bits[target]
        if source == target and before.bit_count() == 1 and not keeps:
            return False
        match action:
            case Add(_, amount):
                return self._can_hold(form, before & (after >> amount if amount > 0 else after << -amount))
            case Assign(_, Reference(name)) if self._space[name].domain == self._variable.domain:
                return self._can_hold(form, before, (name, after))
            case Assign(_, Reference(name)):
                values, domain = self._groups[target].values, self._space[name].domain
                return self._can_hold(form, before, (name, bits_of(domain.index(v) for v in values if v in domain)))
        return self._can_hold(form, before)

    def _can_hold(self, form: NormalForm, values: int, *others: tuple[str, int]) -> bool | None:
        """Return whether a condition can hold with one of some values; `None` if the search met its limit."""
        bits = [*self._space.all_values]
        for name, allowed in ((self._variable.name, values), *others):
            bits[self._space.position(name)] &= allowed
        return all(bits) and satisfiable(form, bits, _MAX_BRANCHES)

    def _merged(self, edges: Sequence[ChangeEdge]) -> Iterator[ChangeEdge]:
        """Yield the edges of one maker; one from any other value where these are two or more, and all alike."""
        alike: dict[tuple[int, bool, bool], list[ChangeEdge]] = {}
        for edge in edges:
            alike.setdefault((edge.target, edge.is_meanwhile, edge.is_bound), []).append(edge)
        for (target, is_meanwhile, is_bound), found in alike.items():
            sources = [edge.source for edge in found if edge.source != target]
            if len(sources) > 1 and len(sources) == len(self._groups) - 1:
                yield ChangeEdge(found[0].maker, ANY_OTHER, target, is_meanwhile, is_bound)
                yield from (edge for edge in found if edge.source == target)
            else:
                yield from found


def _closure(begun: Iterable[int], edges: Sequence[ChangeEdge]) -> tuple[int, ...]:
    """Return the groups that edges lead to from some groups, these included, in order."""
    reached, pending = dict.fromkeys(begun), list(begun)
    while pending:
        here = pending.pop()
        new = dict.fromkeys(edge.target for edge in edges if edge.source == here and edge.target not in reached)
        reached |= new
        pending += new
    return tuple(sorted(reached))
