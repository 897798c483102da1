"""From what a case says of requests to rules for them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.cases import LOST, Delivery, Forced
from scbm.files.codec.case_words import ANY, OUTCOME_WORDS
from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.resources import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.trace import Changes
    from scbm.files.codec.case_parts import CaseParts
    from scbm.files.yaml.document import YamlNode

MAX_TIMES = 10_000
"""For so many requests may one element speak."""

MAX_COPIES = 10
"""So many copies of a message may arrive."""


class OutcomeBuilder:
    """Reads what stands under `outcomes`."""

    def __init__(self, parts: CaseParts) -> None:
        self._parts = parts
        self._measures = {resource.name: resource.measures for resource in parts.model.resources}
        self._operations = [operation.name for operation in parts.model.operations]

    def forced(self, node: YamlNode | None) -> tuple[Forced, ...]:
        """The rules, in the order of the file."""
        rules: list[Forced] = []
        for subject, written in node.items.items() if node is not None else ():
            assert node is not None  # noqa: S101 - its items are gone through
            self._check_subject(subject, node)
            rules += self._listed(subject, written) if written.elements else self._alone(subject, written)
        return tuple(rules)

    def _check_subject(self, subject: str, node: YamlNode) -> None:
        place = node.key_places[subject]
        if subject in self._measures and subject in self._operations:
            message = f"the model has a resource `{subject}` and an operation `{subject}`"
            self._parts.add(Slug.AMBIGUOUS_SUBJECT, message, place, "rename one of them in the model")
        elif subject not in self._measures and subject not in self._operations:
            remedy = suggestion(subject, dict.fromkeys([*self._measures, *self._operations]), "there are")
            message = f"there is no resource and no operation `{subject}`"
            self._parts.add(Slug.UNKNOWN_RESOURCE, message, place, remedy)

    def _alone(self, subject: str, node: YamlNode) -> Iterator[Forced]:
        """A rule that is not in a list: of every request, or of those from a number on."""
        if node.get("times") is not None:
            message = "`times` counts in a list, and here is none"
            remedy = f"put a `- ` before it: `- {{outcome: …, times: {node.items['times'].text}}}`"
            self._parts.add(Slug.WRONG_SHAPE, message, node.key_places["times"], remedy)
        first = self._parts.count(node.get("from")) or 1
        yield from self._rule(subject, node, first, None)

    def _listed(self, subject: str, node: YamlNode) -> Iterator[Forced]:
        """The elements of a list, one after the other."""
        first: int | None = 1
        for element in node.elements:
            if first is None:
                message = "this never comes: the element before speaks of all requests that follow"
                self._parts.add(Slug.NEVER_COMES, message, element.place, "put the element with `from` at the end")
                yield from self._rule(subject, element, 1, 1)  # its own errors are told, too
            elif element.get("from") is not None:
                yield from self._rule(subject, element, self._begin(element, first), None)
                first = None
            else:
                times = self._parts.count(element.get("times"), most=MAX_TIMES) or 1
                yield from self._rule(subject, element, first, first + times - 1)
                first += times

    def _begin(self, element: YamlNode, first: int) -> int:
        """From which request on an element speaks, where the list has told of all before `first`."""
        if element.get("times") is not None:
            message = "`from` is for ever, so `times` has no meaning beside it"
            self._parts.add(Slug.CONTRADICTION, message, element.key_places["times"], "leave out one of them")
        begin = self._parts.count(element.get("from"))
        if begin is not None and begin < first:
            message = f"the list already tells of the first {first - 1} requests, and this begins with number {begin}"
            self._parts.add(Slug.NEVER_COMES, message, element.items["from"].place, f"write `from: {first}` or more")
        return max(begin or first, first)

    def _rule(self, subject: str, node: YamlNode, first: int, last: int | None) -> Iterator[Forced]:
        """What an element says; nothing if it leaves all open."""
        said = node if isinstance(node.plain, dict) else None
        outcome = self._outcome(node if said is None else said.get("outcome"))
        rule = Forced(subject, first, last, outcome)
        if said is not None:
            self._refuse_contradiction(said, outcome)
            rule = replace(
                rule,
                latency_ns=self._parts.time(said.get("after")),
                measured=self._measured(subject, said.get("measured")),
                request=self._delivery(said.get("request")),
                reply=self._delivery(said.get("reply")),
                cancel=self._delivery(said.get("cancel")),
            )
        if rule != Forced(subject, first, last):
            yield rule

    def _outcome(self, node: YamlNode | None) -> Outcome | None:
        word = self._parts.word(node, OUTCOME_WORDS, "an outcome of a request")
        return None if word in (None, ANY) else Outcome(word)

    def _refuse_contradiction(self, node: YamlNode, outcome: Outcome | None) -> None:
        """A request that times out has no reply, and only a successful reply measures."""
        silent = ("after", "reply") if outcome is Outcome.TIMEOUT else ()
        for key in (key for key in silent if key in node.items):
            message = f"a request that times out has no reply, and `{key}` speaks of one"
            self._parts.add(Slug.CONTRADICTION, message, node.key_places[key], f"leave out `{key}`")
        if outcome in (Outcome.FAIL, Outcome.TIMEOUT) and "measured" in node.items:
            message = f"only a successful reply measures, and this is `outcome: {outcome}`"
            self._parts.add(Slug.CONTRADICTION, message, node.key_places["measured"], "leave out `measured`")

    def _measured(self, subject: str, node: YamlNode | None) -> Changes | None:
        if node is None or not isinstance(node.plain, dict):
            return None
        if subject in self._measures:
            return self._parts.measured(node, self._measures[subject], f"`{subject}` does not measure")
        everything = [name for names in self._measures.values() for name in names]
        return self._parts.measured(node, everything, "no resource measures")

    def _delivery(self, node: YamlNode | None) -> Delivery | None:
        if node is None or node.plain is None:
            return None
        if isinstance(node.plain, list):
            times = [self._parts.time(element) for element in node.elements]
            if len(times) > MAX_COPIES:
                message = f"{len(times)} copies of a message are too many: the most is {MAX_COPIES}"
                self._parts.add(Slug.BAD_NUMBER, message, node.place)
            return tuple(time_ns for time_ns in times if time_ns is not None)
        if node.text == "lost":
            return LOST
        if node.text is not None and nearest(node.text, ["lost"]):
            self._parts.word(node, ["lost"], "a way for a message to travel")
            return None
        time_ns = self._parts.time(node)
        return None if time_ns is None else (time_ns,)
