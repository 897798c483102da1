"""From the tree of a document to a test case of a model, or to everything that is wrong with it.

Works on any tree, as `builder` does. The model is right: of it nothing is said here.

From what a case says of the network to a network.
"""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import compress
from typing import TYPE_CHECKING

from scbm.cases import Case, CaseLimits, Expectations, Network, Origin, Partition, Recorded, Restart
from scbm.cases.coverage import Obligation, Obligations
from scbm.cases.trace import End
from scbm.files.codec.case_parts import CaseParts
from scbm.files.codec.case_words import VERDICT_WORDS
from scbm.files.codec.common_parts import NAME
from scbm.files.codec.injection_builder import InjectionBuilder
from scbm.files.codec.outcome_builder import OutcomeBuilder
from scbm.files.language.scope import Scope, Where
from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.values import format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector
    from scbm.model.behavior import BehaviorModel
    from scbm.model.predicates import Predicate
    from scbm.model.requirements import Requirement
    from scbm.model.state import State


def drawing(network: Network) -> Iterator[str]:
    """The keys of what is a matter of chance in it."""
    amounts = (network.jitter_ns > 0, network.loss > 0, network.duplication > 0, network.reordering > 0)
    yield from compress(("jitter", "loss", "duplication", "reordering"), amounts)


class NetworkBuilder:
    """Reads what stands under `network`."""

    def __init__(self, parts: CaseParts) -> None:
        self._parts = parts

    def network(self, node: YamlNode | None) -> Network:
        """The network; what is not said is plain."""
        if node is None:
            return Network()
        held_back_ns = self._parts.time(node.get("held_back"))
        partitions, restarts = node.get("partitions"), node.get("restarts")
        return Network(
            self._parts.time(node.get("latency")) or 0,
            self._parts.time(node.get("jitter")) or 0,
            self._share(node.get("loss")),
            self._share(node.get("duplication")),
            self._share(node.get("reordering")),
            Network().held_back_ns if held_back_ns is None else held_back_ns,
            tuple(self._partition(element) for element in (partitions.elements if partitions is not None else ())),
            tuple(self._restart(element) for element in (restarts.elements if restarts is not None else ())),
        )

    def _share(self, node: YamlNode | None) -> Fraction:
        return self._parts.share(node) or Fraction(0)

    def _partition(self, node: YamlNode) -> Partition:
        resource = self._parts.resource(node.get("resource"))
        at_ns, for_ns = self._parts.time(node.get("at")), self._parts.time(node.get("for"))
        return Partition(at_ns or 0, for_ns or 0, None if resource is None else resource.name)

    def _restart(self, node: YamlNode) -> Restart:
        resource = self._parts.resource(node.get("resource"))
        at_ns, for_ns = self._parts.time(node.get("at")), self._parts.time(node.get("for"))
        return Restart("" if resource is None else resource.name, at_ns or 0, for_ns or 0)


_DIGEST = re.compile(r"[0-9a-f]{64}", re.ASCII)
_WORD = re.compile(rf"(?!true$|false$){NAME.pattern}", re.ASCII)
"""What can only be meant as the name of a goal: no predicate is a word, but for two."""


class CaseBuilder:
    """Builds one case out of one document, noting every error in a report."""

    def __init__(self, document: YamlNode, report: ErrorCollector, model: BehaviorModel) -> None:
        self._document = document
        self._model = model
        self._parts = CaseParts(report, Scope.of(model), model)

    @property
    def is_whole(self) -> bool:
        """Whether every text so far was resolved; if not, the report says why."""
        return self._parts.is_whole

    def case(self) -> Case:
        """The case; only good if the report is empty afterwards."""
        get = self._document.get
        goal, predicate = self._goal(get("goal"))
        self._check_model_path(get("model"))
        return Case(
            self._parts.name(get("case")) or "",
            goal,
            predicate,
            self._initial(get("initial")),
            OutcomeBuilder(self._parts).forced(get("outcomes")),
            InjectionBuilder(self._parts).injections(get("injections")),
            self._network(get("network")),
            self._limits(get("limits")),
            tuple(self._requirements(get("requirements"))),
            self._expectations(get("expect")),
            self._origin(get("drawn")),
            self._recorded(get("recorded")),
        )

    def _check_model_path(self, node: YamlNode | None) -> None:
        if node is not None and node.text is not None and node.plain is not None and not node.text.strip():
            message = "expected the path of a model file, found nothing under `model`"
            self._parts.add(Slug.WRONG_SHAPE, message, node.place, "write for example `model: ../cell.yaml`")

    # what it is for

    def _goal(self, node: YamlNode | None) -> tuple[str, Predicate]:
        named = self._model.goal(node.text) if node is not None and node.text is not None else None
        if named is not None and node is not None and node.text is not None:
            return node.text, named
        if node is not None and isinstance(node.plain, str) and _WORD.fullmatch(node.plain):
            known = [name for name, _ in self._model.goals]
            remedy = suggestion(node.plain, known, "its goals are") or "write a predicate, such as `robot_at == home`"
            self._parts.add(Slug.UNKNOWN_GOAL, f"the model has no goal `{node.plain}`", node.place, remedy)
            node = None
        predicate = self._parts.predicate(node, Where.WORLD)
        return str(predicate), predicate

    def _requirements(self, node: YamlNode | None) -> Iterator[Requirement]:
        known = {requirement.name for requirement in self._model.requirements}
        for name, written in node.items.items() if node is not None else ():
            assert node is not None  # noqa: S101 - its items are gone through
            place = node.key_places[name]
            if not NAME.fullmatch(name):
                self._parts.refuse_name(name, place)
            elif name in known:
                message = f"the model has a requirement `{name}` already"
                self._parts.add(Slug.DUPLICATE_NAME, message, place, "choose another name")
            requirement = self._parts.requirement(name, written)
            if requirement is not None:
                yield requirement

    # where it begins

    def _initial(self, node: YamlNode | None) -> State:
        values = self._parts.world(node)
        state = self._model.nominal_state.replace(values)
        allowed = self._model.initial_states
        if len(values) == (0 if node is None else len(node.items)) and not allowed.holds(state):
            key = "initial" if node is not None else "case"
            place = self._document.key_places.get(key, self._document.place)
            read = dict.fromkeys(allowed.reads())
            here = ", ".join(f"{name} is {format_value(state[name])}" for name in read)
            message = f"the initial state does not satisfy `initial_states`: {allowed}"
            self._parts.add(Slug.INITIAL_STATE_NOT_ALLOWED, message, place, f"here {here}" if here else None)
        return state

    # what happens on the way

    def _network(self, node: YamlNode | None) -> Network:
        network = NetworkBuilder(self._parts).network(node)
        drawn = nearest("drawn", self._document.items) is not None  # one that is misspelt is told of
        for key in drawing(network):
            if not drawn and node is not None:
                message = f"`{key}` is a matter of chance, and the case does not say what it is drawn from"
                self._parts.add(Slug.NOTHING_DRAWN, message, node.key_places[key], "add `drawn: {seed: 1}` to the case")
        return network

    def _limits(self, node: YamlNode | None) -> CaseLimits:
        if node is None:
            return CaseLimits()
        time = node.get("time")
        time_ns = self._parts.time(time)
        if time is not None and time_ns == 0:
            message = f"`{time.text}` is no time to run for"
            self._parts.add(Slug.BAD_NUMBER, message, time.place, "write for example `10 min`")
        return CaseLimits(time_ns, self._parts.count(node.get("plans")))

    def _origin(self, node: YamlNode | None) -> Origin | None:
        if node is None:
            return None
        seed = self._parts.count(node.get("seed"), least=None)
        number = self._parts.count(node.get("case"))
        return Origin(0 if seed is None else seed, 1 if number is None else number)

    # what must come of it, and what came

    def _expectations(self, node: YamlNode | None) -> Expectations:
        if node is None:
            return Expectations()
        plan = node.get("plan")
        return Expectations(
            self._verdict(node.get("verdict")),
            None if plan is None else self._operations(plan),
            self._operations(node.get("order")),
            self._final(node.get("final")),
            self._visits(node.get("visits")),
        )

    def _verdict(self, node: YamlNode | None) -> End | None:
        word = self._parts.word(node, VERDICT_WORDS, "a verdict")
        return None if word is None else End(word)

    def _operations(self, node: YamlNode | None) -> tuple[str, ...]:
        elements = node.elements if node is not None else ()
        return tuple(name for element in elements if (name := self._parts.operation(element)) is not None)

    def _final(self, node: YamlNode | None) -> tuple[Predicate, ...]:
        if node is None or node.plain == []:
            return ()
        nodes = node.elements or [node]
        return tuple(self._parts.predicate(element, Where.REQUIREMENT) for element in nodes)

    def _visits(self, node: YamlNode | None) -> tuple[Obligation, ...]:
        known = {str(obligation): obligation for obligation in Obligations.of(self._model)}
        visits: dict[Obligation, None] = {}
        for element in node.elements if node is not None else ():
            if element.text is None or element.plain is None:
                continue
            obligation = known.get(element.text)
            if obligation is None:
                remedy = suggestion(element.text, known, "the obligations are")
                message = f"the model has no obligation `{element.text}`"
                self._parts.add(Slug.UNKNOWN_OBLIGATION, message, element.place, remedy)
            elif obligation in visits:
                self._parts.add(Slug.DUPLICATE_VALUE, f"`{element.text}` stands here twice", element.place)
            else:
                visits[obligation] = None
        return tuple(visits)

    def _recorded(self, node: YamlNode | None) -> Recorded | None:
        if node is None:
            return None
        end = self._parts.word(node.get("end"), VERDICT_WORDS, "the end of a run")
        digest = node.get("trace")
        text = digest.text if digest is not None and digest.text is not None else ""
        if digest is not None and digest.scalar is not None and not _DIGEST.fullmatch(text):
            message = f"expected the SHA-256 of a trace, 64 hexadecimal digits, found `{text}`"
            self._parts.add(Slug.WRONG_SHAPE, message, digest.place, "leave out `recorded`, or save the case again")
        return Recorded(end or "", text)
