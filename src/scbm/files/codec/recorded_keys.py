"""The keys of `recorded` in a case file: what the run did that the case was saved from.

Names of obligations, operations and variables are texts here. A model that has changed need not have them any more, and
then the run differs from the recorded one, while the file can still be read.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from scbm.cases import RecordedGoal, RecordedRun
from scbm.files.codec.key_types import (
    SCALAR_SCHEMA,
    TIME,
    MappingListType,
    NamesType,
    ScalarType,
    is_short,
    names_type,
    verdict_type,
)
from scbm.files.codec.keys import DefaultKey, Key, Keys
from scbm.files.yaml.yaml_writer import FlowList
from scbm.model import FIRST_PLANNER, PlannerIdentity, Slug

if TYPE_CHECKING:
    from scbm.files.codec.keys import Data
    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode

_DIGEST = re.compile(r"[0-9a-f]{64}", re.ASCII)


# types


def _read_digest(reader: ValueReader, node: YamlNode, text: str) -> str:
    if not _DIGEST.fullmatch(text):
        message = f"expected the SHA-256 of a trace, 64 hexadecimal digits, found `{text}`"
        reader.add(Slug.WRONG_SHAPE, message, node.place, "leave out `recorded`, or save the case again")
    return text


def _read_planner(reader: ValueReader, node: YamlNode, text: str) -> PlannerIdentity | None:
    try:
        return PlannerIdentity.parse(text)
    except ValueError:
        message = f"expected the name and the version of a planner, found `{text}`"
        reader.add(Slug.WRONG_SHAPE, message, node.place, "write for example `greedy 1`, or save the case again")
        return None


def _read_texts(_: ValueReader, node: YamlNode) -> tuple[str, ...]:
    return tuple(e.text for e in node.elements if e.text is not None and e.plain is not None)


def _value_data(text: str) -> Data:
    """Return a value as YAML has it without quotes, from its text."""
    if text in ("true", "false"):
        return text == "true"
    return int(text) if re.fullmatch(r"0|-?[1-9][0-9]{0,18}", text, re.ASCII) else text


def _read_text(_: ValueReader, __: YamlNode, text: str) -> str:
    return text


_TEXT = ScalarType("value", "a value", SCALAR_SCHEMA, _read_text, _value_data)
_VALUES = NamesType(_TEXT, "variable → value", is_short)
_VISITS = NamesType(names_type("list of names", _read_texts, FlowList), "operation or `automatic` → list of names")
_COMPLETED = names_type("list of operations", _read_texts, FlowList)


# the keys


class RecordedPartsKeys(Keys):
    """The recorded result of a run for one goal, part by part."""

    time = Key(
        TIME,
        "The simulated time from the beginning of the case to the end of the run.",
        absent="not compared",
        source="ended_ns",
    )
    visits: Key[tuple[Entry[tuple[str, ...] | None], ...]] = Key(
        _VISITS,
        "Exactly the obligations that the run visited: for each operation its states, and `queued`; below `automatic` "
        "the transitions that were taken.",
        absent="not compared",
        always_written=True,
    )
    order: Key[tuple[str, ...]] = Key(
        _COMPLETED, "Exactly the operations that completed, in order.", absent="not compared", always_written=True
    )
    final: Key[tuple[Entry[str | None], ...]] = Key(
        _VALUES,
        "The values of all declared variables at the end.",
        absent="not compared",
        always_written=True,
    )

    def goal(self, end: str) -> RecordedGoal:
        """Return the parts that are there, with the end of the run."""
        visits = None if self.visits is None else tuple(_names_of(self.visits))
        final = None if self.final is None else tuple((entry.name, entry.value or "") for entry in self.final)
        return RecordedGoal(end, visits, self.order, final, self.time)


def _names_of(entries: tuple[Entry[tuple[str, ...] | None], ...]) -> list[str]:
    return [f"{entry.name}/{name}" for entry in entries for name in entry.value or ()]


class RecordedGoalKeys(RecordedPartsKeys):
    """The recorded result of the run for one of several goals."""

    end = Key(verdict_type("the end of a run"), "How the run for this goal ended.", required=True)

    def recorded_goal(self) -> RecordedGoal:
        """Return the goal; valid only if no error is noted."""
        return self.goal(str(self.end or ""))

    @classmethod
    def write(cls, value: object) -> dict[str, Data]:
        """Return the parts that are recorded."""
        return super().write(_RecordedGoalData.of(value))


class RecordedKeys(RecordedPartsKeys):
    """The result of the run that the case was saved from. A later run that differs in a part fails the case."""

    end = Key(verdict_type("the end of a run"), "How the run for the last goal ended.", required=True)
    trace = Key(
        ScalarType(
            "SHA-256",
            "the SHA-256 of a trace",
            {"type": ["string", "number"], "pattern": "^[0-9a-f]{64}$"},
            _read_digest,
        ),
        "The SHA-256 of the trace of the run, in 64 hexadecimal digits; `scbm replay` compares it.",
        absent="not compared",
    )
    planner: DefaultKey[PlannerIdentity] = DefaultKey(
        ScalarType("name and version", "the name and the version of a planner", {"type": "string"}, _read_planner, str),
        "The planner that made the plans: name, version and the limits that were set, as in `greedy 1, max_length 50`.",
        default=FIRST_PLANNER,
    )
    goals = DefaultKey(
        MappingListType(RecordedGoalKeys, "list of goals"),
        "What the run for each goal did, if there are several; in place of the other parts.",
        default=(),
    )

    def recorded_run(self) -> RecordedRun:
        """Return the run; valid only if no error is noted."""
        end = str(self.end or "")
        return RecordedRun(end, self.trace, self.planner, self._goals(end))

    def _goals(self, end: str) -> tuple[RecordedGoal, ...]:
        """Return what is recorded of each goal; nothing if only the end is."""
        here = [key for key in RecordedPartsKeys.declared if self.has(key)]
        if not self.has("goals"):
            return (self.goal(end),) if here else ()
        for key in here:
            message = f"a record with `goals` has no `{key}` of its own"
            self.reader.add(Slug.CONTRADICTION, message, self.place(key), f"write `{key}` in the elements of `goals`")
        return tuple(keys.recorded_goal() for keys in self.goals)

    @classmethod
    def write(cls, value: object) -> dict[str, Data]:
        """Return the data of a run: the parts of an only goal, or a list of goals."""
        return super().write(_RecordedRunData.of(value))


# writing


class _RecordedGoalData(NamedTuple):
    """The recorded result of the run for one goal, as it is written; attributes as in `RecordedGoal`."""

    end: str
    visits: dict[str, list[str]] | None
    order: tuple[str, ...] | None
    final: tuple[tuple[str, str], ...] | None
    ended_ns: int | None

    @staticmethod
    def of(recorded: Any) -> _RecordedGoalData:  # noqa: ANN401 - keys have values of many types
        """Return a goal with the names of its visits by their subjects."""
        by_subject = _by_subject(recorded.visits)
        return _RecordedGoalData(recorded.end, by_subject, recorded.order, recorded.final, recorded.ended_ns)


def _by_subject(visits: tuple[str, ...] | None) -> dict[str, list[str]] | None:
    if visits is None:
        return None
    found: dict[str, list[str]] = {}
    for name in visits:
        subject, _, aspect = name.partition("/")
        found.setdefault(subject, []).append(aspect)
    return found


class _RecordedRunData(NamedTuple):
    """A recorded run, as it is written; the attributes behind `goals` are those of an only goal."""

    end: str
    trace: str | None
    planner: PlannerIdentity
    goals: tuple[RecordedGoal, ...]
    visits: dict[str, list[str]] | None = None
    order: tuple[str, ...] | None = None
    final: tuple[tuple[str, str], ...] | None = None
    ended_ns: int | None = None

    @staticmethod
    def of(recorded: Any) -> _RecordedRunData:  # noqa: ANN401 - keys have values of many types
        """Return a run with the parts of its only goal, or with its goals."""
        run = _RecordedRunData(recorded.end, recorded.trace, recorded.planner, recorded.goals)
        if len(run.goals) != 1:
            return run
        _, visits, order, final, ended_ns = _RecordedGoalData.of(run.goals[0])
        return run._replace(goals=(), visits=visits, order=order, final=final, ended_ns=ended_ns)
