"""Set-up of the verbs that run nodes: open a bus, serve a node, and report errors of the bus.

Refuse cases that real resources cannot carry out, before any request is sent.
"""

from __future__ import annotations

import asyncio
import sys
from contextlib import closing
from functools import partial
from typing import TYPE_CHECKING

from scbm.cli.options.node_options import ALONE
from scbm.cli.output.terminal import errors, results
from scbm.files import digest_of
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import in_one_line
from scbm.nodes import Bus, BusError, NodeContext, ServedNode, beyond_reach, new_status, serve
from scbm.nodes.limited_warnings import LimitedWarnings
from scbm.testing.transports import LOOPBACK, TRANSPORTS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Join
    from scbm.testing.suite import Suite


def open_rclpy(domain: int, warn: Callable[[str], None]) -> Bus:
    """Return a bus for drivers that uses the installed ROS 2."""
    from scbm.nodes.buses.rclpy_bus import open_ros2  # noqa: PLC0415 - rclpy is optional

    return open_ros2("scbm_controller_drivers", domain, warn)


def warn(words: str) -> None:
    """Print a warning, such as a dropped message or a lost node, to the standard error output."""
    errors().line(f"scbm: {in_one_line(words)}")


def serve_node(
    role: str,
    model: BehaviorModel,
    resources: Sequence[str],
    make: Callable[[NodeContext, Bus | None], ServedNode],
    *,
    transport: str,
    domain: int,
    interface: str | None,
    start_within_s: float,
    while_stdin: bool,
    open_drivers: Callable[[Callable[[str], None]], Bus] | None = None,
) -> int:
    """Serve a node until it is stopped; `make` gets the bus of `open_drivers` too. Raise `InputError`."""
    output, limited = results(), LimitedWarnings(warn)
    alone = ALONE if interface == LOOPBACK and TRANSPORTS[transport].joins_processes else None

    def print_line(words: str) -> None:
        output.line(in_one_line(words))
        sys.stdout.flush()

    def with_context(drivers: Bus | None, bus: Bus) -> ServedNode:
        status = new_status(role, model, digest_of(model), resources)
        return make(NodeContext(bus, model, status, limited, print_line, start_within_s=start_within_s), drivers)

    async def serve_both(join: Join) -> bool:
        async def open_bus() -> Bus:
            return join(role)

        drivers = None if open_drivers is None else open_drivers(limited)
        try:
            return await serve(
                open_bus, partial(with_context, drivers), report=print_line, until_eof=while_stdin, alone=alone
            )
        finally:
            if drivers is not None:
                await drivers.close()

    async def serve_again(join: Join) -> None:
        while await serve_both(join):
            pass

    try:
        with closing(limited):
            asyncio.run(serve_again(TRANSPORTS[transport].connect(domain, limited, interface)))
    except BusError as error:
        raise bus_error(error) from None
    return 0


def bus_error(error: BusError) -> InputError:
    """Return the error that a user reads if the middleware cannot be used."""
    return InputError([Diagnostic(Slug.BUS_UNUSABLE, in_one_line(error.message), Place(error.where), error.remedy)])


def refuse_beyond_reach(suite: Suite, real: Sequence[str], option: str) -> None:
    """Raise `InputError` with all cases whose clauses real resources cannot carry out.

    Args:
        suite: the cases.
        real: the resources that are reached at real drivers.
        option: the command-line option that asks for random cases; errors of those name it as their place.
    """
    if not real:
        return
    wrong = []
    for written in suite.written:
        if (why := beyond_reach(written.case, suite.model, real)) is not None:
            remedy = "leave this case out, or simulate more resources"
            wrong.append(Diagnostic(Slug.BEYOND_REACH, why, Place(str(written.path)), remedy))
    found = ((case.name, beyond_reach(case, suite.model, real)) for case in suite.drawn())
    drawn = [(name, why) for name, why in found if why is not None]
    if drawn:
        name, why = drawn[0]
        message = f"{len(drawn)} of {len(suite.numbers)} random cases cannot be run, such as `{name}`: {why}"
        remedy = "leave `--network` out, or simulate more resources"
        wrong.append(Diagnostic(Slug.BEYOND_REACH, message, Place(option), remedy))
    if wrong:
        raise InputError(wrong)
