"""XML files: whatever a text says, a parser that is not ours reads it."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from scbm.model.visible_text import escaped
from scbm.reports.ci.xml_text import xml_text

ANY = st.text(st.characters(codec=None, categories=None, max_codepoint=0x10FFFF))


@given(ANY, ANY)
def test_a_text_and_an_attribute_come_back_as_they_can_be_seen(text: str, value: str) -> None:
    root = Element("a", {"b": value})
    root.text = text
    read = etree.fromstring(xml_text(root).encode())
    assert read.get("b") == escaped(value)
    assert (read.text or "") == escaped(text).replace("\r\n", "\n")
