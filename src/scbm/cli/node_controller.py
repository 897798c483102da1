"""`scbm node controller`: runner and planner as a process."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.campaigns.node_setup import open_rclpy, serve_node
from scbm.cli.options.node_options import (
    Bindings,
    Domain,
    NodeTransport,
    Reached,
    Real,
    Via,
    WhileStdin,
    load_bound,
    read_domain,
    read_real,
    read_via,
)
from scbm.nodes import Bus, ControllerNode, NodeContext
from scbm.nodes.buses.transports import DEFAULT_TRANSPORT


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    *,
    real: Real = None,
    via: Reached = None,
    bindings: Bindings = None,
    transport: NodeTransport = None,
    domain: Domain = None,
    while_stdin: WhileStdin = False,
) -> int:
    """Run the controller of a cell: it runs what a tester sends, until you stop it."""
    loaded = load_bound(model, bindings)
    chosen = read_real(real or [], loaded)
    in_domain = read_domain(domain)

    def make(context: NodeContext, drivers: Bus | None) -> ControllerNode:
        return ControllerNode(context, drivers=drivers)

    open_drivers = partial(open_rclpy, in_domain) if read_via(via, chosen) is Via.RCLPY else None
    return serve_node(
        "controller",
        loaded,
        chosen,
        make,
        transport=transport or DEFAULT_TRANSPORT,
        domain=in_domain,
        while_stdin=while_stdin,
        open_drivers=open_drivers,
    )
