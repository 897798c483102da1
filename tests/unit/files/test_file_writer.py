"""Files are written whole or not at all, and never over what the command reads."""

import os
import stat
from pathlib import Path

import pytest

from scbm.files.file_writer import FileWriter, replace_file
from scbm.model import InputError
from support.limits import largest_file
from support.wording import Wording


def test_a_file_is_replaced_and_nothing_else_stays(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before", encoding="utf-8")
    replace_file(path, b"after")
    assert [(p.name, p.read_text(encoding="utf-8")) for p in tmp_path.iterdir()] == [("a.txt", "after")]


def test_a_file_that_does_not_fit_on_the_disk_stays_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before", encoding="utf-8")
    with largest_file(1000), pytest.raises(OSError) as failed:  # noqa: PT011 - which error is a matter of the system
        replace_file(path, b"x" * 2000)
    assert failed.value.filename == str(path)
    assert [(p.name, p.read_text(encoding="utf-8")) for p in tmp_path.iterdir()] == [("a.txt", "before")]


def test_a_replaced_file_keeps_its_permissions_and_a_new_one_gets_those_of_the_umask(tmp_path: Path) -> None:
    path, new, usual = tmp_path / "a.txt", tmp_path / "new.txt", tmp_path / "usual.txt"
    path.write_text("before", encoding="utf-8")
    path.chmod(0o604)
    usual.touch()
    replace_file(path, b"after")
    replace_file(new, b"after")
    assert stat.S_IMODE(path.stat().st_mode) == 0o604
    assert new.stat().st_mode == usual.stat().st_mode


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everything")
def test_a_read_only_file_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before", encoding="utf-8")
    path.chmod(0o400)
    with pytest.raises(PermissionError):
        replace_file(path, b"after")
    assert path.read_text(encoding="utf-8") == "before"


def test_a_symbolic_link_stays_one(tmp_path: Path) -> None:
    path, link = tmp_path / "a.txt", tmp_path / "link.txt"
    path.write_text("before", encoding="utf-8")
    link.symlink_to("a.txt")
    replace_file(link, b"after")
    assert (link.is_symlink(), path.read_text(encoding="utf-8")) == (True, "after")


def test_a_pipe_takes_the_content_as_it_comes(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        replace_file(pipe, b"content")
        assert os.read(reader, 100) == b"content"
    finally:
        os.close(reader)


def test_a_file_that_has_the_name_of_the_temporary_file_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = iter([b"\1", b"\1", b"\2"])
    monkeypatch.setattr("scbm.files.file_writer.urandom", lambda _: next(numbers))
    (tmp_path / ".scbm-01.part").write_bytes(b"other content")
    (tmp_path / "a.txt.part").write_bytes(b"other content")
    replace_file(tmp_path / "a.txt", b"content")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        ".scbm-01.part": b"other content",
        "a.txt.part": b"other content",
        "a.txt": b"content",
    }


def test_a_name_as_long_as_names_may_be_can_be_written(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 255)
    replace_file(path, b"content")
    assert path.read_bytes() == b"content"


@pytest.mark.parametrize("name", ["m.yaml", "./m.yaml", "sub/../m.yaml", "symbolic.yaml", "hard.yaml"])
def test_an_input_is_not_overwritten_under_any_of_its_names(name: str, tmp_path: Path, wording: Wording) -> None:
    model = tmp_path / "m.yaml"
    model.write_text("the model", encoding="utf-8")
    (tmp_path / "sub").mkdir()
    (tmp_path / "symbolic.yaml").symlink_to(model)
    (tmp_path / "hard.yaml").hardlink_to(model)
    writer = FileWriter([(model, "the model")])
    with wording.raises(InputError):
        writer.write("--trace", tmp_path / name, b"trace")
    with wording.raises(InputError):
        writer.write_all({tmp_path / "new.yaml": "new", tmp_path / name: "case"}, overwrite=True)
    assert model.read_text(encoding="utf-8") == "the model"
    assert not (tmp_path / "new.yaml").exists()


def test_two_outputs_in_one_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        FileWriter().refuse_clashes(
            {"--junit": tmp_path / "a", "--lcov": tmp_path / "." / "a", "--html": tmp_path / "b"}
        )
    assert [str(diagnostic.place) for diagnostic in refused.value.diagnostics] == ["--lcov"]


def test_a_file_that_has_its_text_already_is_left_alone(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("text", encoding="utf-8")
    FileWriter([(path, "a case file")]).write_all({path: "text"}, overwrite=False)
    with wording.raises(InputError):
        FileWriter().write_all({tmp_path / "b.yaml": "new", path: "other"}, overwrite=False)
    assert [p.name for p in tmp_path.iterdir()] == ["a.yaml"]


def test_a_text_with_a_file_name_that_is_not_utf_8_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        FileWriter().write_all({tmp_path / "case.yaml": "model: bad\udcff.yaml\n"}, overwrite=False)
    (found,) = refused.value.diagnostics
    assert (found.place.file, found.remedy) == (str(tmp_path / "case.yaml"), "rename that file")
    assert list(tmp_path.iterdir()) == []
