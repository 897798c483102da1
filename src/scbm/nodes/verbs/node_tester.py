"""`scbm node tester`: runs cases in a cell whose controller and resources run in other processes."""

from pathlib import Path
from typing import Annotated

from scbm.cli.campaigns.test_campaign import CampaignOptions, refuse_outputs
from scbm.cli.options.campaign_options import CampaignOutput, read_thresholds, refuse_asserted
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.node_options import (
    Domain,
    Interface,
    Logs,
    NodeOptions,
    NodeTransport,
    TimeScale,
    Via,
    read_domain,
    read_interface,
    read_time_scale,
    read_wait,
)
from scbm.cli.options.status_options import Certificates, WaiversFile, read_asked_evidence
from scbm.cli.options.verb_options import (
    Cases,
    FailUnder,
    Files,
    Json,
    Missing,
    Model,
    Network,
    Require,
    Seed,
    ShowAll,
    Store,
)
from scbm.model.visible_text import shown_path
from scbm.nodes.verbs.over_nodes import run_over_nodes
from scbm.testing.transports import DEFAULT_TRANSPORT


def command(
    model: Model,
    files: Files = None,
    *,
    cases: Cases = None,
    seed: Seed = 0,
    network: Network = None,
    require: Require = None,
    failures: Annotated[
        Path,
        HelpSection.OUTPUT.option("--failures", metavar="DIRECTORY", help="Directory for the logs of failing cases."),
    ] = Path("scbm-failures"),
    store: Store = None,
    missing: Missing = False,
    shows_all: ShowAll = False,
    fail_under: FailUnder = None,
    certificates: Certificates = None,
    waivers: WaiversFile = None,
    time_limit: Annotated[
        str | None,
        HelpSection.RUNNING.option("--time-limit", metavar="DURATION", help="Time of the run for each case. [1 h]"),
    ] = None,
    time_scale: TimeScale = None,
    transport: NodeTransport = None,
    domain: Domain = None,
    interface: Interface = None,
    wait: Annotated[
        str,
        HelpSection.NODES.option("--wait", metavar="DURATION", help="How long to wait for controller and resources."),
    ] = "10 s",
    logs: Logs = None,
    json: Json = False,
) -> int:
    """Run cases in a cell whose controller and resources run elsewhere, and report as `scbm test` does."""
    suite = CampaignOptions(model, files or [], cases, seed, network, require or [], time_limit).suite({})
    figures = read_thresholds(fail_under or [])
    refuse_asserted(figures, store, is_over_nodes=True)
    evidence = read_asked_evidence(suite.model, model, certificates, waivers, figures)
    output = CampaignOutput(
        figures,
        missing,
        json,
        store,
        save=None,
        failures=failures,
        shrink=False,
        stop=False,
        evidence=evidence,
        shows_all=shows_all,
    )
    refuse_outputs(suite, output, logs)
    asked = NodeOptions(
        suite.model,
        model,
        transport or DEFAULT_TRANSPORT,
        read_domain(domain),
        read_interface(interface),
        read_time_scale(time_scale),
        read_wait(wait),
        starts=False,
        real=(),
        via=Via.DDS,
        bindings=None,
        logs=logs,
        failures=failures,
    )
    again = f"{asked.verb} {shown_path(str(model))}{suite.test_options}{asked.options}"
    return run_over_nodes(suite, output, asked, again)
