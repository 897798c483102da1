"""The keys of a model file, and the model that they make."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from msgspec.structs import replace

from scbm.files.codec.key_types import (
    COUNT,
    INTERFACES,
    MAY_END,
    MAY_END_HELP,
    MODEL_NAME,
    MappingType,
    NamesType,
    ScalarOrMappingType,
    ScalarType,
    names_type,
    predicate_type,
)
from scbm.files.codec.keys import Data, DefaultKey, Definitions, Key, Keys, KeyType, ShapeCheck, Spot
from scbm.files.codec.lifted.object_keys import LIFTED_REQUIREMENTS, tables_key, types_key, where_key
from scbm.files.codec.lifted.part_keys import INCLUDE, PARTS, PartUseKeys
from scbm.files.codec.operation_keys import AutomaticKeys, EnvironmentKeys, OperationKeys, TransitionKeys
from scbm.files.codec.resource_keys import ResourceKeys, SimulationKeys
from scbm.files.codec.variable_keys import VariableKeys
from scbm.files.codec.waiver_keys import TEXT, WAIVER_LIST, WaiverKeys, waivers_of
from scbm.files.expansion.handshakes import misses_requests
from scbm.files.language.scope import NAME, Scope, Where
from scbm.files.spelling import suggestion
from scbm.model import Place, Slug
from scbm.model.behavior import (
    FIRST_PLANNER,
    BehaviorModel,
    GoalOrder,
    LiftedOrigin,
    PlannerChoice,
    RunPlans,
    RunsDeclaration,
)
from scbm.model.lazy_exports import load_named
from scbm.model.predicates import TRUE, Predicate
from scbm.model.requirements import BUILT_IN_NAMES, OPTIONAL_NAMES, Requirement
from scbm.model.variables import Variable, VariableSource, resource_variables, runner_variables

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode

T = TypeVar("T")

_WORLD = predicate_type(Where.WORLD)
_DECLARING: dict[str, type[Keys]] = {"variables": VariableKeys, "resources": ResourceKeys, "operations": OperationKeys}
"""The sections whose keys are names that expressions use."""

_LIFTED = ("operations", "automatic_transitions", "goals", "requirements")
"""The sections whose expanded entries know where they come from: those that reports name."""


def _read_planner(reader: ValueReader, node: YamlNode, text: str) -> str | None:
    """Return the name of a planner; note a name that the registry does not have."""
    from scbm.planning import PLANNERS  # noqa: PLC0415 - the engines, which few models need to be loaded

    if text in PLANNERS:
        return text
    remedy = suggestion(text, PLANNERS, "the planners are")
    reader.add(Slug.UNKNOWN_PLANNER, f"there is no planner `{text}`", node.place, remedy)
    return None


_PLANNER_NAME = ScalarType("planner", "the name of a planner", {"type": "string"}, _read_planner)


class PlannerKeys(Keys):
    """The planner of the runs of a model, and the limits of its searches."""

    in_flow = True

    name = Key(_PLANNER_NAME, "The name of the planner.", absent="`canonical`")
    max_length = Key(COUNT, "The maximum number of operations of a plan.", absent="1000")
    max_expanded = Key(
        COUNT,
        "The maximum number of states that a search expands; not for planners that are other programs.",
        absent="1000000",
    )

    def choice(self) -> PlannerChoice:
        """Return the planner with its limits; valid only if no error is noted."""
        if not isinstance(self.node.plain, dict):
            return PlannerChoice(_PLANNER_NAME.read(self.node, self.reader))
        choice = PlannerChoice(self.name, self.max_length, self.max_expanded)
        if choice.name is not None and choice.max_expanded is not None:
            self._refuse_uncounted(choice.name)
        return choice

    def _refuse_uncounted(self, name: str) -> None:
        """Note a limit of expanded states for another program, which would ignore the limit."""
        from scbm.planning import PLANNERS  # noqa: PLC0415 - as above

        if PLANNERS[name].is_external:
            message = f"the planner `{name}` is another program and takes no limit of expanded states"
            self.reader.add(Slug.CONTRADICTION, message, self.place("max_expanded"), "leave out `max_expanded`")


def _planner_data(choice: PlannerChoice) -> object:
    has_limits = choice.max_length is not None or choice.max_expanded is not None
    return choice.name if choice.name is not None and not has_limits else PlannerKeys.write(choice)


_PLANNER = ScalarOrMappingType(
    PlannerKeys,
    "planner",
    "a planner such as `greedy`, or `{name: greedy, max_length: 500}`",
    {"type": "string"},
    _planner_data,
)


class ModelGoal(NamedTuple):
    """A goal of a model: its predicate, and the ends that excuse missing it."""

    goal: Predicate | None
    may_end: tuple[str, ...] = ()


class GoalKeys(Keys):
    """A goal with more than its predicate."""

    in_flow = True

    goal: Key[Predicate] = Key(_WORLD, "The predicate.", required=True)
    may_end = DefaultKey(MAY_END, MAY_END_HELP, default=())
    where = where_key()


class GoalType(KeyType[ModelGoal], frozen=True):
    """A goal: a predicate, or a mapping."""

    words = "predicate, or goal"

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note what is wrong in a mapping, or anything but a predicate."""
        if isinstance(spot.node.plain, dict):
            GoalKeys.check(spot, check)
        else:
            _WORLD.check(spot, check)

    def read(self, node: YamlNode, reader: ValueReader) -> ModelGoal:
        """Return the goal; its predicate is `None` if that is wrong."""
        if isinstance(node.plain, dict):
            keys = GoalKeys(node, reader)
            return ModelGoal(keys.goal, keys.may_end)
        predicate: Predicate | None = _WORLD.read(node, reader)
        return ModelGoal(predicate)

    def write(self, value: object) -> Data:
        """Return the predicate, or the mapping if it has more."""
        goal: Any = value
        return GoalKeys.write(goal) if goal.may_end else _WORLD.write(goal.goal)

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema."""
        return {"anyOf": [_WORLD.schema(definitions), definitions.reference(GoalKeys)]}

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mapping."""
        return (GoalKeys,)


_GOAL_ORDERS = tuple(order.value for order in GoalOrder)


def _read_goal_order(reader: ValueReader, node: YamlNode, text: str) -> GoalOrder | None:
    word = reader.word(node, text, _GOAL_ORDERS, "an order of goals")
    return None if word is None else GoalOrder(word)


_RUN_PLANS = tuple(plans.value for plans in RunPlans)


def _read_plans(reader: ValueReader, node: YamlNode, text: str) -> RunPlans | None:
    former = {"shortest": RunPlans.DRAWN.value}
    word = reader.word(node, text, _RUN_PLANS, "a set of plans that runs can have", former)
    return None if word is None else RunPlans(word)


class RunsKeys(Keys):
    """The runs of a model, which proofs are about."""

    in_flow = True

    goals: DefaultKey[GoalOrder] = DefaultKey(
        ScalarType("order of goals", "an order of goals", {"enum": list(_GOAL_ORDERS)}, _read_goal_order, str),
        "`single` if each run starts in an allowed initial state and has one goal; `sequence` if any goals of the "
        "model follow each other, each from where the last one ended.",
        default=GoalOrder.SEQUENCE,
    )
    plans: DefaultKey[RunPlans] = DefaultKey(
        ScalarType("set of plans", "a set of plans", {"enum": list(_RUN_PLANS)}, _read_plans, str),
        "`canonical` if runs get the plans of the planner; `drawn` if the plans of random cases are drawn from all "
        "shortest ones, with the planner `canonical` alone. `--plans` overrides it.",
        default=RunPlans.CANONICAL,
    )

    def declaration(self) -> RunsDeclaration:
        """Return the declaration; valid only if no error is noted."""
        return RunsDeclaration(self.goals, self.plans)


class RequirementsOffType(NamesType[str | None], frozen=True):
    """The built-in requirements that a model switches off, each with its reason."""

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema, in which only built-in requirements are keys."""
        reason = self.inner.schema(definitions)
        return {"type": "object", "properties": dict.fromkeys(BUILT_IN_NAMES, reason), "additionalProperties": False}


def _read_reason(reader: ValueReader, node: YamlNode, text: str) -> str | None:
    """Return a reason in words; note a number or a truth value, which gives none."""
    if text.strip() and not isinstance(node.plain, str):
        remedy = "write why the requirement does not hold: `an operator clears each fault`"
        reader.add(Slug.WRONG_TYPE, f"a reason must be a text, not `{text}`", node.place, remedy)
        return None
    return TEXT.reader(reader, node, text)


def _read_names(_: ValueReader, node: YamlNode) -> tuple[tuple[str, Place], ...]:
    """Return the names in a list with their places; they are compared once the whole model is known."""
    return tuple((element.text, element.place) for element in node.elements if element.text is not None)


_GOAL_NAMES = names_type("list of goals", _read_names)
_REQUIREMENTS_ON = names_type("list of requirements", _read_names)
_REASON = ScalarType("text", "a text", TEXT.json, _read_reason)
_REQUIREMENTS_OFF = RequirementsOffType(_REASON, "name → reason", in_flow=lambda written: len(written) == 1)


class ModelKeys(Keys):
    """A behavior model."""

    behavior_model = Key(MODEL_NAME, "The name of the model.", required=True, source="name")
    types = types_key()
    tables = tables_key()
    variables = DefaultKey(
        NamesType(MappingType(VariableKeys), "name → variable"),
        "The variables of the world.",
        default=(),
        required=True,
        source=lambda model: {variable.name: variable for variable in model.variables},
    )
    resources = DefaultKey(
        NamesType(MappingType(ResourceKeys), "name → resource"),
        "The resources that requests are sent to.",
        default=(),
        source=lambda model: {resource.name: resource for resource in model.resources},
    )
    operations = DefaultKey(
        NamesType(MappingType(OperationKeys), "name → operation"),
        "The operations that plans consist of. Their order decides between plans of equal length.",
        default=(),
        required=True,
        source=lambda model: {operation.name: operation for operation in model.operations},
    )
    automatic_transitions = DefaultKey(
        NamesType(MappingType(AutomaticKeys), "name → transition"),
        "Transitions that the runner takes as soon as their guards hold, the first one first.",
        default=(),
        source=lambda model: {transition.name: transition for transition in model.automatic_transitions},
    )
    environment = DefaultKey(
        NamesType(MappingType(EnvironmentKeys), "name → environment transition"),
        "How inputs change: transitions of people and devices outside the model, at settled moments.",
        default=(),
        source=lambda model: {each.name: each for each in model.environment},
    )
    initial_states: DefaultKey[Predicate] = DefaultKey(
        _WORLD, "What every initial state satisfies.", default=TRUE, always_written=True
    )
    goals = DefaultKey(
        NamesType(GoalType(), "name → predicate, or goal"),
        "The goals of runs; a random case draws one of them.",
        default=(),
        source=lambda model: {name: ModelGoal(goal, model.may_end_of(name)) for name, goal in model.goals},
    )
    may_end = DefaultKey(MAY_END, MAY_END_HELP, default=())
    requirements = DefaultKey(
        LIFTED_REQUIREMENTS,
        "What must hold during every run.",
        default=(),
        source=lambda model: {requirement.name: requirement.sentence for requirement in model.requirements},
    )
    requirements_off = DefaultKey(
        _REQUIREMENTS_OFF,
        f"Built-in requirements that do not hold, each with the reason: `{'`, `'.join(BUILT_IN_NAMES)}`.",
        default=(),
    )
    requirements_on = DefaultKey(
        _REQUIREMENTS_ON,
        f"Further requirements that cases are judged by: `{'`, `'.join(OPTIONAL_NAMES)}`.",
        default=(),
    )
    reachable_again = DefaultKey(
        _GOAL_NAMES,
        "Goals that every run leaves reachable, also where plain runs do not.",
        default=(),
    )
    planner = Key(
        _PLANNER,
        "The planner of runs and tests, by its name or as a mapping with limits; `--planner` overrides it.",
        absent="`canonical`",
    )
    waivers = DefaultKey(
        WAIVER_LIST, "Obligations that need not be covered, each with a reason, its author and its date.", default=()
    )
    runs = Key(
        MappingType(RunsKeys),
        "What the runs of the model are, such as `{goals: single}`; proofs are about these runs.",
        absent="`{goals: sequence, plans: canonical}`",
        source=lambda model: None if model.runs == RunsDeclaration() else model.runs,
    )
    interfaces = INTERFACES
    include = INCLUDE
    parts = PARTS

    def model(self, *, is_bound: bool = True) -> BehaviorModel:
        """Return the model, with its bindings or without; valid only if no error is noted."""
        variables = {entry.name: entry.value.variable(entry.name) for entry in self._named(self.variables)}
        self.reader.scope = Scope(
            self._all_names(variables),
            self._misses_names(),
            self._is_unclear("operations"),
            objects=self.reader.scope.objects,
        )
        self._refuse_ambiguous_symbols()
        resources = [entry.value.resource(entry.name) for entry in self._named(self.resources)]
        self._refuse_odd_requests()
        operations = [entry.value.operation(entry.name) for entry in self._named(self.operations, "operations")]
        automatic = self._named(self.automatic_transitions)
        requirements = [(entry.name, entry.value) for entry in self._named(self.requirements)]
        model = BehaviorModel(
            name=self.behavior_model or "",
            variables=tuple(variable for variable in variables.values() if variable is not None),
            operations=tuple(operation for operation in operations if operation is not None),
            resources=tuple(resources),
            automatic_transitions=tuple(entry.value.automatic(entry.name, entry.place) for entry in automatic),
            initial_states=self.initial_states,
            goals=tuple((entry.name, entry.value.goal or TRUE) for entry in self._named(self.goals)),
            requirements=tuple(Requirement(name, sentence) for name, sentence in requirements if sentence is not None),
            planner=PlannerChoice() if self.planner is None else self.planner.choice(),
            environment=tuple(entry.value.environment(entry.name) for entry in self._named(self.environment)),
            may_end=self.may_end,
            goals_may_end=tuple((entry.name, entry.value.may_end) for entry in self.goals if entry.value.may_end),
            runs=RunsDeclaration() if self.runs is None else self.runs.declaration(),
            requirements_off=tuple(self._switched_off()),
            requirements_on=tuple(self._switched_on()),
            reachable_again=tuple(self._goals_to_reach_again()),
            origins=tuple(self._origins()),
            interfaces=tuple(node.text or "" for node in self.interfaces),
        )
        self._refuse_false_sources(model)
        self._refuse_drawn_plans(model)
        if self.waivers:
            is_whole = not self.reader.scope.incomplete
            unread = [entry.name for entry, read in zip(self.operations, operations, strict=True) if read is None]
            if misses_requests(self.node):  # a transition for failed replies is generated for each requested resource
                unread.append("automatic")
            model = replace(model, waivers=waivers_of(self.waivers, model, unread, is_whole=is_whole))
        return self._bound(model) if is_bound else model.unbound

    def _refuse_odd_requests(self) -> None:
        """Note requests of operations that do not suit their resources."""
        resources = {entry.name: entry.value.as_written(entry.name) for entry in self.resources}
        is_whole = self.is_clear and not self._is_unclear("resources")
        for entry in self.operations:
            entry.value.refuse_odd_request(resources, is_whole=is_whole)

    def _origins(self) -> Iterator[LiftedOrigin]:
        """Yield where the expanded entries come from, section by section."""
        for section in _LIFTED:
            node = self.node.get(section)
            for name, entry in node.items.items() if node is not None else ():
                if entry.origin is not None:
                    yield LiftedOrigin(section, name, entry.origin, entry.written)

    def _switched_off(self) -> Iterator[tuple[str, str]]:
        """Yield the built-in requirements that are switched off, with their reasons; note unknown ones."""
        names = list(BUILT_IN_NAMES)
        for entry in self.requirements_off:
            if entry.name not in names:
                remedy = suggestion(entry.name, names, "the built-in requirements are")
                message = f"there is no built-in requirement `{entry.name}`"
                self.reader.add(Slug.UNKNOWN_WORD, message, entry.place, remedy)
            elif entry.value is not None:
                yield entry.name, entry.value

    def _switched_on(self) -> Iterator[str]:
        """Yield the further requirements; note unknown and repeated ones."""
        unknown = (Slug.UNKNOWN_WORD, "there is no further requirement", "these can be switched on:")
        yield from self._known_names(self.requirements_on, list(OPTIONAL_NAMES), unknown)

    def _known_names(
        self, listed: tuple[tuple[str, Place], ...], names: list[str], unknown: tuple[Slug, str, str]
    ) -> Iterator[str]:
        """Yield listed names; note one that is repeated or not among `names`, with the error for it."""
        slug, message, head = unknown
        seen: dict[str, None] = {}
        for name, place in listed:
            if name not in names:
                self.reader.add(slug, f"{message} `{name}`", place, suggestion(name, names, head))
            elif name in seen:
                self.reader.add(Slug.DUPLICATE_VALUE, f"`{name}` is listed twice", place)
            else:
                seen[name] = None
                yield name

    def _goals_to_reach_again(self) -> Iterator[str]:
        """Yield the goals of `reachable_again`; note unknown and repeated ones, and where no goal follows another."""
        unknown = (Slug.UNKNOWN_GOAL, "there is no goal", "the goals are")
        yield from self._known_names(self.reachable_again, [entry.name for entry in self.goals], unknown)
        if self.reachable_again and self.runs is not None and self.runs.declaration().goals is GoalOrder.SINGLE:
            message = "`reachable_again` needs goals that follow each other, and the model says `goals: single`"
            self.reader.add(Slug.CONTRADICTION, message, self.place("reachable_again"), "leave out one of them")

    def _refuse_drawn_plans(self, model: BehaviorModel) -> None:
        """Note plans that are drawn from all shortest ones where the planner knows no lengths of shortest plans."""
        name = model.planner.name
        if self.runs is not None and model.runs.plans is RunPlans.DRAWN and name not in (None, FIRST_PLANNER.name):
            message = f"`plans: drawn` needs the planner `{FIRST_PLANNER.name}`, and the model names `{name}`"
            remedy = "leave out one of them: no other planner knows how far each state is from the goal"
            self.reader.add(Slug.CONTRADICTION, message, self.runs.place("plans"), remedy)

    def _refuse_false_sources(self, model: BehaviorModel) -> None:
        """Note a declared source that something in the model contradicts."""
        assigned = dict.fromkeys(action.target for action in model.actions)
        by_environment = {action.target: each.name for each in model.environment for action in each.actions}
        reported = {name: resource.name for resource in model.resources for name in resource.measures}
        reported |= {name: resource.name for resource in model.resources for name in resource.publishes}
        for entry in self._entries_with_source():
            name, source = entry.name, entry.value.source
            remedy = "leave out `source`, or declare what is true"
            if source is VariableSource.CONSTANT and name in assigned:
                message = f"`{name}` is declared constant, and an action assigns it"
                self.reader.add(Slug.CONTRADICTION, message, entry.value.place("source"), remedy)
            elif source is not VariableSource.INPUT and name in by_environment:
                message = f"`{name}` is declared `{source}`, and `{by_environment[name]}` of the environment assigns it"
                self.reader.add(Slug.CONTRADICTION, message, entry.value.place("source"), remedy)
            elif source is not VariableSource.INPUT and name in reported:
                message = f"`{name}` is declared `{source}`, and the resource `{reported[name]}` reports its values"
                self.reader.add(Slug.CONTRADICTION, message, entry.value.place("source"), remedy)

    def _entries_with_source(self) -> Iterator[Entry[VariableKeys]]:
        return (entry for entry in self.variables if entry.value.source is not None)

    def _bound(self, model: BehaviorModel) -> BehaviorModel:
        """Return the model with the bindings of its resources, which depend on the actions of the whole model."""
        bound = [entry for entry in self.resources if entry.value.has("ros")]
        if not bound:
            return model
        read_all = load_named("scbm.nodes.bindings.binding_keys:read_all")
        named = {
            entry.name: (entry.value.as_written(entry.name), entry.value.ros, entry.value.place("ros"))
            for entry in bound
            if entry.value.ros is not None
        }
        by_name = read_all(self.reader, model, named, self.interfaces)
        resources = (replace(resource, binding=by_name.get(resource.name)) for resource in model.resources)
        return replace(model, resources=tuple(resources))

    # names

    def _named(self, entries: tuple[Entry[T], ...], section: str = "") -> tuple[Entry[T], ...]:
        """Return the entries of a section; note keys that are no names, and reserved words."""
        for entry in entries:
            self.reader.check_name(entry.name, entry.place, section)
        return entries

    def _all_names(self, declared: dict[str, Variable | None]) -> dict[str, Variable | None]:
        """Return all variables: those declared, then those of resources and operations; note duplicates."""
        names: dict[str, Variable | None] = dict(declared)
        owners = dict.fromkeys(declared, "declared in `variables`")
        for variable, owner, place in self._owned():
            if owners.get(variable.name) == owner:  # of an operation whose name is reserved, which is noted
                continue
            if variable.name in names:
                message = f"`{variable.name}` is {owner}, and also {owners[variable.name]}"
                declared_place = self._key_places("variables").get(variable.name, place)
                self.reader.add(Slug.DUPLICATE_NAME, message, declared_place, "choose another name")
            else:
                names[variable.name] = variable
                owners[variable.name] = owner
        return names

    def _owned(self) -> Iterator[tuple[Variable, str, Place]]:
        """Yield the variables of resources and of the runner: each with its owner, and where that is named."""
        for resource, place in self._key_places("resources").items():
            for variable in resource_variables(resource):
                yield variable, f"owned by the resource `{resource}`", place
        places = self._key_places("operations")
        for variable in runner_variables(places):
            operation = variable.name.removesuffix(".state")
            yield variable, "kept by the runner", places.get(operation, self.node.place)

    def _misses_names(self) -> bool:
        """Return whether something that declares other names than states cannot be read; its own error explains why."""
        is_unclear = any(self._is_unclear(section) for section in _DECLARING if section != "operations")
        return is_unclear or not self.is_clear or self._has_other_entries("operations")

    def _is_unclear(self, section: str) -> bool:
        node = self.node.get(section)
        if node is None:
            return self.declared[section].required
        is_whole = isinstance(node.plain, dict) and not node.incomplete
        return not is_whole or not all(map(NAME.fullmatch, node.items)) or self._has_other_entries(section)

    def _has_other_entries(self, section: str) -> bool:
        """Return whether an entry of a section has keys that entries of another section have."""
        node, own = self.node.get(section), _DECLARING[section].declared.keys()
        others = {key for keys in _DECLARING.values() for key in keys.declared if key not in own}
        return node is not None and any(not others.isdisjoint(entry.items) for entry in node.items.values())

    def _refuse_ambiguous_symbols(self) -> None:
        """Note names that are both a variable and a value."""
        for entry in self.variables:
            domain = entry.node.get("domain")
            for element in domain.elements if domain is not None else ():
                if self.reader.scope.variables.get(element.text or "") is not None:
                    message = f"the value `{element.text}` of `{entry.name}` is also the name of a variable"
                    self.reader.add(Slug.AMBIGUOUS_SYMBOL, message, element.place, "rename one of them")
        values = {value: variable.name for variable, _, _ in self._owned() for value in variable.domain.values}
        places = {variable.name: place for variable, _, place in self._owned()}
        places |= self._key_places("operations") | self._key_places("variables")
        for name in self.reader.scope.variables:
            if name in values:
                message = f"the variable `{name}` has the name of a value of `{values[name]}`"
                self.reader.add(Slug.AMBIGUOUS_SYMBOL, message, places[name], "choose another name")

    def _key_places(self, section: str) -> dict[str, Place]:
        """Return where each entry of a section is named."""
        mapping = self.node.get(section)
        return mapping.key_places if mapping is not None else {}


MODEL_OWNERS: tuple[tuple[type[Keys], str], ...] = (
    (VariableKeys, "a variable"),
    (ResourceKeys, "a resource"),
    (OperationKeys, "an operation"),
    (SimulationKeys, "the `simulation` of a resource"),
    (TransitionKeys, "a transition"),
    (EnvironmentKeys, "an environment transition"),
    (PlannerKeys, "the planner"),
    (WaiverKeys, "a waiver"),
    (GoalKeys, "a goal"),
    (RunsKeys, "the runs"),
    (PartUseKeys, "a part"),
    (ModelKeys, "the model"),
)
"""The words of messages for the mappings of a model file; an unknown key belongs to the first that declares it."""
