"""Workers that import the last test file first have the tests of all others, in the same order."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.import_order import BackwardImports, begins_last

TEXT = "def test_one(): pass\ndef test_two(): pass\n"
OPTIONS = ("--collect-only", "--import-mode=importlib", "-p", "no:xdist")


class Collected:
    """Notes the tests in the order of their imports, and in the order that the run has."""

    imported: tuple[str, ...] = ()
    ordered: tuple[str, ...] = ()

    def pytest_itemcollected(self, item: pytest.Item) -> None:
        self.imported += (item.nodeid,)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.ordered = tuple(item.nodeid for item in session.items)


def test_the_last_file_is_imported_first_and_the_order_of_tests_stays(pytester: pytest.Pytester) -> None:
    pytester.mkdir("part")
    for file in ("test_a.py", "part/test_b.py", "part/test_c.py", "test_d.py"):
        (pytester.path / file).write_text(TEXT, encoding="utf-8")
    forward, backward = Collected(), Collected()
    pytester.inline_run(*OPTIONS, ".", plugins=[forward])
    pytester.inline_run(*OPTIONS, ".", plugins=[backward, BackwardImports()])
    assert backward.ordered == forward.ordered == forward.imported
    files = [each.partition("::")[0] for each in forward.imported]
    assert [each.partition("::")[0] for each in backward.imported] == files[::-1]


def test_every_second_worker_begins_with_the_last_file_of_a_folder(
    pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    begins = []
    monkeypatch.setattr(pytestconfig, "args", [str(tmp_path)])
    for number in range(4):
        monkeypatch.setattr(pytestconfig, "workerinput", {"workerid": f"gw{number}"}, raising=False)
        begins.append(begins_last(pytestconfig))
    assert begins == [False, True, False, True]
    for several in ([str(tmp_path)] * 2, [f"{tmp_path}/test_a.py"]):
        monkeypatch.setattr(pytestconfig, "args", several)
        assert not begins_last(pytestconfig)
