"""Ctrl-C and SIGTERM: the first one ends what is searched for, the second one everything."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from scbm.cases.coverage import Obligation
from scbm.closing import Closer, Decision
from scbm.closing.interruption import Interruption
from scbm.closing.proofs.proofs import Proof, Proofs
from scbm.files import load_model
from support.shared_closings import shared_closing
from support.two_robots import two_robots

DUAL_CNC = Path(__file__).parents[3] / "examples/dual_cnc/lifted.yaml"
SIGNALS = (signal.SIGINT, signal.SIGTERM)


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_ends_a_stage_and_waits_between_stages(number: signal.Signals) -> None:
    before = [signal.getsignal(each) for each in SIGNALS]
    interruption, shown = Interruption(), list[str]()
    show = interruption.checked(shown.append)
    with interruption.handled():
        signal.raise_signal(number)
        show("between stages")
        with pytest.raises(KeyboardInterrupt), interruption.stage():
            show("in a stage")
        show("between stages")
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert shown == ["between stages"] * 2
    assert [signal.getsignal(each) for each in SIGNALS] == before


def test_the_first_signal_raises_in_a_stage() -> None:
    interruption = Interruption()
    with interruption.handled(), pytest.raises(KeyboardInterrupt), interruption.stage():
        signal.raise_signal(signal.SIGTERM)


def test_what_a_shell_ignores_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Interruption().handled():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_an_interruption_while_obligations_are_decided_loses_none(monkeypatch: pytest.MonkeyPatch) -> None:
    find, model = Proofs.find, two_robots()
    expected = shared_closing(model)

    def interrupted(proofs: Proofs, obligation: Obligation) -> Proof | None:
        if not interruption.is_asked:
            signal.raise_signal(signal.SIGINT)
        return find(proofs, obligation)

    monkeypatch.setattr(Proofs, "find", interrupted)
    interruption = Interruption()
    with interruption.handled():
        closing = Closer(model, interruption=interruption).close()
    assert (closing.decided, closing.cases) == (expected.decided, expected.cases)


@pytest.mark.longer
@pytest.mark.parametrize("beginning", ["looking for cases", "exploring runs in which inputs change"])
def test_nothing_is_explored_after_an_interruption(beginning: str) -> None:
    shown: list[str] = []

    def show(text: str) -> None:
        activity = text.partition(" open; ")[2]
        shown.append(activity)
        if activity.startswith(beginning):
            shown.clear()
            signal.raise_signal(signal.SIGTERM)

    interruption = Interruption()
    with interruption.handled():
        closing = Closer(load_model(DUAL_CNC), progress=show, interruption=interruption).close()
    assert closing.is_interrupted
    assert [text for text in shown if text.startswith("exploring")] == []
    assert any(decided.decision is Decision.COVERED for decided in closing.decided)
