"""Runs in wall time: nodes that exchange messages over a bus (paper, Figure 5)."""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.nodes.buses.bus import Bus, BusError
    from scbm.nodes.roles.cell_topics import NodeContext, new_status
    from scbm.nodes.roles.controller import ControllerNode
    from scbm.nodes.roles.node_process import Children, ServedNode, serve
    from scbm.nodes.roles.readiness import Lack, NotReadyError, Reason, beyond_reach
    from scbm.nodes.roles.resources_node import ResourcesNode
    from scbm.nodes.roles.session import LoopbackCell, RemoteCell, Session
    from scbm.nodes.roles.tester_node import LostError, NodeRun, NotBegunError, TesterNode

__all__ = [
    "Bus",
    "BusError",
    "Children",
    "ControllerNode",
    "Lack",
    "LoopbackCell",
    "LostError",
    "NodeContext",
    "NodeRun",
    "NotBegunError",
    "NotReadyError",
    "Reason",
    "RemoteCell",
    "ResourcesNode",
    "ServedNode",
    "Session",
    "TesterNode",
    "beyond_reach",
    "new_status",
    "serve",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "buses.bus": "Bus BusError",
        "roles.cell_topics": "NodeContext new_status",
        "roles.controller": "ControllerNode",
        "roles.node_process": "Children ServedNode serve",
        "roles.readiness": "Lack NotReadyError Reason beyond_reach",
        "roles.resources_node": "ResourcesNode",
        "roles.session": "LoopbackCell RemoteCell Session",
        "roles.tester_node": "LostError NodeRun NotBegunError TesterNode",
    },
)
