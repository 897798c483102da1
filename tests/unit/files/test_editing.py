"""Goals are added to model files, and nothing else changes: neither what they say nor how they say it."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import is_model_text, read_model
from scbm.files.goal_editing import add_goals, with_goals
from scbm.model import BehaviorModel, InputError, Slug
from support.profiles import longer_but_one_in
from support.wording import Wording

ROOT = Path(__file__).parents[3]
MODELS = [
    *sorted((ROOT / "examples").rglob("*.yaml")),
    *sorted((ROOT / "tests" / "models" / "valid").glob("*.yaml")),
    ROOT / "tests" / "models" / "cell.yaml",
]
TEXTS = {path.name: path.read_text(encoding="utf-8") for path in MODELS}
TEXTS = {name: text for name, text in TEXTS.items() if is_model_text(text) and "\ninterfaces:" not in text}

HEAD = """\
behavior_model: cell
variables:
  at: {domain: [home, box], initial: home}  # where the robot is
  done: {domain: bool, initial: false}
operations: {}
"""
BACK = ("back", "at == home", None)
SET = ("somewhere", "at in {home, box}", "needed by nothing")
NEVER = ("undone", "!(done == true)", None)


def _added(text: str, *goals: tuple[str, str, str | None]) -> str:
    edited = with_goals(text, "model", goals)  # the default name of `read_model`, so each text is read once
    _same_but_goals(text, edited, [name for name, _, _ in goals])
    return edited


def _same_but_goals(text: str, edited: str, names: list[str]) -> None:
    old, new = read_model(text), read_model(edited)
    assert new.goals[: len(old.goals)] == old.goals
    assert [name for name, _ in new.goals[len(old.goals) :]] == names
    assert _without_goals(new) == _without_goals(old)


def _without_goals(model: BehaviorModel) -> tuple[object, ...]:
    return tuple(getattr(model, name) for name in model.__struct_fields__ if name != "goals")


def test_a_block_gets_lines_behind_its_last_entry_in_its_indentation() -> None:
    text = HEAD + "goals:\n    boxed: at == box\n      && done == true   # both\n\n# what must hold\nrequirements: {}\n"
    lines = "    # needed by nothing\n    somewhere: at in {home, box}\n    undone: '!(done == true)'\n"
    assert _added(text, SET, NEVER) == text.replace("   # both\n", f"   # both\n{lines}")


def test_comments_of_the_section_stay_before_what_is_added() -> None:
    text = HEAD + "goals:\n  boxed: at == box\n  # old: done == true\n# of the next one\nrequirements: {}\n"
    assert _added(text, BACK) == text.replace("# of the", "  back: at == home\n# of the")


@pytest.mark.parametrize(
    "value",
    ["[at == box, done == true]", "\n    - at == box\n    - done == true", "|\n    at == box\n    && done == true",
     ">-\n    at == box\n\n", "'at == box'", "&p at == box", "at ==\n    box"],
)  # fmt: skip
def test_the_last_entry_may_be_of_any_style(value: str) -> None:
    text = HEAD + f"goals:\n  boxed: {value}\n"
    edited = _added(text, BACK)
    assert edited.rstrip().endswith("\n  back: at == home")
    assert edited.replace("  back: at == home\n", "") == text


def test_entries_with_blank_lines_between_them_get_one_more() -> None:
    text = HEAD + "goals:\n  a: at == box\n\n  # the other\n  b: done == true\n"
    assert _added(text, BACK) == f"{text}\n  back: at == home\n"


def test_an_alias_does_not_lead_astray() -> None:
    text = HEAD + "initial_states: &p at == home\ngoals:\n  a: *p\nrequirements: {}\n"
    assert _added(text, BACK) == text.replace("a: *p\n", "a: *p\n  back: at == home\n")


def test_braces_on_one_line_stay_there() -> None:
    text = HEAD + "goals: {boxed: at == box}  # one\nrequirements: {}\n"
    added = "{boxed: at == box, back: at == home, somewhere: 'at in {home, box}'}"
    assert _added(text, BACK, SET) == text.replace("{boxed: at == box}", added)
    text = HEAD + "goals: { boxed: at == box, }\n"
    assert _added(text, BACK) == text.replace("box, }", "box, back: at == home, }")


@pytest.mark.parametrize("comma", ["", ",", " ,  # the last, one", "  # the last, one"])
def test_braces_over_lines_get_lines(comma: str) -> None:
    text = HEAD + f"goals: {{\n  a: done == true,\n  b: at == box{comma}\n}}\n"
    edited = _added(text, BACK, SET)
    quoted = "  # needed by nothing\n  somewhere: 'at in {home, box}'"
    assert f"\n  back: at == home,\n{quoted}{',' if ',' in comma.partition('#')[0] else ''}\n}}\n" in edited
    assert comma.strip().removeprefix(",") in edited


def test_braces_that_close_in_the_last_line() -> None:
    text = HEAD + "goals: {a: done == true,\n        b: at == box }\nrequirements: {}\n"
    assert _added(text, BACK) == text.replace("b: at == box", "b: at == box,\n        back: at == home")


@pytest.mark.parametrize("braces", ["{}", "{ }", "  {}"])
def test_empty_braces_become_lines(braces: str) -> None:
    text = HEAD + f"goals: {braces} # none yet\nrequirements: {{}}\n"
    assert _added(text, SET) == text.replace(
        f"goals: {braces} # none yet\n",
        "goals: # none yet\n  # needed by nothing\n  somewhere: at in {home, box}\n",
    )


def test_empty_braces_with_a_comment_inside_keep_it() -> None:
    assert "# none yet\n}" in _added(HEAD + "goals: {\n  # none yet\n}\n", BACK)


def test_a_file_without_goals_gets_a_section() -> None:
    assert _added(HEAD, BACK) == f"{HEAD}goals:\n  back: at == home\n"
    spaced = HEAD.replace("variables:", "\nvariables:").replace("  ", "    ")
    assert _added(spaced, BACK) == f"{spaced}\ngoals:\n    back: at == home\n"
    assert _added(f"{spaced}# the end\n\n\n", BACK) == f"{spaced}# the end\n\ngoals:\n    back: at == home\n\n\n"


def test_the_end_of_the_document_stays_behind() -> None:
    assert _added(f"---\n{HEAD}...\n", BACK) == f"---\n{HEAD}goals:\n  back: at == home\n...\n"


def test_a_file_that_is_indented_gets_an_indented_section() -> None:
    text = "".join(f"  {line}\n" for line in HEAD.splitlines())
    assert _added(text, BACK) == f"{text}  goals:\n    back: at == home\n"


def test_a_file_in_braces_stays_in_braces() -> None:
    text = "{behavior_model: cell, variables: {at: {domain: [home, box], initial: home}}, operations: {}}\n"
    added = ", goals: {back: at == home, somewhere: 'at in {home, box}'}}\n"
    assert _added(text, BACK, SET) == text.replace("{}}\n", "{}" + added)
    assert _added(text.replace("{}}", "{}, goals: {}}"), BACK).endswith("goals: {back: at == home}}\n")


@pytest.mark.parametrize("section", ["", "goals: {}\n", "goals:\n  boxed: at == box\n", "goals: {boxed: at == box}\n"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("is_ended", [True, False])
@pytest.mark.parametrize("mark", ["", "\N{BYTE ORDER MARK}"])
def test_ends_of_lines_and_of_the_file_stay_as_they_are(
    section: str,
    line_end: str,
    is_ended: bool,  # noqa: FBT001
    mark: str,
) -> None:
    text = mark + (HEAD + section).replace("\n", line_end)
    text = text if is_ended else text.removesuffix(line_end)
    edited = _added(text, BACK)
    assert edited.startswith(mark + "behavior_model")
    assert edited.endswith(line_end) is is_ended
    without = edited.replace("\r\n", "")
    assert line_end == "\r\n" or line_end in edited
    assert line_end != "\r\n" or ("\n" not in without and "\r" not in without)


@pytest.mark.parametrize(
    "predicate",
    ["!(done == true)", "at in {home, box}", "true", "(done == true)", "done == true -> at == home",
     "!done == true || at == box"],
)  # fmt: skip
@pytest.mark.parametrize("section", ["", "goals: {a: at == box}\n", "goals:\n  a: at == box\n"])
def test_predicates_get_quotes_where_they_need_them(predicate: str, section: str) -> None:
    try:
        read_model(HEAD + f'goals: {{x: "{predicate}"}}\n')
    except InputError:
        pytest.skip("no predicate of this language")
    _added(HEAD + section, ("x", predicate, None))


@pytest.mark.parametrize("text", longer_but_one_in(3, list(TEXTS.values())), ids=list(TEXTS))
def test_every_model_of_the_repository_can_be_edited(text: str) -> None:
    goals = [("added_1", "true", "a comment\nof two lines"), ("added_2", "!(false)", None)]
    edited = _added(text, *goals)
    kept = iter(edited.splitlines())
    changed = [line for line in text.splitlines() if line not in kept]
    assert all("{" in line for line in changed), "only what stands in braces is not kept line by line"
    _added(edited, ("added_3", "true", None))


@given(
    st.lists(st.sampled_from(["", " ", "# c", "  # c", "    # c"]), max_size=4),
    st.sampled_from(["  a: at == box", "  a:\n    - at == box", "  a: |\n    at == box", "  a: at == box # here"]),
    st.sampled_from(["", "requirements: {}\n", "\n# next\nrequirements:\n  r: always done == false\n", "...\n"]),
)
def test_whatever_stands_behind_the_goals_stays(between: list[str], entry: str, rest: str) -> None:
    text = HEAD + "goals:\n" + entry + "\n" + "".join(f"{line}\n" for line in between) + rest
    edited = _added(text, BACK)
    assert edited.replace("  back: at == home\n", "") == text


# what cannot be


def _wrong(text: str, *goals: tuple[str, str, str | None]) -> InputError:
    with pytest.raises(InputError) as raised:
        with_goals(text, "cell.yaml", goals)
    return raised.value


def test_goals_that_are_an_alias_are_left_to_people() -> None:
    text = HEAD + "requirements: {}\n"
    text = text.replace("operations: {}", "operations: &none {}") + "goals: *none\n"
    (diagnostic,) = _wrong(text, NEVER).diagnostics
    assert (diagnostic.slug, diagnostic.place.line) == (Slug.WRONG_SHAPE, 7)
    assert diagnostic.remedy == "add it by hand: `undone: '!(done == true)'`"
    assert diagnostic.source_line == "goals: *none"


def test_keys_with_question_marks_are_left_to_people() -> None:
    (diagnostic,) = _wrong(HEAD + "goals:\n  ? a\n  : at == box\n", BACK).diagnostics
    assert (diagnostic.slug, diagnostic.place.line) == (Slug.WRONG_SHAPE, 6)


def test_a_goal_that_is_there_is_not_added_again() -> None:
    text = HEAD + "goals:\n  back: (at == home)\n"
    assert with_goals(text, "cell.yaml", [BACK]) == text
    assert with_goals(text, "cell.yaml", [BACK, NEVER]) == with_goals(text, "cell.yaml", [NEVER])


def test_a_name_that_is_taken_is_an_error() -> None:
    error = _wrong(HEAD + "goals: {back: at == box}\n", BACK)
    assert [diagnostic.slug for diagnostic in error.diagnostics] == [Slug.DUPLICATE_NAME]
    assert [d.slug for d in _wrong(HEAD, BACK, BACK).diagnostics] == [Slug.DUPLICATE_NAME]


def test_what_is_no_predicate_of_the_model_is_an_error() -> None:
    error = _wrong(HEAD, ("x", "at == hom", None))
    assert [diagnostic.slug for diagnostic in error.diagnostics] == [Slug.VALUE_OUTSIDE_DOMAIN]
    assert str(error).startswith("x:1:7: ")


def test_a_file_with_errors_is_not_edited() -> None:
    assert _wrong("behavior_model: x\n", BACK).diagnostics[0].slug is Slug.MISSING_KEY


# files


def test_a_file_is_replaced_with_its_rights_and_through_links(tmp_path: Path) -> None:
    path = tmp_path / "below" / "cell.yaml"
    path.parent.mkdir()
    path.write_bytes(HEAD.replace("\n", "\r\n").encode())
    path.chmod(0o640)
    link = tmp_path / "link.yaml"
    link.symlink_to(path)
    add_goals(link, [BACK])
    assert link.is_symlink()
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert path.read_bytes().endswith(b"operations: {}\r\ngoals:\r\n  back: at == home\r\n")
    assert [entry.name for entry in path.parent.iterdir()] == ["cell.yaml"]


def test_a_file_that_cannot_be_edited_is_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(HEAD, encoding="utf-8")
    with pytest.raises(InputError):
        add_goals(path, [BACK, ("x", "at == hom", None)])
    assert path.read_text(encoding="utf-8") == HEAD


def test_a_file_that_cannot_be_written_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(HEAD, encoding="utf-8")

    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(InputError) as raised:
        add_goals(path, [BACK])
    (diagnostic,) = raised.value.diagnostics
    assert (diagnostic.slug, str(diagnostic.place)) == (Slug.BAD_OPTION, str(path))
    wording(diagnostic.message)
    assert [entry.name for entry in tmp_path.iterdir()] == ["cell.yaml"]
    assert path.read_text(encoding="utf-8") == HEAD
    monkeypatch.setattr("scbm.files.file_writer.os.access", lambda *_: False)
    with wording.raises(InputError):
        add_goals(path, [BACK])
