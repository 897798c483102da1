"""`scbm help`: the section of a message, the list of all, and errors for words that are no slug."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from conftest import Ran
from scbm.model import Slug
from support.wording import Wording

Scbm = Callable[..., Ran]


def test_the_help_lists_all_slugs(scbm: Scbm) -> None:
    ran = scbm("help")
    listed = [word for line in ran.out.splitlines() if line.startswith("  ") for word in line.strip().split(", ")]
    assert (ran.code, listed) == (0, [slug.value for slug in Slug])


@pytest.mark.parametrize("given", ["unknown-key", "error[unknown-key]", "[unknown-key]:"])
def test_a_slug_is_explained_with_an_example(scbm: Scbm, given: str, wording: Wording) -> None:
    ran = scbm("help", given)
    assert (ran.code, ran.err) == (0, "")
    assert "    wrong.yaml:3:53: error[unknown-key]: " in ran.out
    wording(ran.out)


def test_links_are_shown_as_their_words(scbm: Scbm) -> None:
    shown = scbm("help", "format-version").out
    assert "](" not in shown
    assert "\n- coverage store: " in shown


@pytest.mark.parametrize("word", ["unknown-keys", "livelock", "test", "node", "nothing"])
def test_another_word_is_an_error_with_a_remedy(scbm: Scbm, word: str, wording: Wording) -> None:
    ran = scbm("help", word)
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err)
