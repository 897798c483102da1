"""What command lines say of nodes, and the logs that they save."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.cli.options.node_options import NodeOptions, Via, read_domain, read_interface, read_time_scale
from scbm.cli.options.option_values import read_requirements
from scbm.cli.output.progress import CampaignLines
from scbm.files import load_model, read_model
from scbm.model import InputError, Slug
from scbm.nodes import Lack, NotReadyError, Reason
from scbm.nodes.verbs.over_nodes import Waiting, cell_error
from scbm.testing import RandomCases, Tester
from scbm.testing.batches.batch_summary import SummaryBuilder
from support.models import SCAN_CELL
from support.wording import Wording, diagnostic_heads

AFTER = load_model(Path(__file__).parents[4] / "examples/robot_in_the_air/after.yaml")


@pytest.fixture
def scbm(scbm: Callable[..., Any]) -> Callable[..., Any]:
    """Runs a command line in a thread of its own: the main thread may have an event loop already, of the browser's."""

    def run(*arguments: object) -> Any:  # noqa: ANN401 - what the fixture of all tests gives
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(scbm, *arguments).result()

    return run


@pytest.mark.parametrize(
    ("text", "scale"), [("20", 20), ("0.5", Fraction(1, 2)), (" 1/3 ", Fraction(1, 3)), (".25", Fraction(1, 4))]
)
def test_a_time_scale_is_a_fraction(text: str, scale: Fraction) -> None:
    assert read_time_scale(text) == scale


@pytest.mark.parametrize(
    "text", ["", "0", "-1", "1/0", "nan", "inf", "1e99999999", "10001", "1/10001", "9" * 5_000, "¹"]
)
def test_what_is_no_factor_of_time_is_refused_at_once(text: str) -> None:
    with pytest.raises(InputError) as refused:
        read_time_scale(text)
    (diagnostic,) = refused.value.diagnostics
    assert (diagnostic.slug, str(diagnostic.place)) == (Slug.BAD_OPTION, "--time-scale:1:1")


@pytest.mark.parametrize("named", ["x", "-1", "¹", "9" * 5_000])
def test_a_domain_of_the_environment_that_is_no_number_is_refused(named: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", named)
    with pytest.raises(InputError) as refused:
        read_domain(None)
    (diagnostic,) = refused.value.diagnostics
    assert (diagnostic.slug, str(diagnostic.place)) == (Slug.BAD_OPTION, "ROS_DOMAIN_ID")
    assert read_domain(7) == 7


def test_a_domain_that_does_not_exist_is_reported_where_it_is_set(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "233")
    for domain, place in ((None, "ROS_DOMAIN_ID"), (-1, "--domain")):
        with pytest.raises(InputError) as refused:
            read_domain(domain)
        (diagnostic,) = refused.value.diagnostics
        assert (diagnostic.slug, str(diagnostic.place)) == (Slug.BAD_OPTION, place)
        wording(diagnostic)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "model.yaml"
    path.write_text(SCAN_CELL, encoding="utf-8")
    return path


def over_loopback(model: Path, *more: object) -> tuple[object, ...]:
    return ("test", model, "--cases", 2, "--transport", "loopback", "--time-scale", 20, *more)


def test_the_log_of_each_run_is_saved_and_shows_the_run_again_and_replaces_none(
    scbm: Callable[..., Any], model: Path, tmp_path: Path, wording: Wording
) -> None:
    logs = tmp_path / "logs"
    ran = scbm(*over_loopback(model, "--logs", logs))
    wording(ran.err)
    saved = sorted(logs.iterdir())
    assert [path.name for path in saved] == ["seed-0-case-1.log", "seed-0-case-2.log"]
    for path in saved:
        assert scbm("replay", path).err == ""
    before = [path.read_bytes() for path in saved]
    assert scbm(*over_loopback(model, "--logs", logs, "--json")).err == ""
    assert [path.read_bytes() for path in saved] == before
    names = ["seed-0-case-1-2.log", "seed-0-case-1.log", "seed-0-case-2-2.log", "seed-0-case-2.log"]
    assert sorted(path.name for path in logs.iterdir()) == names
    assert scbm("replay", logs / "seed-0-case-1-2.log").err == ""


def test_logs_that_cannot_be_saved_are_refused_before_the_first_case(
    scbm: Callable[..., Any], model: Path, tmp_path: Path, wording: Wording
) -> None:
    logs = tmp_path / "logs"
    logs.write_text("a file", encoding="utf-8")
    ran = scbm(*over_loopback(model, "--logs", logs))
    assert (ran.code, ran.out) == (2, "")
    assert "error[bad-option]" in ran.err
    wording(ran.err)
    assert logs.read_text(encoding="utf-8") == "a file"


def test_logs_of_failing_cases_that_cannot_be_saved_are_reported_once_and_the_report_goes_on(
    scbm: Callable[..., Any], model: Path, tmp_path: Path, wording: Wording
) -> None:
    failures = tmp_path / "failures"
    failures.write_text("a file", encoding="utf-8")
    ran = scbm(*over_loopback(model, "--require", "always box_is_scanned == true", "--failures", failures))
    assert ran.code == 2
    assert "error[bad-option]" in ran.err
    wording(ran.err)
    assert "SCBM-IAS" in ran.out
    assert failures.read_text(encoding="utf-8") == "a file"


@pytest.mark.parametrize(
    ("option", "uri", "named", "interface"),
    [
        (None, None, None, "loopback"),
        (None, None, "LOCALHOST", "loopback"),
        (None, None, "SUBNET", "all"),
        (None, None, "SYSTEM_DEFAULT", None),
        (None, "<CycloneDDS/>", "LOCALHOST", None),
        (None, " ", "SUBNET", "all"),
        ("all", "<CycloneDDS/>", "LOCALHOST", "all"),
        ("loopback", "<CycloneDDS/>", "SUBNET", "loopback"),
        ("lo", None, "SUBNET", "loopback"),
    ],
)
def test_the_first_setting_of_the_interface_decides(
    option: str | None, uri: str | None, named: str | None, interface: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable, value in (("CYCLONEDDS_URI", uri), ("ROS_AUTOMATIC_DISCOVERY_RANGE", named)):
        if value is None:
            monkeypatch.delenv(variable, raising=False)
        else:
            monkeypatch.setenv(variable, value)
    assert read_interface(option) == interface


@pytest.mark.parametrize("named", ["OFF", "subnet"])
def test_a_range_in_which_no_node_is_found_is_refused(
    named: str, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", named)
    with pytest.raises(InputError) as raised:
        read_interface(None)
    assert [str(shown.place) for shown in raised.value.diagnostics] == ["ROS_AUTOMATIC_DISCOVERY_RANGE"]
    wording(raised.value)


@pytest.mark.parametrize("role", ["controller", "resources", "tester"])
def test_an_interface_that_the_machine_lacks_is_refused(
    scbm: Callable[..., Any], model: Path, role: str, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("socket.if_nameindex", lambda: [(1, "lo"), (2, "eth0")])
    ran = scbm("node", role, model, "--interface", "eth1")
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err)


def test_an_interface_is_for_nodes_that_are_processes(scbm: Callable[..., Any], model: Path, wording: Wording) -> None:
    for command in (("test", model), over_loopback(model)):
        ran = scbm(*command, "--interface", "all")
        assert (ran.code, ran.out) == (2, "")
        wording(ran.err)


@pytest.mark.parametrize("interface", ["loopback", "all", None])
def test_a_driver_that_is_looked_for_on_loopback_may_be_elsewhere(interface: str | None, wording: Wording) -> None:
    error = NotReadyError([Reason(Lack.DRIVER, "why")])
    wording(cell_error(error, asked(interface=interface)).diagnostics[0].remedy)


def test_remedies_and_commands_have_the_interface(wording: Wording) -> None:
    error = NotReadyError([Reason(Lack.CONTROLLER, "why")])
    wording(cell_error(error, asked(interface="all")).diagnostics[0].remedy)
    assert asked(interface="all").options.endswith(" --interface all")


def asked(*, starts: bool = False, domain: int = 0, interface: str | None = None) -> NodeOptions:
    return NodeOptions(
        AFTER,
        Path("a b.yaml"),
        "dds",
        domain,
        interface,
        Fraction(1),
        10.0,
        starts=starts,
        real=(),
        via=Via.DDS,
        bindings=None,
        logs=None,
        failures=Path("x"),
    )


ALL = tuple(resource.name for resource in AFTER.resources)


@pytest.mark.parametrize(
    ("lack", "resources", "commands"),
    [
        (Lack.RIVAL, (), []),
        (Lack.MODEL, (), []),
        (Lack.CONTROLLER, (), ["scbm node controller 'a b.yaml'"]),
        (Lack.CONTROLLER, ALL, ["scbm node controller 'a b.yaml'", "scbm node resources 'a b.yaml'"]),
        (Lack.RESOURCES, ("gripper", "robot"), ["scbm node resources 'a b.yaml' gripper robot"]),
        (Lack.DRIVER, (), []),
        (Lack.BINDING, (), []),
        (Lack.SERVERS, (), []),
        (Lack.TIME_SCALE, (), ["--time-scale"]),
    ],
)
def test_each_thing_that_a_cell_lacks_has_its_own_remedy(
    lack: Lack, resources: tuple[str, ...], commands: list[str], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    (shown,) = cell_error(NotReadyError([Reason(lack, "why", resources)]), asked()).diagnostics
    assert (shown.slug, str(shown.place), shown.message) == (Slug.CELL_INCOMPLETE, "DDS domain 0", "why")
    assert (shown.remedy or "").split("`")[1::2] == commands
    wording(shown.remedy)


@pytest.mark.parametrize("lack", Lack)
def test_nothing_that_a_cell_lacks_is_without_a_remedy(lack: Lack) -> None:
    for starts in (True, False):
        (shown,) = cell_error(NotReadyError([Reason(lack, "x", ("robot",))]), asked(starts=starts)).diagnostics
        assert shown.remedy


def test_a_remedy_names_the_domain_if_that_is_not_what_the_other_terminal_takes(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    error = NotReadyError([Reason(Lack.RESOURCES, "x", ("robot",))])
    (shown,) = cell_error(error, asked(domain=7)).diagnostics
    wording(shown.remedy)
    monkeypatch.setenv("ROS_DOMAIN_ID", "3")
    (shown,) = cell_error(error, asked()).diagnostics
    wording(shown.remedy)


def test_what_is_waited_for_is_reported_once_and_nodes_that_are_started_here_need_no_words(wording: Wording) -> None:
    missing, driver = Reason(Lack.CONTROLLER, "no controller"), Reason(Lack.DRIVER, "`robot` is not reached")
    messages: list[str] = []
    waiting = Waiting(asked(), messages.append)
    waiting([missing, driver])
    waiting([driver])
    wording(messages)
    messages.clear()
    waiting = Waiting(asked(starts=True), messages.append)
    waiting([missing])
    waiting([missing, driver])
    waiting([driver])
    wording(messages)


@pytest.fixture
def real(model: Path) -> tuple[object, ...]:
    """The options that make the only resource of the model real."""
    bindings = model.with_name("bindings.yaml")
    bindings.write_text(
        "bindings_of: scan_cell\nresources: {scan: {topics: {request: /scan/request, reply: /scan/reply}}}\n",
        encoding="utf-8",
    )
    return ("--transport", "dds", "--bindings", bindings, "--real", "scan")


def test_cases_that_say_what_becomes_of_real_resources_are_all_refused_before_anything_runs(
    scbm: Callable[..., Any], model: Path, real: tuple[object, ...], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("scbm.nodes.verbs.over_nodes.over_nodes", None)
    cases = []
    for name, more in (("good", ""), ("scan_fails", "outcomes: {scan_box: fail}"), ("late", "network: {latency: 1 s}")):
        cases.append(model.with_name(f"{name}.yaml"))
        cases[-1].write_text(f"case: {name}\ngoal: scanned\n{more}\n", encoding="utf-8")
    ran = scbm("test", model, *cases, "--cases", 3, "--network", "latency: 1 ms", *real)
    assert (ran.code, ran.out) == (2, "")
    assert diagnostic_heads(ran.err) == [
        f"{cases[1]}: error[beyond-reach]",
        f"{cases[2]}: error[beyond-reach]",
        "--real: error[beyond-reach]",
    ]
    wording(ran.err)


def test_a_tester_refuses_such_cases_once_the_controller_has_reported_what_is_real(
    scbm: Callable[..., Any], model: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    whole = SimpleNamespace(real=("scan",), results=None)
    monkeypatch.setattr("scbm.nodes.verbs.over_nodes.over_nodes", lambda *_: nullcontext(whole))
    case = model.with_name("scan_fails.yaml")
    case.write_text("case: scan_fails\ngoal: scanned\noutcomes: {scan: fail}\n", encoding="utf-8")
    ran = scbm("node", "tester", model, case, "--cases", 1, "--network", "latency: 1 ms")
    assert (ran.code, ran.out) == (2, "")
    assert "error[beyond-reach]" in ran.err
    wording(ran.err)
    assert "error[beyond-reach]" in ran.err


def test_real_resources_have_no_scale_of_time(
    scbm: Callable[..., Any], model: Path, real: tuple[object, ...], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("scbm.nodes.verbs.over_nodes.over_nodes", None)
    ran = scbm("test", model, *real, "--time-scale", 2)
    assert (ran.code, ran.out) == (2, "")
    assert "error[bad-option]" in ran.err
    wording(ran.err)


def test_a_wait_is_for_nodes(scbm: Callable[..., Any], model: Path, wording: Wording) -> None:
    for command in (("test", model, "--wait", "1 s"), over_loopback(model, "--wait", "soon")):
        ran = scbm(*command)
        assert (ran.code, ran.out) == (2, "")
        wording(ran.err)


@pytest.mark.parametrize("role", ["controller", "resources"])
@pytest.mark.parametrize("time", ["soon", "0 s"])
def test_a_tester_needs_time_to_start_a_run(
    scbm: Callable[..., Any], model: Path, role: str, time: str, wording: Wording
) -> None:
    ran = scbm("node", role, model, "--start-within", time)
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err)


def test_without_a_terminal_each_case_has_a_line_once_a_campaign_takes_long(wording: Wording) -> None:
    model = read_model(SCAN_CELL)
    tester, shown = Tester(model), list[str]()
    cases = list(RandomCases(model).first(3, 0))
    fails = replace(cases[2], requirements=read_requirements(["always box_is_scanned == true"], model))
    times_s = iter([100.0, 109.9, 110.0, 300.0])
    obligations = Obligations.of(model)
    lines = CampaignLines(3, obligations, lambda text, _: shown.append(text), lambda: next(times_s), each_case=True)
    builder = SummaryBuilder(len(obligations.all))
    for position, result in enumerate(tester.results([*cases[:2], fails]), start=1):
        builder.add(result.outcome(position))
        lines.advance(builder.summary(), result)
    wording(shown[0])
    assert shown[1].startswith("3 of 3: seed-0-case-3 ")
    assert ", failed: " in shown[1]
    assert len(shown) == 2
