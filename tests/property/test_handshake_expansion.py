"""Handshakes: the expansion of random models equals a naive one, which puts texts together line by line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.closing.advice.handshake_doubts import doubts_about_handshakes
from scbm.closing.advice.request_doubts import doubts_about_requests
from scbm.files import digest_of, read_model, write_model
from support.profiles import examples

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn

HEAD = """behavior_model: cell
variables:
  lamp: {domain: bool, initial: false}
  n: {domain: 0..3, initial: 0}
  at: {domain: [home, box], initial: home}
  goal: {domain: [home, box], initial: home}
  speed: {domain: 0..3, initial: 0}
  seen: {domain: 0..3, initial: 0}
  lit: {domain: bool, initial: false}
resources:
  arm: {request: [goal, speed], measures: {seen: [0, 1, 2, 3]}}
  lift: {request: [speed]}
  light: {measures: {lit: [true, false], seen: [3, 1]}}
operations:
"""
CARRIED = {"arm": ("goal", "speed"), "lift": ("speed",), "light": ()}
MEASURED = {"arm": ("seen",), "lift": (), "light": ("lit", "seen")}
ASSUMED = {"seen": ("3", "n", "speed"), "lit": ("true", "lamp")}
VALUES = {"goal": ("home", "box", "at", "goal"), "speed": ("0", "3", "n", "speed")}
GUARDS = ("lamp == true", "n < 3 && at == home", "lamp == false || n == 2", "at == goal -> !(n in {1, 2})")
ACTIONS = ("lamp <- true", "n += 1", "at <- goal")


@dataclass(frozen=True)
class Written:
    """What an operation of a random model says; empty texts and lists are left out of the file."""

    name: str
    resource: str
    payload: dict[str, str]
    guard: str
    assumes: dict[str, str]
    effects: list[str]
    on_timeout: list[str]
    deadline: bool
    running_guard: str
    more_actions: list[str]

    def short(self) -> str:
        """The operation with `request`."""
        lines = [f"  {self.name}:", f"    request: {self.resource}"]
        payload = ", ".join(f"{name}: {value}" for name, value in self.payload.items())
        lines += [f"    with: {{{payload}}}"] if self.payload else []
        lines += ["    deadline: 5 s"] if self.deadline else []
        lines += [f"    guard: {self.guard!r}"] if self.guard else []
        assumed = ", ".join(f"{name}: {value}" for name, value in self.assumes.items())
        lines += [f"    assumes: {{{assumed}}}"] if assumed else []
        lines += [f"    effects: {self.effects}"] if self.effects else []
        lines += [f"    on_timeout: {self.on_timeout}"] if self.on_timeout else []
        lines += [f"    pre: {{gr: {self.running_guard!r}}}"] if self.running_guard else []
        lines += [f"    post: {{ar: {self.more_actions}}}"] if self.more_actions else []
        return "\n".join(lines) + "\n"

    def long(self) -> str:
        """The operation with the whole protocol."""
        state, trigger = f"{self.resource}_req_state", f"{self.resource}_req_trigger"
        guard = f" && ({self.guard})" if "||" in self.guard or "->" in self.guard else f" && {self.guard}"
        payload = [f"{name} <- {value}" for name, value in self.payload.items()]
        assumed = [f"{name} <- {value}" for name, value in self.assumes.items()]
        lines = [
            f"  {self.name}:",
            "    pre:",
            f"      g: {state} == initial && {trigger} == false{guard if self.guard else ''}",
            f"      gr: {self.running_guard or 'true'}",
            f"      a: {[f'{trigger} <- true', *payload]}",
            "    post:",
            "      g: true",
            f"      gr: {' && '.join([f'{state} == succeeded', *(f'{n} == {v}' for n, v in self.assumes.items())])}",
            f"      a: {[f'{state} <- initial', f'{trigger} <- false', *assumed, *self.effects]}",
            f"      ar: {self.more_actions}",
        ]
        timedout = [f"    timedout: {[f'{trigger} <- false', *self.on_timeout]}", "    deadline: 5 s"]
        return "\n".join([*lines, *(timedout if self.deadline else [])]) + "\n"


@st.composite
def operations(draw: DrawFn, name: str) -> Written:
    resource = draw(st.sampled_from(sorted(CARRIED)))
    actions = draw(st.permutations(ACTIONS))
    split = draw(st.integers(0, 3))
    deadline = draw(st.booleans())
    return Written(
        name,
        resource,
        {variable: draw(st.sampled_from(VALUES[variable])) for variable in draw(st.permutations(CARRIED[resource]))},
        draw(st.sampled_from(("", *GUARDS))),
        {variable: draw(st.sampled_from(ASSUMED[variable])) for variable in MEASURED[resource] if draw(st.booleans())},
        actions[:split],
        draw(st.lists(st.sampled_from(ACTIONS), max_size=3, unique=True)) if deadline else [],
        deadline,
        draw(st.sampled_from(("", *GUARDS))),
        actions[split : draw(st.integers(split, 3))],
    )


def failures(written: list[Written]) -> str:
    """The automatic transitions for the resources that are asked, and for what operations assume, in this order."""
    asked = [resource for resource in CARRIED if any(each.resource == resource for each in written)]
    failed = "".join(
        f"  {name}_failed:\n"
        f"    g: {name}_req_state == failed && current.state == executing\n"
        f"    a: [current.state <- failed, {name}_req_state <- initial, {name}_req_trigger <- false]\n"
        for name in asked
    )
    otherwise = "".join(
        f"  {each.name}_otherwise:\n"
        f"    g: {each.name}.state == executing && {each.resource}_req_state == succeeded\n"
        f"      && ({' || '.join(f'{name} != {value}' for name, value in each.assumes.items())})\n"
        f"    a: [{each.name}.state <- failed, {each.resource}_req_state <- initial,"
        f" {each.resource}_req_trigger <- false]\n"
        for each in written
        if each.assumes
    )
    return failed + otherwise


MODELS = st.integers(1, 4).flatmap(lambda number: st.tuples(*(operations(f"go_{n}") for n in range(number))))
RULE = "automatic_transitions:\n  rule: {g: n == 3, a: [n <- 0]}\n"


@given(MODELS)
@examples(300, usual=10)
def test_the_expansion_equals_a_naive_one(written: tuple[Written, ...]) -> None:
    short = read_model(f"{HEAD}{''.join(each.short() for each in written)}{RULE}")
    long = read_model(f"{HEAD}{''.join(each.long() for each in written)}{RULE}{failures(list(written))}")
    assert short == long
    assert digest_of(short) == digest_of(long)
    assert write_model(short) == write_model(long)


@pytest.mark.slow
@given(MODELS)
@examples(300)
def test_whole_handshakes_raise_no_doubt(written: tuple[Written, ...]) -> None:
    model = read_model(f"{HEAD}{''.join(each.long() for each in written)}{RULE}{failures(list(written))}")
    assert not [*doubts_about_requests(model), *doubts_about_handshakes(model)]


def _lines(written: Written) -> dict[str, str]:
    """Return the lines of the protocol of an operation, each with the key of the transition that has it."""
    state, trigger = f"{written.resource}_req_state", f"{written.resource}_req_trigger"
    lines = {f"{state} == initial && ": "g", f" && {trigger} == false": "g", f"'{trigger} <- true', ": "a"}
    return lines if written.payload else {line: key for line, key in lines.items() if "<-" not in line}


@pytest.mark.slow
@given(MODELS, st.data())
@examples(300)
def test_a_missing_line_of_an_operation_raises_one_doubt(written: tuple[Written, ...], data: st.DataObject) -> None:
    changed = data.draw(st.sampled_from(written))
    line, key = data.draw(st.sampled_from(sorted(_lines(changed).items())))
    assert line in changed.long()
    lacking = [each.long().replace(line, "", 1) if each is changed else each.long() for each in written]
    model = read_model(f"{HEAD}{''.join(lacking)}{RULE}{failures(list(written))}")
    (doubt,) = doubts_about_handshakes(model)
    assert doubt.path == ("operations", changed.name, "pre", key)
