"""`scbm node controller`: runs the controller, with runner and planner, as a process."""

from functools import partial

from scbm.cli.options.node_options import (
    Domain,
    Interface,
    NodeTransport,
    Reached,
    Real,
    StartWithin,
    Via,
    WhileStdin,
    load_bound,
    read_domain,
    read_interface,
    read_real,
    read_start_within,
    read_via,
)
from scbm.cli.options.planner_options import (
    MaxExpanded,
    MaxLength,
    MaxMemory,
    MaxTime,
    PlannerName,
    PlannerOptions,
    Plans,
)
from scbm.cli.options.verb_options import Bindings, Model
from scbm.nodes import Bus, ControllerNode, NodeContext
from scbm.nodes.verbs.node_setup import open_rclpy, serve_node
from scbm.testing.random_streams import draw_plans
from scbm.testing.transports import DEFAULT_TRANSPORT


def command(
    model: Model,
    *,
    real: Real = None,
    via: Reached = None,
    bindings: Bindings = None,
    transport: NodeTransport = None,
    domain: Domain = None,
    interface: Interface = None,
    planner: PlannerName = None,
    max_length: MaxLength = None,
    max_expanded: MaxExpanded = None,
    max_time: MaxTime = None,
    max_memory: MaxMemory = None,
    plans: Plans = None,
    start_within: StartWithin = "10 s",
    while_stdin: WhileStdin = False,
) -> int:
    """Run the controller of a cell: it runs what a tester sends, until you stop it."""
    options = PlannerOptions(planner, max_length, max_expanded, max_time, max_memory, plans)
    loaded = options.applied(load_bound(model, bindings))
    limits = options.limits(loaded)
    chosen = read_real(real or [], loaded)
    in_domain = read_domain(domain)

    def make(context: NodeContext, drivers: Bus | None) -> ControllerNode:
        return ControllerNode(context, limits, drivers, draw_plans)

    open_drivers = partial(open_rclpy, in_domain) if read_via(via, chosen) is Via.RCLPY else None
    return serve_node(
        "controller",
        loaded,
        chosen,
        make,
        transport=transport or DEFAULT_TRANSPORT,
        domain=in_domain,
        interface=read_interface(interface),
        start_within_s=read_start_within(start_within),
        while_stdin=while_stdin,
        open_drivers=open_drivers,
    )
