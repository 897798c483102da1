"""Only regular files are read: pipes and devices are refused, and of a file that is too large nothing is read."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from scbm.files import open_input, read_file
from scbm.files.file_writer import FileWriter
from scbm.model import InputError, Slug
from support.wording import Wording


def irregular(kind: str, directory: Path) -> Path:
    path = directory / "input.yaml"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(path))
    else:
        path.symlink_to("/dev/zero")
    return path


@pytest.mark.parametrize("kind", ["pipe", "socket", "device"])
def test_what_is_no_regular_file_is_refused_before_it_is_opened(kind: str, tmp_path: Path, wording: Wording) -> None:
    with wording.raises(InputError) as refused:
        read_file(irregular(kind, tmp_path))
    assert [diagnostic.slug for diagnostic in refused.value.diagnostics] == [Slug.FILE_UNREADABLE]


def test_a_link_to_a_regular_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"text")
    (tmp_path / "link").symlink_to("a")
    with open_input(tmp_path / "link") as stream:
        assert stream.read() == b"text"


def test_nothing_is_read_of_a_file_that_is_too_large(tmp_path: Path) -> None:
    path = tmp_path / "large"
    path.touch()
    os.truncate(path, 2**40)
    with pytest.raises(InputError) as refused:
        read_file(path)
    assert [diagnostic.slug for diagnostic in refused.value.diagnostics] == [Slug.FILE_TOO_LARGE]


def test_a_pipe_among_the_outputs_is_not_compared_with_its_new_content(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        FileWriter().write_all({irregular("pipe", tmp_path): "text"}, overwrite=False)
