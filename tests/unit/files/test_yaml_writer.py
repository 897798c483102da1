"""What is laid out fast is laid out as ruamel.yaml does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import load_model
from scbm.files.codec.model_keys import ModelKeys
from scbm.files.yaml.yaml_writer import FlowList, FlowMapping, Quoted, _Layout, dump, dump_all
from support.profiles import examples

TEXTS = st.one_of(
    st.sampled_from([*"~-?*&!|>%@`=,", "", "a", "robot_at == home", "x <- true", "it's", '"q"', "a: b", "a, b", "[x]"]),
    st.sampled_from(["true", "True", "no", "y", "null", "1", "1e3", "0x1f", "12:30", "2020-01-01", ".inf", "<<"]),
    st.sampled_from(["a #b", "# c", "- a", "? a", "a -", "a ---", "a.", "a\tb", "a ", "a\nb", "\x85", "é", "x" * 140]),
    st.text("aZ_0.:-&#,[]{} =<>|()'\"\n", max_size=8),
)
SCALARS = st.one_of(
    TEXTS, TEXTS, TEXTS.map(Quoted), st.booleans(), st.none(), st.sampled_from([0, 1, -3, 10**12, 0.0, -0.0, 1.0, 0.5])
)


def _more(parts: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    lists, mappings = st.lists(parts, max_size=3), st.dictionaries(TEXTS, parts, max_size=3)
    return st.one_of(lists, mappings, lists.map(FlowList), mappings.map(FlowMapping))


@pytest.mark.slow
@examples(600)
@given(st.dictionaries(TEXTS, st.recursive(SCALARS, _more, max_leaves=12), max_size=4), st.booleans())
def test_data_is_written_as_ruamel_writes_it(data: dict[str, Any], short_in_flow: bool) -> None:  # noqa: FBT001 - drawn
    assert dump(data, short_in_flow=short_in_flow) == dump_all(data, short_in_flow=short_in_flow)


@pytest.mark.parametrize("name", ["robot_in_the_air/after.yaml", "dual_cnc/cell.yaml", "packml/cell.yaml"])
def test_models_have_a_fast_layout(name: str) -> None:
    data = ModelKeys.write(load_model(Path(__file__).parents[3] / "examples" / name))
    assert _Layout(short_in_flow=True).text(data) == dump_all(data, short_in_flow=True)
