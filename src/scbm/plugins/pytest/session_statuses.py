"""The thresholds of a session, and the statuses of obligations: `--scbm-fail-under` and `--scbm-certificates`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import COVERABLE, KINDS, Threshold, WaiverReview
from scbm.closing.certificate_files import certificates_in, check_file, open_certificates
from scbm.closing.current_date import today
from scbm.closing.proved_statuses import StatusEvidence
from scbm.model import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from scbm.cases.coverage import Statuses
    from scbm.closing.certificate_files import CertificateFile
    from scbm.plugins.pytest.session_models import SessionPart


def read_threshold(text: str) -> Threshold:
    """Return a threshold such as `90` or `coverable=100`. Raise `ValueError` with the reason."""
    kind, equals, number = text.rpartition("=")
    kind = kind.strip() if equals else "all"
    if kind not in (*KINDS, COVERABLE):
        raise ValueError(f"there is no kind `{kind}`; the kinds are {', '.join((*KINDS, COVERABLE))}")
    try:
        percent = float(number.strip().removesuffix("%"))
    except ValueError:
        percent = -1
    if not 0 <= percent <= 100:  # noqa: PLR2004 - all of it
        raise ValueError(f"`{number}` is not a number from 0 to 100")
    return Threshold(percent, kind)


def thresholds_of(config: pytest.Config) -> tuple[Threshold, ...]:
    """Return the thresholds of the options."""
    found: list[Threshold] = config.getoption("--scbm-fail-under") or []
    return tuple(found)


class SessionStatuses:
    """The statuses of the obligations of the models of a session, of each model computed once."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._certificates = tuple(certificates_of(config))
        self._known: dict[Path, Statuses | None] = {}

    def of(self, part: SessionPart) -> Statuses | None:
        """Return the statuses of the obligations of a model; `None` if neither options nor waivers ask for them."""
        if part.path not in self._known:
            self._known[part.path] = self._statuses(part)
        return self._known[part.path]

    def _statuses(self, part: SessionPart) -> Statuses | None:
        model, campaign = part.campaign.model, part.campaign
        is_asked = any(threshold.kind == COVERABLE for threshold in thresholds_of(self._config))
        if not (is_asked or self._certificates or model.waivers):
            return None
        of_this = (file for file in self._certificates if file.certificate.model == model.name)
        checked = [check_file(file, model) for file in of_this]
        evidence = StatusEvidence.of(checked, WaiverReview.on(today(), model.waivers), model)
        goals = [entry.result.case.goals_in(model) for entry in part.entries]
        return evidence.statuses(campaign.coverage, campaign.forced, goals)


_STATUSES = pytest.StashKey[SessionStatuses]()


def statuses_of(config: pytest.Config) -> SessionStatuses:
    """Return the statuses of a session; made at the first call."""
    if _STATUSES not in config.stash:
        config.stash[_STATUSES] = SessionStatuses(config)
    return config.stash[_STATUSES]


def certificates_of(config: pytest.Config) -> Iterator[CertificateFile]:
    """Yield the certificates of the options. Raise `UsageError` for a file that is none."""
    named: list[str] = config.getoption("--scbm-certificates") or []
    directory = config.invocation_params.dir
    try:
        for file in open_certificates(certificates_in(directory / name for name in named)):
            path = file.path
            yield replace(file, path=path.relative_to(directory)) if path.is_relative_to(directory) else file
    except InputError as error:
        raise pytest.UsageError("\n".join(f"--scbm-certificates: {one}" for one in error.diagnostics)) from None


def shortfalls(part: SessionPart, threshold: Threshold, statuses: Statuses | None) -> Iterator[str]:
    """Yield a sentence if a model misses a threshold."""
    coverage = part.campaign.coverage
    coverable = None if statuses is None else statuses.coverable
    failed = f"FAIL Required coverability of {words_of(threshold)} not reached: {part.file}"
    figure = threshold.figure(coverage, coverable)
    if figure.percent is None:
        yield f"{failed} has no obligations{_of_kind(threshold)}, so it is not measurable."
    elif not threshold.is_met(coverage, coverable):
        yield f"{failed} is at {figure}."


def words_of(threshold: Threshold) -> str:
    """Return the words for a threshold, such as `90 %` or `100 % of what can be covered`."""
    percent = f"{threshold.percent:g} %"
    if threshold.kind == COVERABLE:
        return f"{percent} of what can be covered"
    return f"{percent}{_of_kind(threshold)}"


def _of_kind(threshold: Threshold) -> str:
    return "" if threshold.kind in ("all", COVERABLE) else f" of `{threshold.kind}`"
