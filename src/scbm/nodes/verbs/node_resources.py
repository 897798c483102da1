"""`scbm node resources`: simulates resources in a process of their own."""

from typing import Annotated

import typer

from scbm.cases import Origin
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.node_options import (
    Domain,
    Interface,
    NodeTransport,
    StartWithin,
    WhileStdin,
    read_domain,
    read_interface,
    read_start_within,
)
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.verb_options import Model
from scbm.files import load_model, suggestion
from scbm.model import BehaviorModel, Diagnostic, InputError, Place, Slug
from scbm.nodes import Bus, NodeContext, ResourcesNode
from scbm.nodes.verbs.node_setup import serve_node
from scbm.running.simulation import DrawnReactions
from scbm.testing import reaction_stream
from scbm.testing.transports import DEFAULT_TRANSPORT


def command(
    model: Model,
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME...", help="The resources; all, if none is named.", show_default=False),
    ] = None,
    *,
    seed: Annotated[
        int, HelpSection.CASES.option("--seed", help="Seed of their replies while no tester is connected.")
    ] = 0,
    transport: NodeTransport = None,
    domain: Domain = None,
    interface: Interface = None,
    start_within: StartWithin = "10 s",
    while_stdin: WhileStdin = False,
) -> int:
    """Simulate resources of a cell: they answer requests, until you stop them."""
    loaded = load_model(model)
    chosen = _chosen(loaded, names or [])

    def make(context: NodeContext, _: Bus | None) -> ResourcesNode:
        return ResourcesNode(context, DrawnReactions(reaction_stream(Origin(seed))))

    return serve_node(
        "resources",
        loaded,
        chosen,
        make,
        transport=transport or DEFAULT_TRANSPORT,
        domain=read_domain(domain),
        interface=read_interface(interface),
        start_within_s=read_start_within(start_within),
        while_stdin=while_stdin,
    )


def _chosen(model: BehaviorModel, names: list[str]) -> tuple[str, ...]:
    """Return the resources with these names in the order of the model; all without names. Raise `InputError`."""
    known = [resource.name for resource in model.resources]
    wrong = [name for name in dict.fromkeys(names) if name not in known]
    if wrong:
        remedies = [suggestion(name, known, "its resources are") for name in wrong]
        messages = [f"the model has no resource `{name}`" for name in wrong]
        place = Place("NAME")
        raise InputError(
            [
                Diagnostic(Slug.UNKNOWN_RESOURCE, message, place, remedy)
                for message, remedy in zip(messages, remedies, strict=True)
            ]
        )
    if not known:
        raise option_error("MODEL", "the model has no resources to simulate")
    return tuple(name for name in known if name in names or not names)
