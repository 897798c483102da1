"""Models in Python tests: cases as keyword arguments, run like those in files."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from operator import index
from typing import TYPE_CHECKING

from scbm.files import read_case
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import shell_word
from scbm.plugins.pytest.session_models import ModelResults, planner_words
from scbm.reports import failure_lines
from scbm.reports.terminal.failure_report import finding_lines
from scbm.testing import Campaign, RandomCases, find_causes
from scbm.testing.random_cases import most_goals

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.plugins.pytest.session_models import LoadedModel, SessionModels
    from scbm.testing import Execution

_FILE = "model.run(…)"
"""The name of the arguments of a run in errors."""


def factory(models: SessionModels, directory: Path) -> Callable[..., ModelUnderTest]:
    """Return the value of the fixture for the tests of a directory."""
    counts: Counter[str] = Counter()

    def scbm_model(path: str | os.PathLike[str] | None = None) -> ModelUnderTest:
        """Return the model in a file, relative to the directory of the test; by default that of the configuration.

        Raises `InputError` with everything that is wrong with the file.
        """
        __tracebackhide__ = True
        file = (models.model_of_all or models.model_of_others) if path is None else directory / path
        if file is None:
            message = "no model is named, neither here nor in the configuration"
            remedy = 'write `scbm_model("<path>")`, or set `scbm_model` in the configuration of pytest'
            raise InputError([Diagnostic(Slug.MODEL_MISSING, message, Place("scbm_model()"), remedy)])
        try:
            return ModelUnderTest(models, models.load(file), counts)
        except InputError as error:
            raise InputError(error.diagnostics) from None

    return scbm_model


class ModelUnderTest:
    """A model whose cases tests run. They count for the coverage of the session."""

    def __init__(self, models: SessionModels, loaded: LoadedModel, counts: Counter[str]) -> None:
        self._models = models
        self._loaded = loaded
        self._counts = counts

    def __repr__(self) -> str:
        return f"ModelUnderTest({self._loaded.shown})"

    @property
    def behavior(self) -> BehaviorModel:
        """The model itself."""
        return self._loaded.behavior

    def run(self, case: Case | None = None, /, **keys: object) -> Execution:
        """Run a case, and return its result, passed or failed.

        Args:
            case: the case; by default the case of the keyword arguments.
            keys: the keys of a case file: `goal`, `initial`, `outcomes`, `injections`, `network`, …

        Raises:
            InputError: the keyword arguments are no case of this model; with all errors.
        """
        __tracebackhide__ = True
        if case is not None and keys:
            raise TypeError("a case is complete: pass either a case or keyword arguments")
        test = _current_test()
        if case is not None:
            return self._execute(case, test)
        try:
            return self._execute(self._read(keys, test), test)
        except InputError as error:  # its own traceback shows how cases are read, which is not what is wrong
            raise InputError(error.diagnostics) from None

    def check(self, case: Case | None = None, /, **keys: object) -> Execution:
        """Run a case. Raises `AssertionError` with the reason and the timeline if it fails."""
        __tracebackhide__ = True
        execution = self.run(case, **keys)
        if not execution.verdict.passed:
            lines = [text.plain for text in failure_lines(self.behavior, execution)]
            raise AssertionError("\n".join([f"case {execution.case.name} failed", *lines]))
        return execution

    def random(self, seed: int = 0, cases: int = 20) -> tuple[Execution, ...]:
        """Run the first random cases of a seed, as `scbm test --seed SEED --cases CASES` does.

        Raises:
            InputError: the model has no goals, or no initial state that it allows is found.
            TypeError: a number is none.
            ValueError: `cases` is negative.
        """
        if index(cases) < 0:
            raise ValueError(f"{cases} cases cannot be run")
        seed, test = index(seed), _current_test()
        drawn = RandomCases(self.behavior, self._loaded.shown, goals=most_goals(self.behavior)).first(cases, seed)
        return tuple(self._models.run(self._loaded, case, test, ModelResults.RANDOM) for case in drawn)

    def check_random(self, seed: int = 0, cases: int = 20) -> tuple[Execution, ...]:
        """Run random cases as `random` does. Raises `AssertionError` with each cause of failures.

        A cause has its cases, the smallest run that still fails, and the command that repeats its first case.
        """
        __tracebackhide__ = True
        executions = self.random(seed, cases)
        campaign = Campaign.of(self.behavior, [execution.result for execution in executions])
        if campaign.failed_count:
            findings = find_causes(self._loaded.tester, campaign)
            commands = [self._again(seed, cause.positions[0]) for cause in campaign.summary.causes]
            _, *lines = finding_lines(campaign, findings, commands)
            raise AssertionError("\n".join(text.plain for text in lines))
        return executions

    def _again(self, seed: int, number: int) -> str:
        """Return the command that runs a random case again."""
        model = shell_word(self._loaded.shown)
        return f"scbm run {model} --seed {seed} --case {number}{planner_words(self._models.config)}"

    def _execute(self, case: Case, test: str) -> Execution:
        return self._models.run(self._loaded, case, test, ModelResults.TEST)

    def _read(self, keys: dict[str, object], test: str) -> Case:
        """Return the case of keyword arguments, read as a file in which each key is a line."""
        written = {"case": self._name(test)} | keys
        return read_case("".join(_line(key, value) for key, value in written.items()), self.behavior, _FILE)

    def _name(self, test: str) -> str:
        """Return the name of the test, with a number from the second case on."""
        function, bracket, parameters = test.partition("[")  # parameters may have anything in them
        written = function.rpartition("::")[2] + bracket + parameters
        name = re.sub(r"[^A-Za-z0-9_.-]+", "_", written).strip("_.-") or "case"
        name = name if name[0].isalpha() else f"case_{name}"
        self._counts[test] += 1
        count = self._counts[test]
        return name if count == 1 else f"{name}-{count}"


def _line(key: str, value: object) -> str:
    """Return a key with its value as YAML: JSON, which looks like the Python of the test."""
    written = json.dumps(value, ensure_ascii=False, default=str)
    return f"{key if key.isidentifier() else json.dumps(key)}: {written}\n"


def _current_test() -> str:
    """Return the node id of the test that runs now."""
    return os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]
