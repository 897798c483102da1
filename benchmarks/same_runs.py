"""Do random cases run over nodes as in simulation? `python benchmarks/same_runs.py --cases 100 --time-scale 50`.

Times differ, as messages and plans take time; and records of what the network did stand where the tester's notes come.
Everything else is compared, and each difference is listed: the first record that is another one, and what was close to
it in simulation. What is closer than a message takes, times the scale, may change its order.
"""

from __future__ import annotations

import argparse
import sys
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from msgspec import structs

from scbm.cases.trace import End, MessageDisturbed, Record, ResourceChanged
from scbm.files import digest_of, load_model, read_network
from scbm.nodes import Bus, Children, LoopbackCell, RemoteCell, Session
from scbm.nodes.cases_over_nodes import NodeTester
from scbm.testing import Execution, RandomCases, Tester

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.model import BehaviorModel
    from scbm.nodes.roles.session import Cell

ROOT = Path(__file__).parents[1]
_MS_NS = 1_000_000


def main() -> None:
    """Runs the cases over nodes and in simulation, and lists what differs."""
    options = _options()
    model = load_model(options.model)
    network = None if options.network == "drawn" else read_network(options.network, model)
    cases = list(RandomCases(model, None, network).first(options.cases, options.seed))
    tester = Tester(model)
    session = Session(_cell(options, model), model, digest_of(model), Fraction(options.time_scale), 20.0)
    session.warn = print
    begun = perf_counter()
    with session:
        executions = list(NodeTester(tester, session).executions(cases))
    took_s = perf_counter() - begun
    found = [_difference(real, tester.execute(case)) for case, real in zip(cases, executions, strict=True)]
    for case, difference in zip(cases, found, strict=True):
        if difference is not None:
            print(f"{case.name}: {difference}")
    late_ms = [_lag_ns(real, tester.execute(case)) / _MS_NS for case, real in zip(cases, executions, strict=True)]
    same = found.count(None)
    print(f"{same} of {len(cases)} runs are the same, in {took_s:.1f} s, at a time scale of {options.time_scale}")
    print(f"a step came {sorted(late_ms)[len(late_ms) // 2]:.2f} ms of the run late, the median of all cases")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, default=ROOT / "examples/robot_in_the_air/before.yaml")
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--network", default="latency: 0 s", help="as of scbm test; `drawn` for another one each")
    parser.add_argument("--transport", choices=["loopback", "dds"], default="loopback")
    parser.add_argument("--time-scale", default="50")
    parser.add_argument("--domain", type=int, default=0)
    return parser.parse_args()


def _cell(options: argparse.Namespace, model: BehaviorModel) -> Cell:
    if options.transport == "loopback":
        return LoopbackCell(digest_of(model))

    async def open_bus() -> Bus:
        from scbm.nodes.buses.dds import open_dds  # noqa: PLC0415 - cyclonedds may be missing

        return open_dds("scbm_tester", options.domain, print)

    nodes = [sys.executable, "-m", "scbm", "node"]
    common = [str(options.model), "--domain", str(options.domain), "--while-stdin"]
    commands = {f"the node of {role}": [*nodes, role, *common] for role in ("controller", "resources")}
    return RemoteCell(open_bus, Children(commands))


# what differs


def _difference(real: Execution, simulated: Execution) -> str | None:
    """Why two runs are not the same, in a sentence; `None` if they are."""
    if real.verdict.end is End.LOST:
        return f"lost: {real.verdict.failures[0]}"
    ours, theirs = _without_notes(real), _without_notes(simulated)
    for index, (one, other) in enumerate(zip(ours, theirs, strict=False)):
        if structs.replace(one, at_ns=0) != structs.replace(other, at_ns=0):
            return f"{_first(ours, theirs, index)}; {_close_by(theirs, index)}"
    if len(ours) != len(theirs):
        return f"{len(ours)} records, and {len(theirs)} in simulation; {_close_by(theirs, len(theirs) - 1)}"
    if _notes(real) != _notes(simulated):
        return f"notes of the network are {_notes(real)}, and {_notes(simulated)} in simulation"
    if (real.verdict, real.visited) != (simulated.verdict, simulated.visited):
        return f"the verdict is {real.verdict}, and {simulated.verdict} in simulation"
    return None


def _first(ours: Sequence[Record], theirs: Sequence[Record], index: int) -> str:
    one, other = ours[index], theirs[index]
    late_ms = (ours[index - 1].at_ns - theirs[index - 1].at_ns) / _MS_NS if index else 0.0
    late = f"when the run was {late_ms:.1f} ms late"
    return f"record {index + 1} is {_shown(one)}, and {_shown(other)} in simulation, {late}"


def _close_by(theirs: Sequence[Record], index: int) -> str:
    """How near in time the nearest two moments about a record are in simulation."""
    times = list(dict.fromkeys(record.at_ns for record in theirs[max(0, index - 60) : index + 60]))
    here = theirs[index].at_ns
    near = [later - earlier for earlier, later in pairwise(times) if abs(later - here) < 10 * 10**9]
    return f"moments there are at least {min(near, default=0) / _MS_NS:.1f} ms apart"


def _shown(record: Record) -> str:
    words = [str(value) for name, value in _fields(record) if name in ("request", "operation", "resource", "target")]
    return f"{record.kind} {' '.join(words)} at {record.at_ns / 1e9:.3f} s"


def _fields(record: Record) -> Iterable[tuple[str, object]]:
    return ((name, getattr(record, name)) for name in record.__struct_fields__)


def _lag_ns(real: Execution, simulated: Execution) -> float:
    """How late the run was at its end, for each of its moments."""
    moments = len(dict.fromkeys(record.at_ns for record in simulated.trace.records))
    return (real.ended_ns - simulated.ended_ns) / max(1, moments)


def _is_note(record: Record) -> bool:
    return isinstance(record, MessageDisturbed) or (
        isinstance(record, ResourceChanged) and record.injection == "network"
    )


def _without_notes(execution: Execution) -> list[Record]:
    return [record for record in execution.trace.records if not _is_note(record)]


def _notes(execution: Execution) -> list[str]:
    return sorted(str(structs.replace(record, at_ns=0)) for record in execution.trace.records if _is_note(record))


if __name__ == "__main__":
    main()
