"""Options about nodes, and the parsing of their values."""

from __future__ import annotations

import os
import re
import socket
from enum import StrEnum
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from msgspec import Struct

from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import option_error, refuse_given
from scbm.cli.options.registry_options import NameOf
from scbm.files import load_bindings, load_model, parse_duration, suggestion
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import shell_word
from scbm.testing.transports import ALL_INTERFACES, DEFAULT_TRANSPORT, LOOPBACK, TRANSPORTS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.model import BehaviorModel

_ENVIRONMENT = "ROS_DOMAIN_ID"
_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_INTERFACE_OF_RANGE = {"": LOOPBACK, "LOCALHOST": LOOPBACK, "SUBNET": ALL_INTERFACES, "SYSTEM_DEFAULT": None}
_MAX_DIGITS = 9
_MAX_SCALE = 10_000
_SCALE = re.compile(r"\d{1,9}(\.\d{0,9})?|\.\d{1,9}|\d{1,9}/\d{1,9}", re.ASCII)
"""Numbers without exponents: a short text with an exponent can stand for billions of digits."""


class Via(StrEnum):
    """The middleware that reaches real drivers."""

    DDS = "dds"
    RCLPY = "rclpy"


def _between_processes() -> list[str]:
    return [name for name, transport in TRANSPORTS.items() if transport.joins_processes]


TestTransport = Annotated[
    str | None,
    NameOf(
        lambda: TRANSPORTS,
        HelpSection.NODES.option("--transport", help="Run over nodes, in this process or as processes."),
    ),
]
NodeTransport = Annotated[
    str | None,
    NameOf(
        _between_processes,
        HelpSection.NODES.option("--transport", help=f"What carries the messages between nodes. [{DEFAULT_TRANSPORT}]"),
    ),
]
TimeScale = Annotated[
    str | None,
    HelpSection.NODES.option(
        "--time-scale", metavar="FACTOR", help="Speed of runs over nodes relative to the wall clock. [1]"
    ),
]
Logs = Annotated[
    Path | None, HelpSection.NODES.option("--logs", metavar="DIRECTORY", help="Save the log of every run over nodes.")
]
Domain = Annotated[
    int | None, HelpSection.NODES.option("--domain", metavar="N", help="DDS domain, 0 to 232. [ROS_DOMAIN_ID, or 0]")
]
Interface = Annotated[
    str | None,
    HelpSection.NODES.option(
        "--interface",
        metavar="NAME",
        help="Network interface of DDS, or `all`. [CYCLONEDDS_URI, ROS_AUTOMATIC_DISCOVERY_RANGE, loopback]",
    ),
]
Real = Annotated[
    list[str] | None,
    HelpSection.NODES.option("--real", metavar="NAME", help="Reach this resource at its driver; else it is simulated."),
]
Reached = Annotated[
    Via | None,
    HelpSection.NODES.option(
        "--via", help="Reach drivers by plain DDS, or by the rclpy of an installation of ROS 2. [dds]"
    ),
]
StartWithin = Annotated[
    str,
    HelpSection.NODES.option(
        "--start-within", metavar="DURATION", help="Drop a tester that prepares a run and starts none in this time."
    ),
]
WhileStdin = Annotated[
    bool,
    HelpSection.NODES.option("--while-stdin", help="End when the standard input ends: for programs that start nodes."),
]


def read_real(names: Sequence[str], model: BehaviorModel) -> tuple[str, ...]:
    """Return the real resources in the order of the model. Raise `InputError`."""
    bound = [resource.name for resource in model.resources if resource.binding is not None]
    wrong = []
    for name in dict.fromkeys(names):
        if name in bound:
            continue
        if any(resource.name == name for resource in model.resources):
            message, remedy = (
                f"`{name}` is not bound to a driver",
                "say how it is reached under `ros`, or by `--bindings`",
            )
        else:
            known = suggestion(name, [resource.name for resource in model.resources], "its resources are")
            message = f"the model has no resource `{name}`"
            remedy = known or "it has none"
        place = Place("--real", 1, 1, max(1, len(name)))
        wrong.append(Diagnostic(Slug.UNKNOWN_RESOURCE, message, place, remedy, name))
    if wrong:
        raise InputError(wrong)
    return tuple(name for name in bound if name in names)


def read_via(via: Via | None, real: Sequence[str]) -> Via:
    """Return the middleware for real resources. Raise `InputError` if there are none."""
    if via is not None and not real:
        message = "this is for real resources, and all are simulated"
        raise option_error("--via", message, "add `--real NAME`")
    return via or Via.DDS


def load_bound(model: Path, bindings: Path | None) -> BehaviorModel:
    """Return the model of a file with the bindings of another file. Raise `InputError`."""
    loaded = load_model(model)
    return loaded if bindings is None else load_bindings(bindings, loaded)


def read_domain(domain: int | None) -> int:
    """Return the DDS domain of the option or of the environment. Raise `InputError`."""
    named = os.environ.get(_ENVIRONMENT, "").strip()
    if domain is None and named:
        if not named.isascii() or not named.isdigit() or len(named) > _MAX_DIGITS:
            message = f"its value {named[:40]} is not a number"
            raise option_error(_ENVIRONMENT, message, "set it to 0 to 232")
        return _known_domain(int(named), _ENVIRONMENT)
    return _known_domain(domain or 0, "--domain")


def read_interface(interface: str | None) -> str | None:
    """Return the network interface of nodes, as an option or the environment says; `None` for what Cyclone DDS is told.

    The first that is given decides: the option, `CYCLONEDDS_URI`, `ROS_AUTOMATIC_DISCOVERY_RANGE`. Raise `InputError`.
    """
    if interface is not None:
        return _known_interface(interface)
    if os.environ.get("CYCLONEDDS_URI", "").strip():
        return None
    named = os.environ.get(_RANGE, "").strip()
    if named not in _INTERFACE_OF_RANGE:
        message = f"its value {named[:40]} is not a range in which nodes find each other"
        raise option_error(_RANGE, message, "set it to LOCALHOST or SUBNET, or give `--interface`")
    return _INTERFACE_OF_RANGE[named]


def _known_interface(name: str) -> str:
    names = [known for _, known in socket.if_nameindex()]
    if name in ("lo", LOOPBACK):
        return LOOPBACK
    if name not in (*names, ALL_INTERFACES):
        remedy = suggestion(name, [LOOPBACK, ALL_INTERFACES, *names], "write")
        raise option_error("--interface", f"this machine has no network interface `{name}`", remedy, name)
    return name


ALONE = "no other node has been found: nodes look on loopback only; `--interface all` opens the network"
"""Reported by a node on loopback that finds no other one."""


def _known_domain(domain: int, place: str) -> int:
    if not 0 <= domain <= 232:  # noqa: PLR2004 - ports run out there (RTPS 9.6.1.1)
        message = f"there is no DDS domain {domain}"
        raise option_error(place, message, "domains are 0 to 232")
    return domain


def read_time_scale(text: str | None) -> Fraction:
    """Return the factor between simulated time and wall time. Raise `InputError`."""
    if text is None:
        return Fraction(1)
    try:
        scale = Fraction(text.strip() if _SCALE.fullmatch(text.strip()) else 0)
    except ZeroDivisionError:
        scale = Fraction(0)
    if not 0 < scale <= _MAX_SCALE or scale.denominator > _MAX_SCALE:
        message = f"`{text}` is not a factor between 0 and {_MAX_SCALE}"
        remedy = "write how many seconds of a run pass in one of the wall: `20`, `0.5`"
        raise option_error("--time-scale", message, remedy, text)
    return scale


def refuse_faster(time_scale: str | None, real: Sequence[str]) -> None:
    """Raise `InputError` for a time scale other than 1 with real resources."""
    if real and read_time_scale(time_scale) != 1:
        message = f"`{real[0]}` is real, and cannot be made faster or slower"
        raise option_error("--time-scale", message, "leave it out")


def read_wait(text: str) -> float:
    """Return how many seconds to wait for nodes. Raise `InputError`."""
    return _read_seconds("--wait", text)


def read_start_within(text: str) -> float:
    """Return after how many seconds a tester that starts no run is dropped. Raise `InputError`."""
    seconds = _read_seconds("--start-within", text)
    if not seconds:
        raise option_error("--start-within", "no tester starts a run in no time", "write a longer time: `10 s`", text)
    return seconds


def _read_seconds(option: str, text: str) -> float:
    duration_ns = parse_duration(text)
    if duration_ns is None:
        remedy = "write a number and a unit: `10 s`"
        raise option_error(option, f"`{text}` is not a duration", remedy, text, Slug.BAD_DURATION)
    return duration_ns / 1e9


class NodeOptions(Struct, frozen=True):
    """The options about nodes of a command line.

    Attributes:
        model, file: the model and its file.
        transport: an entry of `TRANSPORTS`.
        domain: the number of the domain, for a transport between processes.
        interface: the network interface, or `None` for the configuration of Cyclone DDS.
        time_scale: the number of simulated seconds in a second of wall time.
        wait_s: the timeout for nodes to join.
        starts: whether this process starts controller and resources.
        real: the resources with real drivers.
        via: the middleware that reaches the drivers.
        bindings: the bindings file for them; `None` for the bindings of the model.
        logs: the directory for the log of each run; `None` saves only the logs of failed cases.
        failures: the directory for the logs of failed cases.
        planner: the options for the planner of a controller that is started here.
    """

    model: BehaviorModel
    file: Path
    transport: str
    domain: int
    interface: str | None
    time_scale: Fraction
    wait_s: float
    starts: bool
    real: tuple[str, ...]
    via: Via
    bindings: Path | None
    logs: Path | None
    failures: Path
    planner: tuple[str, ...] = ()

    @property
    def verb(self) -> str:
        """The command that runs cases over these nodes, without model and options."""
        return "scbm test" if self.starts else "scbm node tester"

    @property
    def options(self) -> str:
        """The options that give the same nodes, each with a leading blank."""
        transport = f" --transport {self.transport}" if self.starts else transport_option(self.transport)
        domain = f" --domain {self.domain}{self.interface_option}" if TRANSPORTS[self.transport].joins_processes else ""
        scale = "" if self.time_scale == 1 else f" --time-scale {self.time_scale}"
        bindings = "" if self.bindings is None else f" --bindings {shell_word(str(self.bindings))}"
        real = "".join(f" --real {name}" for name in self.real)
        via = "" if self.via is Via.DDS else f" --via {self.via}"
        return f"{transport}{domain}{scale}{bindings}{real}{via}"

    @property
    def interface_option(self) -> str:
        """The option that gives the same interface, with a blank before it; nothing for the default."""
        return "" if self.interface in (None, LOOPBACK) else f" --interface {self.interface}"

    @property
    def where(self) -> str:
        """The domain or the hub that the nodes join."""
        return TRANSPORTS[self.transport].where(self.domain)

    @property
    def words(self) -> str:
        """A description of the nodes, for the report."""
        fast = "" if self.time_scale == 1 else f", {float(self.time_scale):g} times faster than the wall clock"
        return f"over {self.where}{fast}"


def refuse_without_transport(options: Mapping[str, object]) -> None:
    """Raise `InputError` for options about nodes without `--transport`."""
    message = "this option is for runs over nodes, and these cases run in simulation"
    refuse_given(options, message, f"add {' or '.join(f'`--transport {name}`' for name in reversed(TRANSPORTS))}")


def refuse_with_nodes(options: Mapping[str, object]) -> None:
    """Raise `InputError` for options of simulated campaigns where the cases run over nodes, one after the other."""
    message = "this option is for cases in simulation, and these cases run over nodes"
    refuse_given(options, message, "leave out this option, or `--transport`")


def refuse_in_one_process(transport: str, options: Mapping[str, object]) -> None:
    """Raise `InputError` for options about drivers and domains if the transport joins no processes."""
    if not TRANSPORTS[transport].joins_processes:
        message = f"with `--transport {transport}` all nodes run in this process, without drivers and domains"
        refuse_given(options, message, f"use {' or '.join(f'`--transport {name}`' for name in _between_processes())}")


def transport_option(transport: str) -> str:
    """Return the option that names a transport for `scbm node`, with a blank before it; nothing for the default."""
    return "" if transport == DEFAULT_TRANSPORT else f" --transport {transport}"
