"""Remedies for an incomplete cell: the sentences and commands that errors suggest to users."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cli.options.node_options import transport_option
from scbm.cli.output.terminal import in_one_line
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.nodes import Lack
from scbm.reports import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.cli.options.node_options import NodeOptions
    from scbm.nodes import NotReadyError, Reason
    from scbm.testing import Answers

_PLAIN = {
    Lack.RIVAL: "wait for it, or stop it",
    Lack.VERSION: "stop that process, and start it again with this version of scbm",
    Lack.MODEL: "stop that process, and start it again",
    Lack.TIME_SCALE: "leave `--time-scale` out",
    Lack.CHILD: "see above what it says",
    Lack.UNREADABLE: "stop that process: all nodes of a cell are of one version of scbm",
    Lack.DRIVER: "start its driver in this domain, or correct its binding",
}
_OF_CHILDREN = {
    Lack.MODEL: "the model file was changed meanwhile: run this again",
    Lack.CONTROLLER: "see above what the nodes say, or give them longer: `--wait`",
    Lack.RESOURCES: "see above what the nodes say, or give them longer: `--wait`",
}


def cell_error(error: NotReadyError, asked: NodeOptions) -> InputError:
    """Return the error for a cell that is incomplete or wrong, with a remedy for each reason."""
    place = Place(asked.where)
    reasons = error.reasons
    return InputError(
        [Diagnostic(Slug.CELL_INCOMPLETE, in_one_line(r.message), place, _remedy(r, asked)) for r in reasons]
    )


def _remedy(reason: Reason, asked: NodeOptions) -> str:
    if asked.starts and reason.lack in _OF_CHILDREN:
        return _OF_CHILDREN[reason.lack]
    if reason.lack in _PLAIN:
        return _PLAIN[reason.lack]
    if reason.lack is Lack.FOREIGN:
        return f"stop it, choose another `--domain`, or test what is there: {_node('tester', asked)}"
    commands = [_node("controller", asked)] if reason.lack is Lack.CONTROLLER else []
    if reason.resources:
        commands.append(_node("resources", asked, reason.resources))
    return f"start {' and '.join(commands)}"


def _node(role: str, asked: NodeOptions, resources: Sequence[str] = ()) -> str:
    """Return the command that starts a node in the domain of the tester."""
    is_all = len(resources) == len(asked.model.resources)
    names = "" if is_all else "".join(f" {name}" for name in resources)
    is_default = asked.domain == 0 and not os.environ.get("ROS_DOMAIN_ID")
    domain = "" if is_default else f" --domain {asked.domain}"
    return f"`scbm node {role} {shlex.quote(str(asked.file))}{names}{transport_option(asked.transport)}{domain}`"


def silent_driver(answers: Answers, asked: NodeOptions) -> str:
    """Return a warning about a real resource that carried out none of its requests, and where to look."""
    sent = counted(answers.sent, "request")
    return f"`{answers.resource}` is real, and of {sent} none succeeded: {_outcomes(answers)}; {_look(answers, asked)}"


def _outcomes(answers: Answers) -> str:
    """Return how the requests to a resource ended if none of them succeeded."""
    if answers.failed == answers.sent:
        return "each was refused or failed"
    if answers.timed_out == answers.sent:
        return "nothing came back in time"
    parts = [
        (answers.failed, "failed"),
        (answers.timed_out, "got no reply in time"),
        (answers.given_up, f"{'was' if answers.given_up == 1 else 'were'} given up"),
    ]
    return ", ".join(f"{count} {words}" for count, words in parts if count)


def _look(answers: Answers, asked: NodeOptions) -> str:
    if not answers.timed_out:
        return "see what its driver says itself"
    where = f"the binding of `{answers.resource}`" + ("" if asked.bindings is None else f" in {asked.bindings}")
    return f"look at what its driver says, at {where}, and at its deadlines"


@dataclass
class Waiting:
    """Reports what a cell waits for; nodes that this command starts itself are left out."""

    _asked: NodeOptions
    _print: Callable[[str], None]
    _last: str = ""

    def __call__(self, reasons: Sequence[Reason]) -> None:
        """Print the reasons for waiting unless they repeat the previous ones."""
        shown = [r.message for r in reasons if not self._asked.starts or r.lack not in _OF_CHILDREN]
        words = "; ".join(shown)
        if words and words != self._last:
            self._print(f"waiting for {self._asked.wait_s:g} s at most: {words}")
        self._last = words
