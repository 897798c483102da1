"""`scbm test`: runs case files and random cases, judges them, and prints the coverability report."""

from pathlib import Path
from typing import Annotated

from msgspec.structs import replace

from scbm.cli.campaigns.suite_recording import record_suite, refuse_without_files
from scbm.cli.campaigns.test_campaign import (
    CampaignOptions,
    refuse_outputs,
    refuse_selection,
    select_cases,
    simulate,
)
from scbm.cli.options.campaign_options import CampaignOutput, read_executor, read_thresholds, refuse_asserted
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.node_options import (
    Domain,
    Interface,
    Logs,
    NodeOptions,
    Reached,
    Real,
    TestTransport,
    TimeScale,
    load_bound,
    read_domain,
    read_interface,
    read_real,
    read_time_scale,
    read_via,
    read_wait,
    refuse_faster,
    refuse_in_one_process,
    refuse_with_nodes,
    refuse_without_transport,
)
from scbm.cli.options.option_errors import OptionReader
from scbm.cli.options.planner_options import RunPlanner
from scbm.cli.options.status_options import Certificates, WaiversFile, read_asked_evidence
from scbm.cli.options.verb_options import (
    Bindings,
    Cases,
    CaseTimeLimit,
    Cluster,
    FailUnder,
    Files,
    Inputs,
    Jobs,
    Json,
    Missing,
    Model,
    MostGoals,
    Network,
    Require,
    Seed,
    ShowAll,
    Store,
)
from scbm.model.lazy_exports import load_named
from scbm.model.visible_text import shown_path
from scbm.testing.transports import RUN_OVER_NODES
from scbm.testing.written_cases import RecordingMode


def command(
    model: Model,
    files: Files = None,
    *,
    cases: Cases = None,
    seed: Seed = 0,
    network: Network = None,
    inputs: Inputs = None,
    goals: MostGoals = None,
    jobs: Jobs = None,
    cluster: Cluster = None,
    until_dry: Annotated[
        int | None,
        HelpSection.CASES.option(
            "--until-dry", metavar="N", min=1, help="Stop once N random cases in a row visit nothing new."
        ),
    ] = None,
    select: Annotated[
        str | None,
        HelpSection.CASES.option(
            "-k", metavar="EXPRESSION", help="Run the cases whose names match: `scan and not fast`."
        ),
    ] = None,
    last_failed: Annotated[
        bool,
        HelpSection.CASES.option("--lf", "--last-failed", help="Run the cases that failed last time; all if none did."),
    ] = False,
    stop: Annotated[bool, HelpSection.RUNNING.option("-x", "--exitfirst", help="Stop at the first failure.")] = False,
    require: Require = None,
    save: Annotated[
        Path | None, HelpSection.OUTPUT.option("--save", metavar="DIRECTORY", help="Save every random case as a file.")
    ] = None,
    record: Annotated[
        bool,
        HelpSection.OUTPUT.option(
            "--record", help="Record results in the case files that have none, of cases that pass."
        ),
    ] = False,
    update: Annotated[
        bool,
        HelpSection.OUTPUT.option("--update", help="Show how runs differ from recorded results, and record them anew."),
    ] = False,
    shrink: Annotated[bool, HelpSection.RUNNING.option("--shrink/--no-shrink", help="Shrink failing cases.")] = True,
    failures: Annotated[
        Path, HelpSection.OUTPUT.option("--failures", metavar="DIRECTORY", help="Directory for shrunk failing cases.")
    ] = Path("scbm-failures"),
    store: Store = None,
    missing: Missing = False,
    shows_all: ShowAll = False,
    fail_under: FailUnder = None,
    certificates: Certificates = None,
    waivers: WaiversFile = None,
    time_limit: CaseTimeLimit = None,
    planner: RunPlanner,
    transport: TestTransport = None,
    real: Real = None,
    via: Reached = None,
    bindings: Bindings = None,
    time_scale: TimeScale = None,
    domain: Domain = None,
    interface: Interface = None,
    wait: Annotated[
        str | None,
        HelpSection.NODES.option("--wait", metavar="DURATION", help="How long to wait for nodes and drivers. [10 s]"),
    ] = None,
    logs: Logs = None,
    json: Json = False,
) -> int:
    """Run case files and random cases, judge them, and report their coverage of the model."""
    wanted = CampaignOptions(
        model, files or [], cases, seed, network, require or [], time_limit, planner, until_dry, inputs, goals
    )
    options = OptionReader()
    figures = options.read(lambda: read_thresholds(fail_under or []), read_thresholds([]))
    suite = options.last(lambda: wanted.suite({"--save": save, "--until-dry": until_dry}))
    refuse_asserted(figures, store, is_over_nodes=transport is not None)
    refuse_selection(until_dry, {"-k": select, "--lf": last_failed or None})
    recording = RecordingMode(record, update)
    refuse_without_files(recording, suite, {"--time-limit": time_limit})
    suite = select_cases(suite, select, failures if last_failed else None)
    evidence = read_asked_evidence(suite.model, model, certificates, waivers, figures)
    output = CampaignOutput(
        figures, missing, json, store, save, failures, shrink, stop, until_dry, evidence, shows_all=shows_all
    )
    refuse_outputs(suite, output, logs)
    if transport is None:
        refuse_without_transport(
            {
                "--real": real,
                "--via": via,
                "--bindings": bindings,
                "--time-scale": time_scale,
                "--domain": domain,
                "--interface": interface,
                "--wait": wait,
                "--logs": logs,
            }
        )
        executor = read_executor(jobs, cluster)
        suite, recorded = record_suite(suite, recording, shows=not json)
        return simulate(suite, replace(output, recorded=recorded), executor)
    refuse_with_nodes(
        {
            "-j": jobs,
            "--cluster": cluster,
            "--until-dry": until_dry,
            "--inputs": inputs,
            "--record": record or None,
            "--update": update or None,
        }
    )
    of_processes = {"--real": real, "--via": via, "--bindings": bindings, "--domain": domain, "--interface": interface}
    refuse_in_one_process(transport, of_processes)
    bound = load_bound(model, bindings)
    chosen = read_real(real or [], bound)
    refuse_faster(time_scale, chosen)
    asked = NodeOptions(
        suite.model,
        model,
        transport,
        read_domain(domain),
        read_interface(interface),
        read_time_scale(time_scale),
        read_wait(wait or "10 s"),
        starts=True,
        real=chosen,
        via=read_via(via, chosen),
        bindings=bindings,
        logs=logs,
        failures=failures,
        planner=tuple(planner.words),
    )
    again = f"{asked.verb} {shown_path(str(model))}{suite.test_options}{asked.options}"
    code: int = load_named(RUN_OVER_NODES)(suite, output, asked, again)
    return code
