"""Work in the background is done in order, and keeps no process."""

from __future__ import annotations

import subprocess
import sys
from threading import Event

import pytest

from scbm.nodes.roles.controller import Background
from support.loops import GUARD_S


def test_work_is_done_one_after_the_other_and_answers_or_raises() -> None:
    background, done = Background("worker"), list[int]()
    first, second = background.submit(done.append, 1), background.submit(divmod, 1, 0)
    assert first.result(GUARD_S) is None
    with pytest.raises(ZeroDivisionError):
        second.result(GUARD_S)
    assert done == [1]
    background.shutdown()


@pytest.mark.parametrize("how", ["cancel", "shutdown"])
def test_what_is_not_wanted_any_more_before_it_is_begun_is_never_done(how: str) -> None:
    background, done, may_go_on = Background("worker"), list[int](), Event()
    begun = Event()

    def hold() -> bool:
        begun.set()
        return may_go_on.wait(GUARD_S)

    first = background.submit(hold)
    second = background.submit(done.append, 2)
    begun.wait(GUARD_S)
    if how == "cancel":
        second.cancel()
    else:
        background.shutdown()
    may_go_on.set()
    if how == "cancel":
        background.submit(done.append, 3).result(GUARD_S)
    assert first.result(GUARD_S)
    assert second.cancelled()
    assert 2 not in done


@pytest.mark.slow
def test_a_process_ends_though_its_work_does_not() -> None:
    program = (
        "from threading import Event\nfrom scbm.nodes.roles.controller import Background\nstarted = Event()\n"
        "Background('worker').submit(lambda: (started.set(), Event().wait()))\nstarted.wait()\nprint('over')"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True, timeout=GUARD_S
    )
    assert (ended.stdout, ended.returncode) == ("over\n", 0)
