"""Every case that a file can say is written as a file that says the same."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.files import read_case, read_network, write_case, write_network
from scbm.files.record_editing import with_record
from support.case_strategies import cases, networks, recorded_runs
from support.profiles import examples
from support.strategies import open_models, running_models


@pytest.mark.longer
@given(st.data())
@examples(150, usual=3)
def test_cases(data: st.DataObject) -> None:
    model = data.draw(st.one_of(running_models(), open_models()))
    case = data.draw(cases(model))
    written = write_case(case, model, "cell.yaml", ["drawn"])
    again = read_case(written, model)
    assert again == case
    assert write_case(again, model, "cell.yaml", ["drawn"]) == written


@pytest.mark.slow
@given(st.data())
@examples(100, usual=5)
def test_the_recorded_run_of_a_written_case_can_be_replaced(data: st.DataObject) -> None:
    model = data.draw(st.one_of(running_models(), open_models()))
    case, run = data.draw(cases(model)), data.draw(recorded_runs(model))
    edited = with_record(write_case(case, model, "cell.yaml", ["drawn"]), "case.yaml", run, model)
    assert edited == write_case(replace(case, recorded=run), model, "cell.yaml", ["drawn"])


@given(st.data())
@examples(60)
def test_networks(data: st.DataObject) -> None:
    model = data.draw(running_models())
    network = data.draw(networks(model, drawn=True))
    assert read_network(write_network(network), model) == network
