"""The network of a case: values of the registered kinds of faults."""

from __future__ import annotations

import pickle
from fractions import Fraction

import pytest

from scbm.cases import NETWORK_FAULTS, FaultAction, Network, Partition, Restart, WindowFault

PARTITIONS = (Partition(1, 2, "arm"), Partition(3, 4))
DISTURBED = Network(
    latency_ns=5, loss=Fraction(1, 50), held_back_ns=7, partitions=PARTITIONS, restarts=(Restart("arm", 9),)
)


def test_a_kind_without_a_value_has_its_default() -> None:
    assert [getattr(Network(), fault.attribute) for fault in NETWORK_FAULTS.values()] == [
        fault.default for fault in NETWORK_FAULTS.values()
    ]
    assert Network(loss=Fraction(0), partitions=()) == Network()
    assert hash(Network(latency_ns=5)) == hash(Network(latency_ns=5)) != hash(Network())


def test_only_registered_kinds_have_values() -> None:
    with pytest.raises(TypeError, match="latency"):
        Network(latency=5)
    with pytest.raises(AttributeError, match="latency"):
        _ = Network().latency


def test_a_network_is_sent_to_other_processes() -> None:
    assert pickle.loads(pickle.dumps(DISTURBED)) == DISTURBED  # noqa: S301 - our own bytes
    assert repr(DISTURBED) == repr(pickle.loads(pickle.dumps(DISTURBED)))  # noqa: S301 - our own bytes


def test_one_value_is_replaced() -> None:
    changed = DISTURBED.with_value(NETWORK_FAULTS["latency"], 0)
    assert (changed.latency_ns, changed.loss, changed.partitions) == (0, Fraction(1, 50), PARTITIONS)


def test_a_saved_run_keeps_the_faults_that_its_reactions_do_not_record() -> None:
    assert DISTURBED.kept == Network(partitions=PARTITIONS, restarts=(Restart("arm", 9),))
    assert Network(held_back_ns=7).kept == Network()


def test_windows_are_listed_in_the_order_of_the_registry() -> None:
    listed = [(fault.window_name, index, window.resource) for fault, index, window in DISTURBED.windows()]
    assert listed == [("partition", 0, "arm"), ("partition", 1, None), ("restart", 0, "arm")]
    assert DISTURBED.restarts_of_resources == (Restart("arm", 9),)


@pytest.mark.parametrize("name", NETWORK_FAULTS)
def test_every_kind_is_whole(name: str) -> None:
    fault = NETWORK_FAULTS[name]
    assert fault.name == name
    assert fault.help_text.endswith(".")
    assert fault.is_random <= (fault.action in (FaultAction.LOSE, FaultAction.DELAY, FaultAction.COPY))
    assert isinstance(fault, WindowFault) or fault.action is not FaultAction.DOWN
