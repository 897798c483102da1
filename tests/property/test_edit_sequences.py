"""Any sequence of clicks: the trace is that of the text, earlier instants stay, undo is exact, comments are kept."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from scbm.cli.output.shown_run import run_json
from scbm.files import load_model, parse_case, read_case
from scbm.model import InputError
from scbm.testing import Tester
from scbm.web.case_edits import CASE_EDITS
from support.consoles import CELL, COMMENTED, ConsoleClient, near_console
from support.profiles import examples

if TYPE_CHECKING:
    from scbm.cases import Case

AIR = Path(__file__).parents[2] / "examples" / "robot_in_the_air" / "after.yaml"
TEXTS = {"cell": COMMENTED, "air": "# nominal\ncase: nominal\ngoal: item_a_scanned\n"}
OF_THE_CASE = ("goal", "begin")
"""Clicks that change a run from its beginning on."""


@cache
def _console(name: str) -> tuple[ConsoleClient, Tester]:
    folder = Path(mkdtemp())
    cell = folder / "cell.yaml"
    cell.write_text(CELL, encoding="utf-8")
    file = cell if name == "cell" else AIR
    return near_console(file, folder / "cases"), Tester(load_model(file))


def _comments(text: str) -> list[str]:
    return [line.partition("#")[2] for line in text.splitlines() if "#" in line]


REQUESTS = [name for name, edit in CASE_EDITS.items() if edit.target.value == "request"]


class EditSequences(RuleBasedStateMachine):
    """A session of a person who clicks anything."""

    @initialize(name=st.sampled_from(sorted(TEXTS)))
    def begin(self, name: str) -> None:
        self.client, self.tester = _console(name)
        self.facts = self.client.ask("facts")
        self.first = self.text = TEXTS[name]
        self.past: list[tuple[str, list[Any]]] = []
        self.trace = self._trace()

    def _trace(self) -> list[Any] | None:
        """Return the records of the page's text; `None` if the text has errors."""
        found: list[Any] | None = self.client.ask("trace", text=self.text).get("trace")
        return found

    def _targets(self, target: str, record: int) -> list[str]:
        match target:
            case "request":
                return [str(each["request"]) for each in self.trace or () if each["kind"] == "request_sent"]
            case "variable":
                return [each["name"] for each in self.facts["variables"]]
            case "initial":
                return [each["name"] for each in self.facts["variables"] if each["is_initial"]]
            case "change":
                moment = self.client.ask("moment", text=self.text, record=record)
                return [each["target"] for each in moment["offers"]]
            case _:
                found: list[str] = self.facts[f"{target}s"]
                return found

    @precondition(lambda self: self.trace)
    @rule(data=st.data())
    def click(self, data: st.DataObject) -> None:
        assert self.trace is not None
        record = data.draw(st.integers(0, len(self.trace) - 1))
        name = data.draw(st.sampled_from(sorted(CASE_EDITS)))
        targets = self._targets(CASE_EDITS[name].target.value, record)
        if not targets:
            return
        target = data.draw(st.sampled_from(targets))
        choices = {each["name"]: each["values"] for each in self.facts["variables"]}
        durations = st.sampled_from(["0 s", "50 ms", "1.5 s", "6 s"])
        fields = {
            field.name: data.draw(st.sampled_from(field.choices or choices[target]))
            if field.choices or field.name == "value"
            else "2"
            if field.name == "factor"
            else data.draw(durations)
            for field in CASE_EDITS[name].fields
        }
        answer = self.client.ask("edit", text=self.text, record=record, edit=name, target=target, values=fields)
        assert "refused" not in answer
        sent = [each["at_ns"] for each in self.trace if str(each.get("request")) == target]
        at_ns = 0 if name in OF_THE_CASE else sent[0] if name in REQUESTS else self.trace[record]["at_ns"]
        before, self.past = self.trace, [*self.past, (self.text, self.trace)]
        self.text = answer["text"]
        self.trace = self._trace()
        if self.trace is not None:
            assert [each for each in self.trace if each["at_ns"] < at_ns] == [e for e in before if e["at_ns"] < at_ns]

    @precondition(lambda self: self.past)
    @rule()
    def undo(self) -> None:
        self.text, before = self.past.pop()
        self.trace = self._trace()
        assert self.trace == before

    @invariant()
    def the_trace_is_that_of_the_text(self) -> None:
        case, messages = self._read()
        if case is None:
            assert [each["message"] for each in self.client.ask("run", text=self.text)["errors"]] == messages
            return
        expected = run_json(self.tester.model, self.tester.execute(case))
        assert self.client.ask("trace", text=self.text) == json.loads(json.dumps(expected))

    def _read(self) -> tuple[Case | None, list[str]]:
        """Return the case of the text, or the messages of its errors."""
        try:
            return read_case(self.text, self.tester.model), []
        except InputError as error:
            return None, [each.message for each in error.diagnostics]

    @invariant()
    def what_no_button_changes_is_kept(self) -> None:
        kept, now = (parse_case(text).tree.plain for text in (self.first, self.text))
        assert isinstance(kept, dict)
        assert isinstance(now, dict)
        for key in ("case", "limits", "expect", "requirements"):
            assert now.get(key) == kept.get(key)
        assert _comments(self.text)[:4] == _comments(self.first)[:4]


TestEditSequences = pytest.mark.longer(EditSequences.TestCase)
TestEditSequences.settings = settings(examples(1_000), stateful_step_count=6)
