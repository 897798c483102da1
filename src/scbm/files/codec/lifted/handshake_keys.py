"""The keys of an operation that stand for a whole request, as people write them; `expansion` writes them out."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.files.codec.key_types import ACTIONS, NAME_NODE, VALUE, NamesType, predicate_type
from scbm.files.codec.keys import Key, Keys
from scbm.files.language.scope import Where
from scbm.files.spelling import nearest, suggestion
from scbm.model import Slug, format_value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import Resource


_NAMES = re.compile(r"[A-Za-z_][\w.]*", re.ASCII)


def _unwritten(_: object) -> None:
    """Return nothing: a model is written with the transitions that these keys stand for."""


class HandshakeKeys(Keys):
    """A request that an operation sends, and whose reply completes it (semantics 3.5)."""

    request = Key(
        NAME_NODE,
        "The resource that the operation sends a request to. It stands for the whole protocol (semantics 3.5); guards "
        "and actions under `pre`, `post` and `timedout` are added.",
        source=_unwritten,
    )
    with_ = Key(
        NamesType(VALUE, "variable → value"),
        "What the request carries: a value or another variable for each variable under `request` of the resource. "
        "`v: v` sends the value that `v` has.",
        name="with",
        source=_unwritten,
    )
    guard = Key(
        predicate_type(Where.GUARD),
        "With `request`: where the operation can start, apart from the free resource.",
        source=_unwritten,
    )
    assumes = Key(
        NamesType(VALUE, "variable → value"),
        "With `request`: what the planner assumes that the reply measures: a value or another variable for each "
        "variable. The operation completes only if the reply agrees, and fails otherwise.",
        source=_unwritten,
    )
    effects = Key(ACTIONS, "With `request`: what changes when the resource has succeeded.", source=_unwritten)
    on_timeout = Key(
        ACTIONS, "With `request`: what changes when the deadline passes; it needs a `deadline`.", source=_unwritten
    )

    def refuse_odd_request(self, resources: Mapping[str, Resource], *, is_whole: bool) -> None:
        """Note an unknown resource, what it neither expects nor measures, and these keys without a request.

        Args:
            resources: the resources as they are written.
            is_whole: whether these are all resources of the model; if not, an unknown one is no error.
        """
        if not self.has("request"):
            self._refuse_without_request()
        elif self.request is not None:
            resource = self.request.text or ""
            if resource in resources:
                self._refuse_odd_payload(resource, resources[resource].request)
                self._refuse_unmeasured(resource, resources[resource].measures)
            elif is_whole:
                near = self.reader.report.suggestion(resource, resources, "the resources are", self.request.place)
                remedy = near or f"add `{resource}` to `resources`"
                message = f"there is no resource `{resource}`"
                self.reader.add(Slug.UNKNOWN_RESOURCE, message, self.request.place, remedy)

    def _refuse_without_request(self) -> None:
        if nearest("request", self.node.items) is None:
            for key in (key for key in HandshakeKeys.declared if self.has(key)):
                message = f"`{key}` belongs to a `request`, and this operation has none"
                remedy = "add `request: <resource>`, or write `pre` and `post`"
                self.reader.add(Slug.MISSING_KEY, message, self.place(key), remedy)

    def _value_of(self, name: str) -> str:
        """Return a value that a variable can have, as it is written."""
        variable = self.reader.scope.variables.get(name)
        return name if variable is None else format_value(variable.initial)

    def _refuse_unmeasured(self, resource: str, measured: tuple[str, ...]) -> None:
        """Note assumptions about what replies of the resource cannot carry, and those that read themselves."""
        for entry in self.assumes or ():
            if entry.name in _NAMES.findall(entry.node.text or ""):
                message = f"the reply changes `{entry.name}`, so `{entry.name}` cannot say what is assumed"
                self.reader.add(Slug.CONTRADICTION, message, entry.node.place, "write a value or another variable")
            if entry.name in self.reader.scope.variables and entry.name not in measured:
                message = f"`{resource}` does not measure `{entry.name}`"
                remedy = suggestion(entry.name, measured, "it measures")
                remedy = remedy or f"list `{entry.name}` under `measures` of `{resource}`, or write it under `effects`"
                self.reader.add(Slug.UNKNOWN_VARIABLE, message, entry.place, remedy)

    def _refuse_odd_payload(self, resource: str, carried: tuple[str, ...]) -> None:
        """Note what `with` has too much, else what it misses."""
        entries = self.with_ or ()
        odd = [entry for entry in entries if entry.name not in carried]
        for entry in odd:
            if entry.name in self.reader.scope.variables:
                message = f"requests to `{resource}` do not carry `{entry.name}`"
                remedy = suggestion(entry.name, carried, "they carry")
                if remedy is None and "." in entry.name:  # it may be one of several instances
                    remedy = f"list the variable under `request` of `{resource}`, or leave it out here"
                remedy = remedy or f"add `request: [{entry.name}]` to the resource"
                self.reader.add(Slug.UNKNOWN_VARIABLE, message, entry.place, remedy)
        given = [entry.name for entry in entries]
        missing = [name for name in carried if name not in given]
        written = self.node.at(("with",))
        if missing and not odd and isinstance(written.plain, dict) and not written.incomplete:
            shown = ", ".join(f"`{name}`" for name in missing)
            message = f"requests to `{resource}` carry {shown}, and `with` has no value for it"
            listed = ", ".join(f"{name}: {self._value_of(name)}" for name in missing)
            remedy = f"add `{listed}` to `with`" if self.has("with") else f"write `with: {{{listed}}}`"
            remedy = f"{remedy}; `{missing[0]}: {missing[0]}` sends the value that it has"
            place = self.place("with" if self.has("with") else "request")
            self.reader.add(Slug.MISSING_KEY, message, place, remedy)
