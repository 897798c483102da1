"""The keys of operations and of transitions in a model file, those of the environment included."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files.codec.key_types import (
    ACTIONS,
    DURATION,
    MODEL_NAME,
    MappingType,
    predicate_type,
)
from scbm.files.codec.keys import DefaultKey, Key, Keys
from scbm.files.codec.lifted.handshake_keys import HandshakeKeys
from scbm.files.codec.lifted.object_keys import where_key
from scbm.files.codec.resource_keys import LATENCY
from scbm.files.expansion.expanded_nodes import PlacedScalar
from scbm.files.language.scope import Where
from scbm.files.spelling import nearest
from scbm.model import Slug
from scbm.model.behavior import EnvironmentTransition, Rate, RateKind
from scbm.model.operations import MAX_SUM_CASES, Operation, Transition, count_sum_cases
from scbm.model.predicates import TRUE, Predicate

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.files.codec.keys import Data, Definitions, ShapeCheck, Spot
    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.operations import Action
    from scbm.model.resources import Latency

_GUARD = predicate_type(Where.GUARD)


def read_actions(
    reader: ValueReader, lists: tuple[tuple[YamlNode | None, Where], ...]
) -> tuple[tuple[Action, ...], ...]:
    """Return the actions of one transition, list by list; note two assignments to one variable."""
    read: list[tuple[Action, ...]] = []
    assigned: dict[str, tuple[Action, YamlNode]] = {}
    for node, where in lists:
        actions: list[Action] = []
        for element in node.elements if node is not None else ():
            if element.scalar is None or element.plain is None:
                continue
            action = reader.resolver(element.scalar, where).read_action(element.scalar.syntax or element.scalar.text)
            if action is None:
                reader.is_whole = False
                continue
            target = reader.alias(action.target)
            if target in assigned:
                message = f"`{action.target}` is assigned twice; the actions of a transition happen at once"
                reader.add(Slug.ASSIGNED_TWICE, message, element.place, _other_remedy(reader, *assigned[target]))
            assigned.setdefault(target, (action, element))
            actions.append(action)
        read.append(tuple(actions))
    calculating = [element for action, element in assigned.values() if len(action.reads()) > 1]
    if calculating:
        _refuse_many_cases(reader, [action for actions in read for action in actions], calculating[-1].place)
    return tuple(read)


def _count_cases(reader: ValueReader, actions: Sequence[Action]) -> int:
    variables = reader.scope.variables
    read = dict.fromkeys(name for action in actions for name in action.reads())
    sizes = {name: len(v.domain) for name in read if (v := variables[name]) is not None}
    return count_sum_cases(actions, sizes)


def _refuse_many_cases(reader: ValueReader, actions: Sequence[Action], place: Place) -> None:
    """Note sums of too many cases in actions that are taken in one step."""
    count = _count_cases(reader, actions)
    if count > MAX_SUM_CASES:
        message = f"the sums of these actions have {count:,} cases together, and {MAX_SUM_CASES:,} are the most"
        reader.add(Slug.DOMAIN_TOO_LARGE, message, place, "use smaller domains, or assign fewer sums in one step")


def _other_remedy(reader: ValueReader, other: Action, element: YamlNode) -> str:
    """Return the remedy that names the other assignment as written, or the key that generates it."""
    if isinstance(element.scalar, PlacedScalar):
        return f"the other is `{other}`, which `request` stands for"
    written = reader.report.underlined(element.place).strip("\"' ")
    return f"the other is `{written if '<-' in written else other}`"


def _transition(key: str, default_name: str) -> Callable[[Operation], Transition | None]:
    """Return the source of a transition of an operation; it has no name if the file need not say it."""

    def source(operation: Operation) -> Transition | None:
        transition: Transition | None = getattr(operation, key)
        is_default = transition is not None and transition.name == f"{default_name}_{operation.name}"
        return replace(transition, name="") if transition is not None and is_default else transition

    return source


class GuardedActionKeys(Keys):
    """The guards and actions of a running transition: `g / gr / a / ar`."""

    g: Key[Predicate] = Key(_GUARD, "The guard that planner and runner evaluate.", required=True)
    gr: DefaultKey[Predicate] = DefaultKey(
        _GUARD, "An additional guard that only the runner evaluates.", default=TRUE, always_written=True
    )
    a = Key(ACTIONS, "The actions that planner and runner apply.", always_written=True, absent="`[]`")
    ar = Key(ACTIONS, "Additional actions that only the runner applies.", always_written=True, absent="`[]`")

    def transition(self, name: str, a_where: Where, ar_where: Where) -> Transition:
        """Return the transition; its actions stand at these two sorts of places."""
        g, gr = self.g or TRUE, self.gr
        a, ar = read_actions(self.reader, ((self.a, a_where), (self.ar, ar_where)))
        return Transition(name, g, gr, a, ar)


class AutomaticKeys(GuardedActionKeys):
    """A running transition `g / gr / a / ar` whose name is its key. It has at least one action."""

    where = where_key()

    def automatic(self, name: str, place: Place) -> Transition:
        """Return an automatic transition; note one without actions at `place`."""
        written = [part for key in ("a", "ar") if (part := self.node.get(key)) is not None and part.plain != []]
        if self.node.items and not written and not self.node.incomplete:
            message = f"`{name}` has no actions, so it could never be taken"
            self.reader.add(Slug.AUTOMATIC_DOES_NOTHING, message, place, "add `a: [...]`")
        return self.transition(name, Where.AUTOMATIC, Where.AUTOMATIC)


class TransitionKeys(GuardedActionKeys):
    """A running transition `g / gr / a / ar`."""

    name = Key(
        MODEL_NAME,
        "What reports and traces call the transition.",
        absent="`start_<operation>`, `complete_<operation>`, `fail_<operation>`",
        source=lambda transition: transition.name or None,
    )

    @classmethod
    def schema(cls, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema, which leaves it to the operation whether `g` is required: not beside a request."""
        return {name: part for name, part in super().schema(definitions).items() if name != "required"}


def _time_of(kind: RateKind) -> Callable[[EnvironmentTransition], Latency | None]:
    """Return the source of the time of a rate; other rates have none of this kind."""
    return lambda each: each.rate.time if each.rate is not None and each.rate.kind is kind else None


class EnvironmentKeys(Keys):
    """A change that something outside the model and its resources makes. Planners ignore it; it is no obligation."""

    guard: Key[Predicate] = Key(
        predicate_type(Where.ENVIRONMENT), "Where it can happen; it reads no variable of the runner.", required=True
    )
    actions = Key(ACTIONS, "What changes, all at once; declared variables only.", required=True)
    where = where_key()
    every = Key(
        LATENCY,
        "For simulation: the time from the beginning of a run, and then again each time that it has passed.",
        absent="it never happens in a simulation",
        source=_time_of(RateKind.EVERY),
    )
    after = Key(
        LATENCY,
        "For simulation: the time from when the guard became true; it restarts when the guard turns false.",
        absent="it never happens in a simulation",
        source=_time_of(RateKind.AFTER),
    )

    def environment(self, name: str) -> EnvironmentTransition:
        """Return the transition; valid only if no error is noted."""
        (actions,) = read_actions(self.reader, ((self.actions, Where.ENVIRONMENT),))
        if self.actions is not None and self.actions.plain == []:
            message = f"`{name}` has no actions, so it could never change anything"
            self.reader.add(Slug.WRONG_SHAPE, message, self.place("actions"), "write for example `[door <- open]`")
        return EnvironmentTransition(name, self.guard or TRUE, actions, self._rate())

    def _rate(self) -> Rate | None:
        every, after = self.every, self.after
        if every is not None and after is not None:
            message = "a rate is `every` or `after`, and this transition has both"
            self.reader.add(Slug.CONTRADICTION, message, self.place("after"), "keep one of them")
        kind = RateKind.EVERY if after is None else RateKind.AFTER
        given = every if after is None else after
        if given is None:
            return None
        time = given.distribution()
        if time is None or time.points_ns[-1] > 0:
            return None if time is None else Rate(kind, time, self.place(kind.value))
        message = f"`{kind.value}` needs a time above 0 s, or time would stand still"
        remedy = f"write for example `{kind.value}: {{exponential: 2 min}}`"
        self.reader.add(Slug.BAD_LATENCY, message, self.place(kind.value), remedy)
        return None


class OperationKeys(HandshakeKeys):
    """A task that takes time. It has `pre` and `post`, or a `request`, which stands for both."""

    deadline = Key(
        DURATION,
        "How long the operation may execute before it times out.",
        absent="no deadline",
        source="deadline_ns",
    )
    pre = Key(
        MappingType(TransitionKeys, "transition"),
        "The transition that starts the operation.",
        absent="required without `request`",
        source=_transition("pre", "start"),
    )
    post = Key(
        MappingType(TransitionKeys, "transition"),
        "The transition that completes the operation.",
        absent="required without `request`",
        source=_transition("post", "complete"),
    )
    failed = Key(
        MappingType(TransitionKeys, "transition"),
        "A transition that makes the executing operation fail.",
        source=_transition("failed", "fail"),
    )
    timedout = Key(
        ACTIONS,
        "The actions that the runner applies when the deadline passes; they need a `deadline`.",
        absent="`[]`",
    )
    disabled_deadline = Key(
        DURATION,
        "How long the operation may be disabled before the runner asks for a new plan.",
        absent="no deadline",
        source="disabled_deadline_ns",
    )
    where = where_key()

    @classmethod
    def check(cls, spot: Spot, check: ShapeCheck) -> None:
        """Check the keys; `pre` and `post` are required where nothing stands for them."""
        super().check(spot, check)
        node = spot.node
        if isinstance(node.plain, dict) and HandshakeKeys.declared.keys().isdisjoint(node.items):
            for key in ("pre", "post"):
                if key not in node.items:
                    check.missing_key(key, spot, list(cls.declared))

    @classmethod
    def schema(cls, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema, in which an operation has a request, or both transitions with their guards."""
        schema = super().schema(definitions)
        guarded = {"required": ["g"]}
        whole = {"required": ["pre", "post"], "properties": {"pre": guarded, "post": guarded}}
        schema["properties"]["failed"] |= guarded
        return {**schema, "anyOf": [{"required": ["request"]}, whole]}

    def operation(self, name: str) -> Operation | None:
        """Return the operation; `None` if it lacks a pre- or postcondition."""
        pre = self._transition(self.pre, f"start_{name}", Where.PLANNED)
        post = self._transition(self.post, f"complete_{name}", Where.PLANNED)
        failed = self._transition(self.failed, f"fail_{name}", Where.RUNNING)
        actions = read_actions(self.reader, ((self.timedout, Where.RUNNING),))[0]
        deadline_ns, disabled_deadline_ns = self.deadline, self.disabled_deadline
        if self.timedout is not None and self.timedout.elements and nearest("deadline", self.node.items) is None:
            message = f"`{name}` has no deadline, so it never times out"
            key = "on_timeout" if self.has("on_timeout") else "timedout"
            remedy = f"add `deadline: 10 s`, or leave out `{key}`"
            self.reader.add(Slug.MISSING_KEY, message, self.place(key), remedy)
        if pre is None or post is None:
            return None
        if all(_count_cases(self.reader, half.running_actions) <= MAX_SUM_CASES for half in (pre, post)):
            _refuse_many_cases(self.reader, (*pre.a, *post.a), self.place("post"))
        return Operation(name, pre, post, deadline_ns, failed, actions, disabled_deadline_ns)

    def _transition(self, keys: TransitionKeys | None, name: str, a_where: Where) -> Transition | None:
        return None if keys is None else keys.transition(keys.name or name, a_where, Where.RUNNING)
