"""The keys of a case file, and the case that they make."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec.structs import replace

from scbm.cases import (
    Case,
    CaseGoal,
    CaseLimits,
    EnvironmentChange,
    Expectations,
    Injection,
    Network,
    Origin,
    RecordedPlan,
)
from scbm.cases.coverage import Obligation, Obligations
from scbm.cases.injections import MAX_CHANGES
from scbm.files.codec.injection_keys import EnvironmentChangeKeys, InjectionKeys, InjectionsReader
from scbm.files.codec.key_types import (
    CASE_NAME_TYPE,
    COUNT,
    MAY_END,
    MAY_END_HELP,
    PREDICATE_SCHEMA,
    REQUIREMENTS,
    TIME,
    VALUE,
    MappingListType,
    MappingType,
    NamesType,
    ScalarOrListType,
    ScalarType,
    flow_list,
    is_short,
    names_type,
    node_of,
    predicate_data,
    predicate_type,
    verdict_type,
)
from scbm.files.codec.keys import Data, DefaultKey, Definitions, Key, Keys, KeyType, ShapeCheck, Spot
from scbm.files.codec.network_keys import NetworkKeys, network_owners, random_keys
from scbm.files.codec.outcome_keys import OutcomeKeys, RuleReader, RuleType, stretches_of
from scbm.files.codec.recorded_keys import RecordedGoalKeys, RecordedKeys
from scbm.files.codec.value_reader import ValueReader
from scbm.files.language.scope import NAME, Where
from scbm.files.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.predicates import TRUE, Predicate
from scbm.model.requirements import Requirement
from scbm.model.sources import outside_values
from scbm.model.values import format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.yaml.document import YamlNode
    from scbm.model.behavior import BehaviorModel
    from scbm.model.variables import State

_WORD = re.compile(rf"(?!true$|false$){NAME.pattern}", re.ASCII)
"""Texts that can only be the name of a goal: no predicate is a word, except two."""

MAX_GOALS = 1_000
"""The maximum number of goals of a case."""


# types


def _read_time_limit(reader: ValueReader, node: YamlNode, text: str) -> int | None:
    time_ns = TIME.read(node, reader)
    if time_ns == 0:
        reader.add(Slug.BAD_NUMBER, f"`{text}` is too short for a time limit", node.place, "write for example `10 min`")
    return time_ns


def _read_model_path(reader: ValueReader, node: YamlNode, text: str) -> str:
    if not text.strip():
        message = "expected the path of a model file, found nothing under `model`"
        reader.add(Slug.WRONG_SHAPE, message, node.place, "write for example `model: ../cell.yaml`")
    return text


def _read_final(reader: ValueReader, node: YamlNode) -> tuple[Predicate, ...]:
    if node.plain == []:
        return ()
    return tuple(reader.predicate(element, Where.REQUIREMENT) for element in node.elements or [node])


def _final_data(final: tuple[Predicate, ...]) -> object:
    written = [predicate_data(predicate) for predicate in final]
    return written[0] if len(written) == 1 else written


def _read_inputs(reader: ValueReader, node: YamlNode, text: str) -> bool:
    return reader.word(node, text, ("drawn",), "a way to move inputs") is not None


_NO_PLAN = ("unsolvable", "limit_reached", "no_plan_found")
"""The answers of a planner that are no plans."""


class RecordedPlanType(KeyType[tuple[RecordedPlan, ...]], frozen=True):
    """A list of answers: each is a list of operations, or the word for an answer that is no plan."""

    words = "list of answers"

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note anything but a list of lists and words."""
        if not isinstance(spot.node.plain, list):
            check.wrong_shape(spot, "a list of answers", "write for example `[[move, scan], unsolvable]`")
        for element in spot.elements():
            if isinstance(element.node.plain, list):
                for name in element.elements():
                    if not name.is_scalar:
                        check.wrong_shape(name, "the name of an operation")
            elif not element.is_scalar:
                check.wrong_shape(element, "a list of operations, or an answer such as `unsolvable`")

    def read(self, node: YamlNode, reader: ValueReader) -> tuple[RecordedPlan, ...]:
        """Return the answers; note unknown operations and words."""
        found = []
        for element in node.elements:
            if isinstance(element.plain, list):
                found.append(RecordedPlan("solved", reader.operations(element)))
            elif element.text is not None and element.plain is not None:
                word = reader.word(element, element.text, _NO_PLAN, "an answer of a planner")
                found.append(RecordedPlan(word or _NO_PLAN[0]))
        return tuple(found)

    def write(self, value: object) -> Data:
        """Return the answers as data."""
        answers: Any = value
        return [flow_list(each.plan) if each.status == "solved" else each.status for each in answers]

    def schema(self, definitions: Definitions) -> dict[str, Data]:  # noqa: ARG002 - refers to no definition
        """Return the JSON Schema."""
        operations = {"type": "array", "items": {"type": "string"}}
        return {"type": "array", "items": {"anyOf": [operations, {"enum": list(_NO_PLAN)}]}}


_FINAL = ScalarOrListType(
    "predicate, or list of them", "a predicate", PREDICATE_SCHEMA, "a predicate", _read_final, _final_data
)
_OPERATIONS = names_type("list of operations", ValueReader.operations, flow_list)
_OBLIGATIONS = names_type("list of obligations", node_of, lambda visits: flow_list(map(str, visits)))
_GOAL = ScalarOrListType(
    "goal or predicate",
    "the name of a goal, or a predicate",
    {"anyOf": [{"type": ["string", "boolean"]}, {"type": "array", "items": {"type": "string"}}]},
    "a predicate",
    node_of,
)


# sections


class LimitsKeys(Keys):
    """When the runner gives up; the limits are for each goal."""

    time = Key(
        replace(TIME, reader=_read_time_limit),
        "How long the runner may pursue a goal, and wait for the `when` of a goal.",
        absent="that of the command",
        source="time_ns",
    )
    plans = Key(COUNT, "How many plans the runner may ask for.", absent="that of the command")


class ExpectationsKeys(Keys):
    """What must be true of the run."""

    verdict = Key(verdict_type("a verdict"), "How the run ends.", absent="not checked")
    plan = Key(
        _OPERATIONS,
        "All operations of the first plan; `[]` is the empty plan.",
        absent="not checked",
        always_written=True,
    )
    order = DefaultKey(
        _OPERATIONS, "Operations that complete in this order; others may complete between them.", default=()
    )
    final = DefaultKey(
        _FINAL, "What holds at the end; the predicate may read variables of the runner.", default=(), shown=True
    )
    visits = Key(
        _OBLIGATIONS,
        "Obligations that the run visits: `<operation>/<state>`, `<operation>/queued`, `automatic/<transition>`.",
    )

    def expectations(self, model: BehaviorModel) -> Expectations:
        """Return the expectations; valid only if no error is noted."""
        visits = () if self.visits is None else self._visits(self.visits, model)
        return Expectations(self.verdict, self.plan, self.order, self.final, visits)

    def _visits(self, node: YamlNode, model: BehaviorModel) -> tuple[Obligation, ...]:
        known = {str(obligation): obligation for obligation in Obligations.of(model)}
        visits: dict[Obligation, None] = {}
        for element in node.elements:
            if element.text is None or element.plain is None:
                continue
            obligation = known.get(element.text)
            if obligation is None:
                remedy = suggestion(element.text, known, "the obligations are")
                message = f"the model has no obligation `{element.text}`"
                self.reader.add(Slug.UNKNOWN_OBLIGATION, message, element.place, remedy)
            elif obligation in visits:
                self.reader.add(Slug.DUPLICATE_VALUE, f"`{element.text}` is listed twice", element.place)
            else:
                visits[obligation] = None
        return tuple(visits)


class CaseGoalKeys(Keys):
    """One of several goals of a case."""

    goal = Key(_GOAL, "The name of a goal of the model, or a predicate over the world.", required=True)
    when: Key[Predicate] = Key(
        predicate_type(Where.GUARD),
        "The runner begins with this goal when the run before has ended and this holds.",
        absent="it begins as soon as the run before has ended",
    )
    may_end = DefaultKey(MAY_END, MAY_END_HELP, default=())
    expect = Key(MappingType(ExpectationsKeys), "What must be true of the run for this goal.")

    def case_goal(self, model: BehaviorModel) -> CaseGoal:
        """Return the goal; valid only if no error is noted."""
        name, predicate = read_goal(self.goal, self.reader, model)
        expect = Expectations() if self.expect is None else self.expect.expectations(model)
        return CaseGoal(name, predicate, self.when, expect, self.may_end)


def read_goal(node: YamlNode | None, reader: ValueReader, model: BehaviorModel) -> tuple[str, Predicate]:
    """Return the name and the predicate of a goal, by its name in the model or as a predicate; note unknown names."""
    text = None if node is None else node.text
    named = None if text is None else model.goal(text)
    if text is not None and named is not None:
        return text, named
    if node is not None and isinstance(node.plain, str) and _WORD.fullmatch(node.plain):
        known = [name for name, _ in model.goals]
        remedy = suggestion(node.plain, known, "its goals are") or "write a predicate, such as `robot_at == home`"
        reader.add(Slug.UNKNOWN_GOAL, f"the model has no goal `{node.plain}`", node.place, remedy)
        node = None
    predicate = reader.predicate(node, Where.WORLD)
    return str(predicate), predicate


class DrawnKeys(Keys):
    """The random streams that the case draws from."""

    in_flow = True

    seed = Key(
        ScalarType("whole number", "a whole number", {"type": "integer"}, ValueReader.whole_number),
        "The seed of the campaign.",
        required=True,
    )
    case = DefaultKey(COUNT, "The number of the case in the campaign.", default=1, source="number")
    inputs = DefaultKey(
        ScalarType("`drawn`", "`drawn`", {"const": "drawn"}, _read_inputs, lambda _: "drawn"),
        "Whether inputs and published values without environment transitions are drawn, too.",
        default=False,
        absent="not drawn",
        source="moves_inputs",
    )

    def origin(self) -> Origin:
        """Return the streams; valid only if no error is noted."""
        return Origin(self.seed or 0, self.case, self.inputs)


# the case


class GoalToWrite(NamedTuple):
    """One of several goals of a case to be written; attributes as in `CaseGoal`."""

    goal: object
    when: Predicate | None
    may_end: tuple[str, ...]
    expect: Expectations


class CaseToWrite(NamedTuple):
    """A case to be written.

    Attributes:
        case: the case.
        model: the model that it is for.
        model_path: where that is, relative to the directory of the file to be written.
    """

    case: Case
    model: BehaviorModel
    model_path: str | None

    @property
    def goal(self) -> object:
        """The only goal: its name, if the model has it, else the predicate; `None` if there is a list of goals."""
        return None if self._is_listed else self._goal_data(self.case.goal, self.case.predicate)

    @property
    def _is_listed(self) -> bool:
        """Whether the goals are a list: there are several, or the only one waits for its `when`."""
        return bool(self.case.later) or self.case.when is not None

    @property
    def goals(self) -> tuple[GoalToWrite, ...]:
        """The goals, if they are a list."""
        goals = self.case.goals if self._is_listed else ()
        return tuple(GoalToWrite(self._goal_data(g.name, g.predicate), g.when, g.may_end, g.expect) for g in goals)

    @property
    def may_end(self) -> tuple[str, ...]:
        """The ends that excuse the only goal."""
        return () if self._is_listed else self.case.may_end

    @property
    def expect(self) -> Expectations | None:
        """The expectations of the run for the only goal."""
        return None if self._is_listed else self.case.expect

    def _goal_data(self, name: str, predicate: Predicate) -> object:
        return name if self.model.goal(name) == predicate else predicate_data(predicate)

    @property
    def injections(self) -> tuple[Injection, ...]:
        """The injections, without names that the file need not say."""
        numbered = enumerate(self.case.injections, start=1)
        return tuple(replace(each, name="") if each.name == f"injection_{n}" else each for n, each in numbered)

    @property
    def initial(self) -> dict[str, Any]:
        """The variables that differ from the nominal state."""
        nominal = self.model.nominal_state
        return {name: value for name, value in self.case.initial.items() if value != nominal[name]}


class CaseKeys(Keys):
    """A test case."""

    case = Key(
        CASE_NAME_TYPE,
        "The name of the case: letters, digits, `_`, `-` and `.`; it begins with a letter or `_`.",
        required=True,
        source="case.name",
    )
    model = Key(
        ScalarType("path", "the path of a model file", {"type": "string"}, _read_model_path),
        "The model file, relative to the directory of the case file.",
        source="model_path",
    )
    goal = Key(
        _GOAL,
        "The name of a goal of the model, or a predicate over the world.",
        absent="required without `goals`",
        always_written=True,
    )
    goals = DefaultKey(
        MappingListType(CaseGoalKeys, "list of goals"),
        "One goal or several in order, in place of `goal`; 1000 at most. Each has its `when`, `may_end` and `expect`.",
        default=(),
    )
    may_end = DefaultKey(MAY_END, MAY_END_HELP, default=())
    initial = Key(
        NamesType(VALUE, "variable → value", is_short),
        "The variables whose initial values differ from the nominal state.",
    )
    outcomes = DefaultKey(
        NamesType(RuleType(), "name → rule"),
        "What happens to the requests of a resource, or to the requests sent while an operation is the current one.",
        default=(),
        source=lambda written: stretches_of(written.case.outcomes),
    )
    injections = DefaultKey(
        MappingListType(InjectionKeys, "list of injections"),
        "What the tester changes during the run; 1000 injections at most.",
        default=(),
    )
    environment = Key(
        MappingListType(EnvironmentChangeKeys, "list of changes"),
        "All changes from outside during the run, by the environment, inputs and published values; 100000 at most.",
        absent="drawn at the rates of the model with `drawn`, else nothing",
        source="case.environment",
        always_written=True,
    )
    network = Key(
        MappingType(NetworkKeys, "network"),
        "Faults of the network.",
        absent="no faults",
        source="case.network",
    )
    limits = Key(
        MappingType(LimitsKeys),
        "When the runner gives up.",
        absent="those of the command",
        source="case.limits",
    )
    planning = DefaultKey(
        TIME,
        "How long each plan takes; changes and replies can come in that time.",
        default=0,
        source="case.planning_ns",
    )
    requirements = DefaultKey(
        REQUIREMENTS,
        "Additional requirements of this case; their names differ from those of the model.",
        default=(),
        source=lambda written: {requirement.name: requirement.sentence for requirement in written.case.requirements},
    )
    expect = Key(
        MappingType(ExpectationsKeys, "expectations"),
        "What must be true of the run; not with `goals`.",
    )
    drawn = Key(
        MappingType(DrawnKeys),
        "The random streams for everything that the case leaves open.",
        source="case.origin",
    )
    plans: DefaultKey[tuple[RecordedPlan, ...]] = DefaultKey(
        RecordedPlanType(),
        "The answers of the planner, in the order in which the run asks; without them the planner is asked.",
        default=(),
        absent="the planner is asked",
        source="case.plans",
    )
    recorded = Key(
        MappingType(RecordedKeys), "The result of the run that the case was saved from.", source="case.recorded"
    )

    def case_for(self, model: BehaviorModel) -> Case:
        """Return the case, whose names are those of a model; valid only if no error is noted."""
        _ = self.model  # read for its own errors
        first, *later = self._goals(model)
        return Case(
            self.case or "",
            first.name,
            first.predicate,
            self._initial(model),
            RuleReader(self.reader).rules(self.outcomes),
            InjectionsReader(self.reader).injections(self.injections),
            self._network(),
            CaseLimits() if self.limits is None else CaseLimits(self.limits.time, self.limits.plans),
            tuple(self._requirements(model)),
            first.expect,
            None if self.drawn is None else self.drawn.origin(),
            None if self.recorded is None else self.recorded.recorded_run(),
            self.plans,
            self._environment(model),
            first.may_end,
            tuple(later),
            first.when,
            self.planning,
        )

    def _environment(self, model: BehaviorModel) -> tuple[EnvironmentChange, ...] | None:
        if self.environment is None:
            return None
        if len(self.environment) > MAX_CHANGES:
            message = f"{len(self.environment)} changes are too many: the most is {MAX_CHANGES}"
            self.reader.add(Slug.BAD_NUMBER, message, self.environment[MAX_CHANGES].node.place)
            return ()
        known = outside_values(model)
        return tuple(keys.change(model, known) for keys in self.environment)

    @classmethod
    def check(cls, spot: Spot, check: ShapeCheck) -> None:
        """Note also a case without a goal."""
        super().check(spot, check)
        if isinstance(spot.node.plain, dict) and not {"goal", "goals"} & spot.node.items.keys():
            check.missing_key("goal", spot, list(cls.declared))

    @classmethod
    def schema(cls, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema; a case has `goal` or `goals`."""
        return {**super().schema(definitions), "oneOf": [{"required": ["goal"]}, {"required": ["goals"]}]}

    def _goals(self, model: BehaviorModel) -> tuple[CaseGoal, ...]:
        """Return the goals in order, at least one; valid only if no error is noted."""
        several = tuple(keys.case_goal(model) for keys in self.goals[:MAX_GOALS])
        if not self.has("goals"):
            name, predicate = read_goal(self.goal, self.reader, model)
            expect = Expectations() if self.expect is None else self.expect.expectations(model)
            return (CaseGoal(name, predicate, None, expect, self.may_end),)
        add, place = self.reader.add, self.place("goals")
        if self.node.items["goals"].plain == []:
            add(Slug.WRONG_SHAPE, "`goals` is empty, and a case has a goal", place, "write for example `goal: done`")
        if len(self.goals) > MAX_GOALS:
            message = f"{len(self.goals)} goals are too many: the most is {MAX_GOALS}"
            add(Slug.BAD_NUMBER, message, self.goals[MAX_GOALS].node.place)
        for key in ("goal", "may_end", "expect"):
            if self.has(key):
                message = f"a case with `goals` has no `{key}` of its own"
                add(Slug.CONTRADICTION, message, self.place(key), f"write `{key}` in the elements of `goals`")
        return several or (CaseGoal(str(TRUE), TRUE),)

    def _initial(self, model: BehaviorModel) -> State:
        values = {}
        for variable, value, entry in self.reader.assignments(self.initial):
            if variable.role.is_runner:
                message = f"`{variable.name}` is a variable of the runner; initial states have none"
                self.reader.add(Slug.RUNNER_VARIABLE, message, entry.place)
            else:
                values[variable.name] = value
        state = model.nominal_state.replace(values)
        allowed = model.initial_states
        if len(values) == len(self.initial or ()) and not allowed.holds(state):
            key = "initial" if self.has("initial") else "case"
            place = self.node.key_places.get(key, self.node.place)
            read = dict.fromkeys(allowed.reads())
            here = ", ".join(f"{name} is {format_value(state[name])}" for name in read)
            message = f"the initial state does not satisfy `initial_states`: {allowed}"
            self.reader.add(Slug.INITIAL_STATE_NOT_ALLOWED, message, place, f"here {here}" if here else None)
        return state

    def _network(self) -> Network:
        if self.network is None:
            return Network()
        network = self.network.network()
        if nearest("drawn", self.node.items) is None:  # a misspelt one has an error of its own
            for key in random_keys(network):
                message = f"`{key}` is random, and the case has no `drawn` to draw it from"
                place = self.network.place(key)
                self.reader.add(Slug.NOTHING_DRAWN, message, place, "add `drawn: {seed: 1}` to the case")
        return network

    def _requirements(self, model: BehaviorModel) -> Iterator[Requirement]:
        known = {requirement.name for requirement in model.requirements}
        for entry in self.requirements:
            if not NAME.fullmatch(entry.name):
                self.reader.check_name(entry.name, entry.place)
            elif entry.name in known:
                message = f"the model has a requirement `{entry.name}` already"
                self.reader.add(Slug.DUPLICATE_NAME, message, entry.place, "choose another name")
            if entry.value is not None:
                yield Requirement(entry.name, entry.value)


def case_owners() -> tuple[tuple[type[Keys], str], ...]:
    """Return what messages call the mappings of a case file; an unknown key belongs to the first that declares it."""
    return (
        (OutcomeKeys, "an outcome"),
        (InjectionKeys, "an injection"),
        (EnvironmentChangeKeys, "a change of the environment"),
        *network_owners(),
        (NetworkKeys, "the network"),
        (LimitsKeys, "the limits"),
        (ExpectationsKeys, "what the case expects"),
        (DrawnKeys, "`drawn`"),
        (CaseKeys, "the case"),
        (CaseGoalKeys, "a goal of the case"),
        (RecordedKeys, "`recorded`"),
        (RecordedGoalKeys, "a goal of `recorded`"),
    )
