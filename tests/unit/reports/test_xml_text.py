"""XML files: whatever a text says, a parser that is not ours reads it."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from scbm.reports.ci.xml_text import visible, xml_text

ANY = st.text(st.characters(codec=None, categories=None, max_codepoint=0x10FFFF))


@given(ANY, ANY)
def test_a_text_and_an_attribute_come_back_as_they_can_be_seen(text: str, value: str) -> None:
    root = Element("a", {"b": value})
    root.text = text
    read = etree.fromstring(xml_text(root).encode())
    assert read.get("b") == visible(value)
    assert (read.text or "") == visible(text).replace("\r\n", "\n").replace("\r", "\n")


@pytest.mark.parametrize(
    ("text", "seen"),
    [("a\x00\x1fb", "a␀␟b"), ("\ud800\uffff", "\ufffd\ufffd"), ("\t\n\r ü模😀", "\t\n\r ü模😀")],
)
def test_only_what_xml_forbids_is_replaced(text: str, seen: str) -> None:
    assert visible(text) == seen
