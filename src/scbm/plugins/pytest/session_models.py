"""The models of a session, each loaded once, and the results of their cases.

Results are those of a session, or of one of its workers: by model, in the order of the tests.
"""

from __future__ import annotations

import pickle
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec import Struct
from msgspec.structs import replace

from scbm.files import load_model, real_path, without_detours
from scbm.model import InputError, PlannerChoice
from scbm.model.visible_text import shell_word
from scbm.testing import Campaign, Tester
from scbm.testing.planner_override import override_planner, refuse_unknown_planner
from scbm.testing.written_cases import RecordingMode, recordings_of, write_recordings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.testing import CaseResult, Execution
    from scbm.testing.written_cases import WrittenCase


_PREFIX = "--scbm-"
"""The prefix of the options of the plugin."""


def planner_asked_for(config: pytest.Config) -> PlannerChoice:
    """Return the planner and the limits of the options, which replace those of every model."""
    names = ("planner", "max-length", "max-expanded")
    return PlannerChoice(*(config.getoption(f"{_PREFIX}{name}") for name in names))


def planner_words(config: pytest.Config) -> str:
    """Return the options for the planner as `scbm replay` takes them, each with a leading blank."""
    asked = planner_asked_for(config)
    given = (("--planner", asked.name), ("--max-length", asked.max_length), ("--max-expanded", asked.max_expanded))
    return "".join(f" {option} {shell_word(str(value))}" for option, value in given if value is not None)


def refuse_unknown(config: pytest.Config) -> None:
    """Raise `UsageError` if there is no planner of the name that the options have."""
    try:
        refuse_unknown_planner(planner_asked_for(config).name, _PREFIX)
    except InputError as error:
        raise pytest.UsageError("\n".join(map(str, error.diagnostics))) from None


class ModelResults(StrEnum):
    """Where a case comes from."""

    FILE = "case file"
    TEST = "case of a test"
    RANDOM = "random case"


class TestResult(Struct, frozen=True):
    """A case that was run.

    Attributes:
        model: the file of its model.
        test: the node id of the test that ran it.
        number: which case of its process it is.
        group: where the case comes from.
        result: its result.
        position: which of all tests its test is, once that is known.
    """

    model: str
    test: str
    number: int
    group: ModelResults
    result: CaseResult
    position: int | None = None


class SessionPart(Struct, frozen=True):
    """All cases of one model.

    Attributes:
        file: the model file, as messages show it.
        path: the same, resolved.
        entries: the cases, in the order of the tests.
        campaign: the results of the cases.
        groups: how many cases came from where.
    """

    file: str
    path: Path
    entries: tuple[TestResult, ...]
    campaign: Campaign
    groups: dict[ModelResults, int]


class SessionResults:
    """Keeps results. Each worker of pytest-xdist sends its results as one text."""

    def __init__(self) -> None:
        self._models: dict[str, tuple[str, BehaviorModel]] = {}
        self._entries: list[TestResult] = []
        self._recordings: dict[str, tuple[str, ...]] = {}

    def add(self, loaded: LoadedModel, test: str, group: ModelResults, result: CaseResult) -> None:
        """Keep a result."""
        key = str(loaded.path)
        self._models[key] = (loaded.shown, loaded.behavior)
        self._entries.append(TestResult(key, test, len(self._entries), group, result))

    def add_recording(self, test: str, lines: tuple[str, ...]) -> None:
        """Keep what was recorded in the case file of a test, as lines."""
        self._recordings[test] = lines

    def recordings(self) -> Iterator[str]:
        """Yield the lines about the case files that were changed, in the order of their tests' ids."""
        for _, lines in sorted(self._recordings.items()):
            yield from lines

    def place(self, session: pytest.Session) -> None:
        """Note the positions of tests, so that the order does not depend on the distribution over workers."""
        items: list[pytest.Item] = getattr(session, "items", [])
        positions = {item.nodeid: position for position, item in enumerate(items)}
        self._entries = [
            entry if entry.position is not None else replace(entry, position=positions.get(entry.test, len(positions)))
            for entry in self._entries
        ]

    def pack(self) -> bytes:
        """Return all results as a text for another process."""
        return pickle.dumps((self._models, self._entries, self._recordings))

    def unpack(self, packed: bytes) -> None:
        """Add the results that another process packed."""
        models, entries, recordings = pickle.loads(packed)  # noqa: S301 - it comes from a worker that this session started
        self._models = models | self._models
        self._entries += entries
        self._recordings |= recordings

    def parts(self) -> Iterator[SessionPart]:
        """Return the cases of each model, the models in the order of their first tests."""
        by_model: dict[str, list[TestResult]] = {}
        for entry in sorted(self._entries, key=lambda entry: (entry.position or 0, entry.number)):
            by_model.setdefault(entry.model, []).append(entry)
        for key, entries in by_model.items():
            shown, behavior = self._models[key]
            counts = {group: sum(entry.group is group for entry in entries) for group in ModelResults}
            groups = {group: count for group, count in counts.items() if count}
            campaign = Campaign.of(behavior, (entry.result for entry in entries))
            yield SessionPart(shown, Path(key), tuple(entries), campaign, groups)


class LoadedModel(Struct, frozen=True):
    """A model with its file and its tester.

    Attributes:
        path: the file, resolved.
        shown: the file as messages show it.
        behavior: the model.
        tester: runs its cases.
    """

    path: Path
    shown: str
    behavior: BehaviorModel
    tester: Tester


class SessionModels:
    """Loads models, runs cases, and keeps the results."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.results = SessionResults()
        self._loaded: dict[Path, LoadedModel | InputError] = {}

    def shown(self, path: Path) -> str:
        """Return a path relative to the directory in which pytest was called, if it is below it."""
        directory = self.config.invocation_params.dir
        path = without_detours(path)
        return str(path.relative_to(directory)) if path.is_relative_to(directory) else str(path)

    @property
    def model_of_all(self) -> Path | None:
        """The model of all cases, if the command line names one."""
        path: str | None = self.config.getoption("--scbm-model")
        return None if path is None else self.config.invocation_params.dir / path

    @property
    def model_of_others(self) -> Path | None:
        """The model of cases that name none, if the configuration names one."""
        path: str | None = self.config.getini("scbm_model")
        if not path:
            return None
        file = self.config.inipath
        return (self.config.rootpath if file is None else file.parent) / path

    def load(self, path: Path) -> LoadedModel:
        """Return the model in a file; raise `InputError` with everything that is wrong with it."""
        key = real_path(path)
        if key not in self._loaded:
            self._loaded[key] = self._load(key, self.shown(path), planner_asked_for(self.config))
        loaded = self._loaded[key]
        if isinstance(loaded, InputError):
            raise InputError(loaded.diagnostics)
        return loaded

    @staticmethod
    def _load(path: Path, shown: str, planner: PlannerChoice) -> LoadedModel | InputError:
        try:
            loaded = load_model(path)
        except InputError as error:
            return InputError([replace(d, place=replace(d.place, file=shown)) for d in error.diagnostics])
        try:
            behavior = override_planner(loaded, planner, _PREFIX)
        except InputError as error:
            return error
        return LoadedModel(path, shown, behavior, Tester(behavior))

    @property
    def recording(self) -> RecordingMode:
        """The recording mode that the options ask for."""
        return RecordingMode(*(bool(self.config.getoption(f"{_PREFIX}{name}")) for name in ("record", "update")))

    def recorded(self, loaded: LoadedModel, written: WrittenCase, test: str) -> Case:
        """Return a case as it is in its file after its result is recorded there, if the options ask for that.

        Raises:
            InputError: the file cannot be edited or written.
        """
        if not any(self.recording):
            return written.case
        (done,) = found = recordings_of(loaded.tester, [(written, written.case)], self.recording)
        write_recordings(found)
        if done.text is not None:
            differences = (f"  {part}: {words}" for part, words in done.differences)
            self.results.add_recording(test, (f"{self.shown(written.path)}: {done.status}", *differences))
        return done.written.case

    def run(self, loaded: LoadedModel, case: Case, test: str, group: ModelResults) -> Execution:
        """Run a case on behalf of a test."""
        execution = loaded.tester.execute(case)
        self.results.add(loaded, test, group, execution.result)
        return execution
