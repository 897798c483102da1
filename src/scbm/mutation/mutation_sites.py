"""The sites of a model: the values that mutation operators change, such as a guard, a deadline or a whole entry."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias, TypeVar

from msgspec import Struct, structs

from scbm.cases.coverage import Obligations
from scbm.model import format_duration, format_value
from scbm.mutation.expression_edits import replaced
from scbm.mutation.mutants import WHOLE_ENTRIES, Mutant, MutatedPart, SubjectKind
from scbm.mutation.named_operations import operations_named_elsewhere

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.model import Action, BehaviorModel, EnvironmentTransition, Operation, Predicate, Transition, Value
    from scbm.model.variables import Variable

    Actions: TypeAlias = tuple[Action, ...]
    _Put: TypeAlias = Callable[..., BehaviorModel]
    """Returns the model with other entries in the place of one, or with a part that has another value."""

T = TypeVar("T")

_KINDS = {
    "operations": SubjectKind.OPERATION,
    "automatic_transitions": SubjectKind.AUTOMATIC,
    "environment": SubjectKind.ENVIRONMENT,
    "variables": SubjectKind.VARIABLE,
    "resources": SubjectKind.RESOURCE,
}
"""The kinds of entries, by the sections of a model file that have them."""


class Edit(NamedTuple, Generic[T]):
    """A change of the value of a site.

    Attributes:
        label: what changes, for the name of the mutant, such as `drop:robot_at == box_a`.
        value: the other value.
        words: what changes, for reports; empty if that is `label` with a blank for its first colon.
    """

    label: str
    value: T
    words: str = ""


class Site(Struct, Generic[T], frozen=True):
    """A value in a model that a mutation operator changes.

    Attributes:
        parts: the parts of the entry that change with the value; the names of mutants have the first one.
        path: the keys that lead to the value in the model file: the section, the entry, and more for a part of it.
        value: the value.
        put: returns the model with another value at this site.
        line: returns a value as it is written in a model file, in one line; empty for `None`.
    """

    parts: tuple[MutatedPart, ...]
    path: tuple[str, ...]
    value: T
    put: Callable[[T], BehaviorModel]
    line: Callable[[T], str]

    @property
    def kind(self) -> SubjectKind:
        """The kind of the entry that has the value."""
        return _KINDS[self.path[0]]

    @property
    def subject(self) -> str:
        """The name of the entry that has the value."""
        return self.path[1]

    def mutant(self, operator: str, edit: Edit[T]) -> Mutant:
        """Return the mutant that the operator with this name makes by an edit."""
        owner = self.subject if self.kind is SubjectKind.OPERATION else f"{self.kind}/{self.subject}"
        part = "" if self.parts[0] in WHOLE_ENTRIES else f"{self.parts[0]}/"
        return Mutant(
            name=f"{owner}/{part}{edit.label}",
            operator=operator,
            kind=self.kind,
            subject=self.subject,
            parts=self.parts,
            path=self.path,
            before=self.line(self.value),
            after=self.line(edit.value),
            change=edit.words or edit.label.replace(":", " ", 1),
            model=self.put(edit.value),
        )


class _TransitionSites(NamedTuple):
    """The sites of one running transition: `pre`, `post` or `failed` of an operation, or an automatic transition.

    Attributes:
        path: the keys that lead to the transition in the model file.
        transition: the transition.
        put: returns the model with another transition in its place.
    """

    path: tuple[str, ...]
    transition: Transition
    put: _Put

    @property
    def key(self) -> str:
        """`pre`, `post` or `failed`; empty for an automatic transition."""
        return "".join(self.path[2:])

    def fields(self, *keys: str) -> Iterator[Site[Any]]:
        """Yield the guards or lists of actions with these keys, such as `g` and `gr`."""
        for key in keys:
            part = MutatedPart(".".join((*self.path[2:], key)))
            value = getattr(self.transition, key)
            yield _site(part, (*self.path, key), value, partial(_changed, self.put, self.transition, key))

    def pair(self, source: Site[T], target: Site[T]) -> Site[tuple[T, T]]:
        """Return the site of two of these fields, which change together."""

        def put(values: tuple[T, T]) -> BehaviorModel:
            changed: dict[str, Any] = {source.path[-1]: values[0], target.path[-1]: values[1]}
            return self.put(structs.replace(self.transition, **changed))

        def line(values: tuple[T, T]) -> str:
            return f"{source.line(values[0])}; {target.line(values[1])}"

        return Site((*source.parts, *target.parts), source.path, (source.value, target.value), put, line)


def _site(
    part: MutatedPart,
    path: tuple[str, ...],
    value: T,
    put: Callable[[T], BehaviorModel],
    text: Callable[[Any], str] | None = None,
) -> Site[T]:
    """Return the site of a part of an entry; `text` returns a value that is no guard or list as a file has it."""
    return Site((part,), path, value, put, partial(_line, part, text or _written))


def _line(name: str, text: Callable[[T], str], value: T | None) -> str:
    return "" if value is None else f"{name}: {text(value)}"


def _written(value: object) -> str:
    return f"[{', '.join(map(str, value))}]" if isinstance(value, tuple) else str(value)


def _body(transition: Transition) -> str:
    return " / ".join(map(_written, (transition.g, transition.gr, transition.a, transition.ar)))


def _changed(put: _Put, entry: Struct, key: str, value: object) -> BehaviorModel:
    """Return the model with another value of one field of an entry, which `put` puts there."""
    fields: dict[str, Any] = {key: value}
    return put(structs.replace(entry, **fields))


def _entries(model: BehaviorModel, section: str) -> Iterator[tuple[Any, _Put]]:
    """Yield each entry of a section, and a function that returns the model with others in its place."""
    listed = getattr(model, section)
    for index, entry in enumerate(listed):
        yield entry, partial(_with_entries, model, section, listed, index)


def _with_entries(model: BehaviorModel, section: str, listed: tuple[T, ...], index: int, *others: T) -> BehaviorModel:
    sections: dict[str, Any] = {section: replaced(listed, index, *others)}
    return structs.replace(model, **sections)


def _transitions(model: BehaviorModel) -> Iterator[_TransitionSites]:
    """Yield the transitions of all operations, then the automatic transitions."""
    for operation, put in _entries(model, "operations"):
        for key in ("pre", "post", "failed"):
            if (transition := getattr(operation, key)) is not None:
                path = ("operations", operation.name, key)
                yield _TransitionSites(path, transition, partial(_changed, put, operation, key))
    for transition, put in _entries(model, "automatic_transitions"):
        yield _TransitionSites(("automatic_transitions", transition.name), transition, put)


def guards(model: BehaviorModel) -> Iterator[Site[Predicate]]:
    """Yield the guards `g` and `gr` of all operations, then of all automatic transitions."""
    for each in _transitions(model):
        yield from each.fields("g", "gr")


def moves(model: BehaviorModel, *keys: str) -> Iterator[Site[tuple[Any, Any]]]:
    """Yield both pairs of the guards or actions with two keys, such as `g` and `gr`, where the planner reads them."""
    for each in _transitions(model):
        if each.key in ("pre", "post"):
            one, other = each.fields(*keys)
            yield each.pair(one, other)
            yield each.pair(other, one)


def planned_actions(model: BehaviorModel) -> Iterator[Site[Actions]]:
    """Yield the actions of the pre- and postconditions of all operations."""
    yield from _actions(model, "pre", "post")


def clean_up(model: BehaviorModel) -> Iterator[Site[Actions]]:
    """Yield the actions of `failed` and `timedout` of all operations, then of all automatic transitions."""
    places = {operation.name: place for place, operation in enumerate(model.operations)}
    yield from sorted((*_actions(model, "failed"), *_timedout(model)), key=lambda site: places[site.subject])
    yield from _actions(model, "")


def all_actions(model: BehaviorModel) -> Iterator[Site[Actions]]:
    """Yield the actions of all operations and automatic transitions."""
    yield from planned_actions(model)
    yield from clean_up(model)


def operation_actions(model: BehaviorModel) -> Iterator[Site[Actions]]:
    """Yield the actions of the transitions of all operations, then their `timedout` actions."""
    yield from _actions(model, "pre", "post", "failed")
    yield from _timedout(model)


def _actions(model: BehaviorModel, *keys: str) -> Iterator[Site[Actions]]:
    for each in _transitions(model):
        if each.key in keys:
            yield from each.fields("a", "ar")


def _timedout(model: BehaviorModel) -> Iterator[Site[Actions]]:
    for operation, put in _entries(model, "operations"):
        path = ("operations", operation.name, "timedout")
        yield _site(MutatedPart.TIMEDOUT, path, operation.timedout, partial(_changed, put, operation, "timedout"))


def environment(model: BehaviorModel, key: str) -> Iterator[Site[Any]]:
    """Yield the `guard` or the `actions` of all environment transitions."""
    for entry, put in _entries(model, "environment"):
        path = ("environment", entry.name, key)
        yield _site(MutatedPart(key), path, getattr(entry, key), partial(_changed, put, entry, key))


def deadlines(model: BehaviorModel) -> Iterator[Site[int | None]]:
    """Yield the `deadline` and the `disabled_deadline` of each operation that has them, in nanoseconds."""
    for operation, put in _entries(model, "operations"):
        for part in (MutatedPart.DEADLINE, MutatedPart.DISABLED_DEADLINE):
            if (value := getattr(operation, f"{part}_ns")) is not None:
                path = ("operations", operation.name, part)
                yield _site(part, path, value, partial(_with_deadline, put, operation, part), format_duration)


def _with_deadline(put: _Put, operation: Operation, part: MutatedPart, value: int | None) -> BehaviorModel:
    if value is None and part is MutatedPart.DEADLINE:
        operation = structs.replace(operation, timedout=())
    return _changed(put, operation, f"{part}_ns", value)


def droppable_deadlines(model: BehaviorModel) -> Iterator[Site[int | None]]:
    """Yield the same deadlines; the `timedout` actions of an operation go with its `deadline`."""
    for site in deadlines(model):
        goes = site.parts == (MutatedPart.DEADLINE,) and model.operation(site.subject).timedout
        yield structs.replace(site, parts=(*site.parts, MutatedPart.TIMEDOUT)) if goes else site


def initial_values(model: BehaviorModel) -> Iterator[Site[Value]]:
    """Yield the nominal initial values of all variables; a variable that is never drawn keeps that."""
    for variable, put in _entries(model, "variables"):
        path = ("variables", variable.name, "initial")
        yield _site(MutatedPart.INITIAL, path, variable.initial, partial(_with_initial, put, variable), format_value)


def _with_initial(put: _Put, variable: Variable, value: Value) -> BehaviorModel:
    random = (value,) if variable.random == (variable.initial,) else variable.random
    return put(structs.replace(variable, initial=value, random=random))


def requests(model: BehaviorModel) -> Iterator[Site[tuple[str, ...]]]:
    """Yield the variables that the requests to each resource carry; a mutant has no binding for the resource."""
    for resource, put in _entries(model, "resources"):
        path = ("resources", resource.name, "request")
        unbound = structs.replace(resource, binding=None)
        yield _site(MutatedPart.REQUEST, path, resource.request, partial(_changed, put, unbound, "request"))


def droppable_transitions(model: BehaviorModel) -> Iterator[Site[Transition | None]]:
    """Yield the `failed` transitions of all operations, then the automatic transitions."""
    for each in _transitions(model):
        if each.key == "failed":
            yield Site((MutatedPart.FAILED,), each.path, each.transition, each.put, partial(_line, "failed", _body))
    yield from _droppable(model, "automatic_transitions", _body)


def droppable_operations(model: BehaviorModel) -> Iterator[Site[Operation | None]]:
    """Yield the operations that nothing else in the model names, unless there is only one operation."""
    kept = operations_named_elsewhere(model)
    for site in _droppable(model, "operations", lambda each: f"pre {_body(each.pre)}; post {_body(each.post)}"):
        if site.subject not in kept and len(model.operations) > 1:
            yield site


def droppable_environment(model: BehaviorModel) -> Iterator[Site[EnvironmentTransition | None]]:
    """Yield the environment transitions."""
    return _droppable(model, "environment", lambda each: f"{each.guard} / {_written(each.actions)}")


def _droppable(model: BehaviorModel, section: str, text: Callable[[Any], str]) -> Iterator[Site[Any]]:
    for entry, put in _entries(model, section):
        put_or_drop = partial(_without_waivers, put)
        yield Site((MutatedPart(section),), (section, entry.name), entry, put_or_drop, partial(_line, entry.name, text))


def _without_waivers(put: _Put, entry: object) -> BehaviorModel:
    """Return the model without an entry, or with another one, and without waivers for obligations that it lacks."""
    model = put() if entry is None else put(entry)
    if not model.waivers:
        return model
    known = [str(obligation) for obligation in Obligations.of(model)]
    return structs.replace(model, waivers=tuple(waiver for waiver in model.waivers if waiver.obligation in known))


def neighbours(model: BehaviorModel, section: str) -> Iterator[Site[tuple[Any, Any]]]:
    """Yield the pairs of neighbours of a section; the order of operations decides between plans of equal length."""
    listed = getattr(model, section)
    for index, pair in enumerate(pairwise(listed)):
        put = partial(_with_pair, model, section, replaced(listed, index + 1), index)
        yield Site((MutatedPart(section),), (section, pair[0].name), pair, put, partial(_line, section, _names))


def _with_pair(
    model: BehaviorModel, section: str, listed: tuple[T, ...], index: int, pair: tuple[T, T]
) -> BehaviorModel:
    return _with_entries(model, section, listed, index, *pair)


def _names(entries: tuple[Any, ...]) -> str:
    return ", ".join(each.name for each in entries)
