"""Loads each model of a session once, and runs its cases."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files import load_model
from scbm.model import InputError
from scbm.plugins.pytest.session_results import SessionResults
from scbm.testing import Tester

if TYPE_CHECKING:
    import pytest

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.plugins.pytest.session_results import ModelResults
    from scbm.testing import Execution


@dataclass(frozen=True, slots=True)
class LoadedModel:
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
        plain = Path(os.path.normpath(path))
        path = plain if plain.resolve() == path.resolve() else path  # `..` behind a link may lead elsewhere
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
        """The model in a file. Raises `InputError` with everything that is wrong with it."""
        key = path.resolve()
        if key not in self._loaded:
            self._loaded[key] = self._load(key, self.shown(path))
        loaded = self._loaded[key]
        if isinstance(loaded, InputError):
            raise InputError(loaded.diagnostics)
        return loaded

    @staticmethod
    def _load(path: Path, shown: str) -> LoadedModel | InputError:
        try:
            behavior = load_model(path)
        except InputError as error:
            return InputError([replace(d, place=replace(d.place, file=shown)) for d in error.diagnostics])
        return LoadedModel(path, shown, behavior, Tester(behavior))

    def run(self, loaded: LoadedModel, case: Case, test: str, group: ModelResults) -> Execution:
        """Runs a case on behalf of a test."""
        execution = loaded.tester.execute(case)
        self.results.add(loaded, test, group, execution.result)
        return execution
