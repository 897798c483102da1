"""The keys of waivers, in a model file and in a file of their own, and what they mean for one model."""

from __future__ import annotations

import re
from datetime import date
from typing import TYPE_CHECKING

from scbm.files.codec.key_types import NAME_NODE, MappingListType, ScalarType
from scbm.files.codec.keys import Key, Keys
from scbm.files.codec.lifted.object_keys import where_key
from scbm.files.spelling import suggestion
from scbm.model import Slug, Waiver

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.behavior import BehaviorModel

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}", re.ASCII)


def _read_date(reader: ValueReader, node: YamlNode, text: str) -> str | None:
    """Return a date as it is written; note a text that is no date."""
    try:
        is_date = _DATE.fullmatch(text) is not None and date.fromisoformat(text) is not None
    except ValueError:
        is_date = False
    if is_date:
        return text
    reader.add(Slug.BAD_DATE, f"`{text}` is not a date", node.place, "write year, month and day: `2026-11-23`")
    return None


def _read_sentence(reader: ValueReader, node: YamlNode, text: str) -> str | None:
    """Return a text with something in it; note one without."""
    if text.strip():
        return " ".join(text.split())
    reader.add(Slug.MISSING_KEY, "a text is missing here", node.place, "write it for the readers of reports")
    return None


TEXT = ScalarType("text", "a text", {"type": "string", "minLength": 1}, _read_sentence)
_DATE_TYPE = ScalarType("date", "a date such as `2026-11-23`", {"type": "string", "format": "date"}, _read_date)


class WaiverKeys(Keys):
    """An obligation that need not be covered, and why."""

    obligation = Key(
        NAME_NODE,
        "The obligation: `<operation>/<state>`, `<operation>/queued` or `automatic/<transition>`; that of an entry with"
        " parameters stands for all of its instances.",
        required=True,
    )
    reason = Key(TEXT, "Why it need not be covered.", required=True)
    author = Key(TEXT, "Who decided that.", required=True)
    date = Key(_DATE_TYPE, "When that was decided.", required=True)
    expires = Key(_DATE_TYPE, "The last day on which the waiver counts.", absent="it does not expire")
    where = where_key()

    def waiver(self, known: Iterable[str], unread: Collection[str], *, is_whole: bool) -> Waiver | None:
        """Return the waiver; `None` if something in it is wrong, which is noted.

        Args:
            known: the names of the obligations of the model.
            unread: the first words of obligations of entries that have errors.
            is_whole: whether these are all obligations; if not, an unknown one is no error.
        """
        node, names = self.obligation, list(known)
        text = "" if node is None else node.text or ""
        if node is not None and text not in names and text.partition("/")[0] not in unread and is_whole:
            remedy = suggestion(text, names, "the obligations are")
            message = f"the model has no obligation `{node.text}`"
            self.reader.add(Slug.UNKNOWN_OBLIGATION, message, node.place, remedy)
        reason, author, day, expires = self.reason, self.author, self.date, self.expires
        if day is not None and expires is not None and expires < day:
            message = f"the waiver expires on {expires}, before its date {day}"
            self.reader.add(Slug.CONTRADICTION, message, self.node.items["expires"].place, "write a later day")
        if node is None or node.text is None or reason is None or author is None or day is None:
            return None
        return Waiver(node.text, reason, author, day, expires, node.place, self.node.origin or "")


WAIVER_LIST = MappingListType(WaiverKeys, "list of waivers")


def waivers_of(
    entries: Iterable[WaiverKeys], model: BehaviorModel, unread: Collection[str] = (), *, is_whole: bool = True
) -> tuple[Waiver, ...]:
    """Return the waivers of a list, in its order; note unknown obligations, and obligations with two waivers.

    Args:
        entries: the waivers.
        model: the model that has the obligations.
        unread: the first words of obligations of entries that have errors: `move`, or `automatic`.
        is_whole: whether all of the model could be read; if not, an unknown obligation is no error.
    """
    return tuple(_checked(entries, model, unread, is_whole=is_whole))


def _checked(
    entries: Iterable[WaiverKeys], model: BehaviorModel, unread: Collection[str], *, is_whole: bool
) -> Iterator[Waiver]:
    from scbm.cases.coverage import Obligations  # noqa: PLC0415 - few models have waivers

    known = [str(obligation) for obligation in Obligations.of(model)]
    first: dict[str, Waiver] = {}
    noted: list[Place] = []
    for entry in entries:
        waiver = entry.waiver(known, unread, is_whole=is_whole)
        if waiver is None:
            continue
        if waiver.obligation in first and waiver.place is not None:
            before = first[waiver.obligation].place
            message = f"`{waiver.obligation}` has a waiver already, in line {before.line if before is not None else 0}"
            if waiver.place not in noted:  # of a waiver for several instances the first one is enough
                entry.reader.add(Slug.DUPLICATE_VALUE, message, waiver.place, "leave out one of the two")
            noted.append(waiver.place)
            continue
        first[waiver.obligation] = waiver
        yield waiver


class WaiversKeys(Keys):
    """Waivers for a model, in a file of their own."""

    waivers_of = Key(NAME_NODE, "The name of the model.", required=True)
    waivers = Key(WAIVER_LIST, "The waivers, as under `waivers` in a model file.", required=True)

    def read(self, model: BehaviorModel) -> tuple[Waiver, ...]:
        """Return the waivers for a model; valid only if no error is noted."""
        node = self.waivers_of
        if node is not None and node.text != model.name:
            message = f"these are waivers for `{node.text}`, and the model is `{model.name}`"
            self.reader.add(Slug.WRONG_SHAPE, message, node.place, "name the waivers of this model")
            self.reader.report.raise_any()
        return waivers_of(self.waivers or (), model)


WAIVERS_OWNERS: tuple[tuple[type[Keys], str], ...] = ((WaiverKeys, "a waiver"), (WaiversKeys, "the file"))
"""The words of messages for the mappings of a waivers file."""
