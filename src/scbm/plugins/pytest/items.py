"""A case file as a pytest file with one item: the case."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

from scbm.files import is_case_text, open_case, real_path
from scbm.model import InputError
from scbm.model.visible_text import shell_word
from scbm.plugins.pytest.session_models import ModelResults, planner_words
from scbm.plugins.pytest.session_stash import models_of
from scbm.reports import failure_lines
from scbm.testing.planner_override import planner_of_replay
from scbm.testing.recorded_results import is_of_record
from scbm.testing.written_cases import WrittenCase

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from _pytest._code.code import ExceptionInfo, TerminalRepr  # what `repr_failure` is declared with

    from scbm.cases import Case
    from scbm.files import CaseDocument
    from scbm.plugins.pytest.session_models import LoadedModel, SessionModels

_KEY = re.compile(r"""^\ufeff?["']?case["']?[ \t]*:""", re.MULTILINE)


def collect_case(path: Path, head: str, parent: pytest.Collector) -> pytest.Collector | None:
    """Return the file, if it is a case."""
    if not is_case_text(head):
        return None
    file: PytestCaseFile = PytestCaseFile.from_parent(parent, path=path)
    found = _KEY.search(head)
    file.line = head.count("\n", 0, found.start()) if found else 0
    return file


class CaseFailedError(Exception):
    """A case failed; the message has the reason and the command that shows the run."""


class PytestCaseFile(pytest.File):
    """A file with a case."""

    line = 0
    """The line in which the case begins, counted from 0."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the case. Errors of the file are raised when the case is run, so that other cases still run."""
        models = models_of(self.config)
        name, document = self.path.stem, None
        wrong: InputError | None = None
        model: Path | None = None
        try:
            document = open_case(models.shown(self.path))
            name = document.name if document.name.isprintable() else name
            model = _model_path(document, models)
        except InputError as error:
            wrong = error
        yield CaseItem.from_parent(self, name=name, document=document, model=model, wrong=wrong, line=self.line)


def _model_path(document: CaseDocument, models: SessionModels) -> Path:
    """Return the absolute path of the model. Raises `InputError` if neither file nor configuration names one."""
    path = models.model_of_all
    if path is None and document.model_path is None:
        path = models.model_of_others
    return path or models.config.invocation_params.dir / document.required_model_path()


class CaseItem(pytest.Item):
    """A case that is run and judged."""

    def __init__(
        self,
        *,
        document: CaseDocument | None,
        model: Path | None,
        wrong: InputError | None,
        line: int,
        **node: Any,  # noqa: ANN401 - what all items are made of
    ) -> None:
        """Made by `from_parent`.

        Args:
            document: the file, unless it is no YAML.
            model: the file of the model, unless there is none.
            wrong: the errors of the file so far.
            line: where the case begins, counted from 0.
            node: what all items are made of.
        """
        super().__init__(**node)
        self._document = document
        self._model = model
        self._wrong = wrong
        self._line = line

    def runtest(self) -> None:
        """Run the case; raise `CaseFailedError`, or `InputError` if the case or its model is wrong."""
        if self._wrong is not None or self._document is None or self._model is None:
            raise InputError(self._wrong.diagnostics if self._wrong is not None else ())
        models = models_of(self.config)
        loaded = models.load(self._model)
        case = self._document.read(loaded.behavior)
        case = models.recorded(loaded, WrittenCase(case, self.path, self._document.model_path), self.nodeid)
        execution = models.run(loaded, case, self.nodeid, ModelResults.FILE)
        if not execution.verdict.passed:
            lines = [text.plain for text in failure_lines(loaded.behavior, execution)]
            if any(map(is_of_record, execution.verdict.failures)):
                lines.append("if the differences are right: --scbm-update records the new results")
            raise CaseFailedError("\n".join([*lines, f"again: {self._command(models, loaded, case)}"]))

    def _command(self, models: SessionModels, loaded: LoadedModel, case: Case) -> str:
        """Return the command that shows the run again."""
        command = f"scbm replay {shell_word(models.shown(self.path))}"
        assert self._document is not None  # noqa: S101 - it was run
        named = self._document.model_path
        is_named = named is not None and real_path(models.config.invocation_params.dir / named) == loaded.path
        model = "" if is_named else f" --model {shell_word(loaded.shown)}"
        return f"{command}{model}{planner_of_replay(case, loaded.behavior, planner_words(models.config))}"

    def repr_failure(self, excinfo: ExceptionInfo[BaseException], style: Any = None) -> str | TerminalRepr:  # noqa: ANN401 - as pytest declares it
        """Return the sentences of a failure, without a traceback; located in the case file."""
        if not isinstance(excinfo.value, (CaseFailedError, InputError)):
            return super().repr_failure(excinfo, style)
        shown = excinfo.getrepr(style="value", chain=False)
        if shown.reprcrash is not None:
            message = str(excinfo.value).partition("\n")[0]
            shown.reprcrash.path, shown.reprcrash.lineno = str(self.path), self._line + 1
            shown.reprcrash.message = message
        return shown

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return the line at which the case begins, and its name."""
        return self.path, self._line, f"case {self.name}"
