"""Runs in wall time: nodes that exchange messages, and what carries these (paper, Figure 5)."""

from scbm.realtime.bus import Bus, BusError
from scbm.realtime.cell import Seat, new_status
from scbm.realtime.children import Children
from scbm.realtime.controller import ControllerNode
from scbm.realtime.reach import beyond_reach
from scbm.realtime.readiness import Lack, NotReadyError, Reason
from scbm.realtime.resources import ResourcesNode
from scbm.realtime.serving import Node, serve
from scbm.realtime.session import LoopbackCell, RemoteCell, Session
from scbm.realtime.tester import LostError, NodeRun, TesterNode

__all__ = [
    "Bus",
    "BusError",
    "Children",
    "ControllerNode",
    "Lack",
    "LoopbackCell",
    "LostError",
    "Node",
    "NodeRun",
    "NotReadyError",
    "Reason",
    "RemoteCell",
    "ResourcesNode",
    "Seat",
    "Session",
    "TesterNode",
    "beyond_reach",
    "new_status",
    "serve",
]
