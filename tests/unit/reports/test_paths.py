"""Paths as tools on other machines read them."""

from __future__ import annotations

import pytest

from scbm.reports.ci.xml_text import is_absolute, portable


@pytest.mark.parametrize(
    ("path", "expected", "absolute"),
    [
        ("cell.yaml", "cell.yaml", False),
        ("./a//b/../cell.yaml", "a/cell.yaml", False),
        ("../cell.yaml", "../cell.yaml", False),
        ("a\\b\\cell.yaml", "a/b/cell.yaml", False),
        ("/a/./cell.yaml", "/a/cell.yaml", True),
        ("C:\\a\\cell.yaml", "C:/a/cell.yaml", True),
        ("\\\\server\\a.yaml", "//server/a.yaml", True),
        ("c:cell.yaml", "c:cell.yaml", False),
    ],
)
def test_a_path_has_forward_slashes_and_no_detours(path: str, expected: str, absolute: bool) -> None:  # noqa: FBT001 - a row of the table
    assert portable(path) == expected
    assert is_absolute(expected) is absolute
