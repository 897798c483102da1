"""Workers that import the last test file first have the tests of all others, in the same order."""

from __future__ import annotations

from collections.abc import Generator

import pytest
from _pytest.reports import CollectReport

from support.import_order import begins_last, restore_order, reverse_files

TEXT = "def test_one(): pass\ndef test_two(): pass\n"


class BackwardImports:
    """Collects tests as a worker that begins with the last file."""

    def __init__(self) -> None:
        self.imported: list[str] = []
        self.ordered: list[str] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Generator[None, CollectReport, CollectReport]:
        report = yield
        reverse_files(collector, report)
        return report

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        self.imported = [item.nodeid for item in items]
        restore_order(items)
        self.ordered = [item.nodeid for item in items]


def test_the_last_file_is_imported_first_and_the_order_of_tests_stays(pytester: pytest.Pytester) -> None:
    files = ["test_a.py", "part/test_b.py", "part/test_c.py", "test_d.py"]
    pytester.mkdir("part")
    for file in files:
        (pytester.path / file).write_text(TEXT, encoding="utf-8")
    expected = [item.nodeid for item in pytester.inline_genitems("--import-mode=importlib", "-p", "no:xdist")[0]]
    backward = BackwardImports()
    pytester.inline_run("--collect-only", "--import-mode=importlib", "-p", "no:xdist", plugins=[backward])
    assert backward.ordered == expected
    assert backward.imported == [
        f"{file}::test_{each}" for file in reversed(by_file(expected)) for each in ("one", "two")
    ]


def by_file(ids: list[str]) -> list[str]:
    return list(dict.fromkeys(each.partition("::")[0] for each in ids))


def test_every_second_worker_begins_with_the_last_file(
    pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    begins = []
    for number in range(4):
        monkeypatch.setattr(pytestconfig, "workerinput", {"workerid": f"gw{number}"}, raising=False)
        begins.append(begins_last(pytestconfig))
    monkeypatch.delattr(pytestconfig, "workerinput")
    assert (begins, begins_last(pytestconfig)) == ([False, True, False, True], False)
