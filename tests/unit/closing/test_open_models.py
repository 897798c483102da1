"""Closing of models in which the environment acts by transitions, resources are shared, and some values never come."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scbm.closing import Closer
from scbm.closing.assumptions import assumptions
from scbm.files import digest_of, read_model
from scbm.model import BehaviorModel
from scbm.proofcheck import check_certificate
from support.enumeration import enumerate_runs

CELL = """
behavior_model: cell
variables:
  stop: {domain: [released, pressed], initial: released, source: input}
  door: {domain: [closed, open], initial: closed, source: input}
  item: {domain: [none, box, tube], initial: none}
  done: {domain: bool, initial: false}
resources:
  scanner: {measures: [item]}
operations:
  scan:
    deadline: 5 s
    pre: {g: done == false && scanner_req_state == initial, a: [scanner_req_trigger <- true]}
    post:
      g: true
      gr: scanner_req_state == succeeded
      a: [done <- true, scanner_req_trigger <- false, scanner_req_state <- initial]
    timedout: [scanner_req_trigger <- false]
automatic_transitions:
  stopped: {g: stop == pressed && plan.state == executing, a: [plan.state <- aborted]}
  tube_seen: {g: item == tube, a: [item <- none]}
  occupied:
    g: [scanner_req_state == executing, scanner_req_trigger == false, current.name == none, door == closed]
    a: [door <- open]
goals: {done: done == true}
"""


def cell(*replacements: tuple[str, str], environment: str = "") -> BehaviorModel:
    text = CELL
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return read_model(text + (f"environment:\n{environment}" if environment else ""))


NEVER = "  press: {guard: door == open, actions: [stop <- pressed]}\n  shut: {guard: true, actions: [door <- closed]}\n"
OPENS = NEVER + "  open: {guard: true, actions: [door <- open]}\n"
NARROW = ("measures: [item]", "measures: {item: [none, box]}")
SHARED = ("{measures: [item]}", "{measures: [item], shared: true}")


@pytest.mark.parametrize(
    ("model", "obligation", "is_possible"),
    [
        (cell(), "automatic/stopped", True),
        (cell(environment=NEVER), "automatic/stopped", False),
        (cell(environment=OPENS), "automatic/stopped", True),
        (cell(), "automatic/tube_seen", True),
        (cell(NARROW), "automatic/tube_seen", False),
        (cell(), "automatic/occupied", False),
        (cell(SHARED), "automatic/occupied", True),
    ],
    ids=range(7),
)
def test_what_can_happen_outside_decides(model: BehaviorModel, obligation: str, *, is_possible: bool) -> None:
    closing = Closer(model).close()
    claimed = [claim.obligation for _, certificate in closing.certificates for claim in certificate.claims]
    assert enumerate_runs(model, is_open=True).visits(obligation) is is_possible
    assert not (is_possible and obligation in claimed)
    for _, certificate in closing.certificates:
        assert check_certificate(certificate, model) == ()
    for each in closing.cases:
        assert each.execution.verdict.failures == ()


def test_the_checker_refuses_a_proof_that_needs_values_which_are_never_sent() -> None:
    narrow, wide = cell(NARROW), cell()
    certificates = [
        certificate
        for _, certificate in Closer(narrow).close().certificates
        if any(claim.obligation == "automatic/tube_seen" for claim in certificate.claims)
    ]
    assert certificates
    for certificate in certificates:
        assert check_certificate(replace(certificate, digest=digest_of(wide)), wide) != ()


def test_assumptions_name_transitions_shared_resources_and_values_that_never_come() -> None:
    model = cell(("{measures: [item]}", "{measures: {item: [none, box]}, shared: true}"), environment=NEVER)
    certificates = [certificate for _, certificate in Closer(model).close().certificates]
    found = "\n".join(assumptions(model, certificates))
    assert "only environment transitions change these: stop, door." in found
    assert "Others use these resources, while no request to them is in flight: scanner." in found
    assert "The resource scanner sends only these for item: none, box." in found
    assert "Inputs change" not in found
    assert "Only the model" not in found
