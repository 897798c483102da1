"""The errors of wrong cases that `src/scbm/cli/messages.md` shows are those that are printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scbm.cli.message_sections import message_groups
from scbm.files import is_model_text, load_model, open_case, read_model
from scbm.model import InputError

ROOT = Path(__file__).parents[2]
(SECTIONS,) = (group.sections for group in message_groups() if group.title == "Test cases")


def blocks(section: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", section, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("slug", SECTIONS)
def test_the_message_of_a_wrong_case_is_that_of_its_section(slug: str, tmp_path: Path) -> None:
    texts = blocks(SECTIONS[slug], "yaml")
    path = tmp_path / "wrong_case.yaml"
    path.write_text(next(text for text in texts if not is_model_text(text)), encoding="utf-8")
    models = [read_model(text) for text in texts if is_model_text(text)]
    model = models[0] if models else load_model(ROOT / "examples" / "robot_in_the_air" / "after.yaml")
    document = open_case(path)

    def read_and_find_the_model() -> None:
        document.read(model)
        document.required_model_path()

    with pytest.raises(InputError) as raised:
        read_and_find_the_model()
    printed = str(raised.value).replace(f"{tmp_path}/", "")
    (shown,) = blocks(SECTIONS[slug], "text")
    assert shown == f"{printed}\n"


def test_there_are_messages_to_try() -> None:
    assert len(SECTIONS) >= 12
