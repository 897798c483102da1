"""The keys of an action: how requests become goals of it, and its results replies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.codec.keys import Key, Keys
from scbm.nodes.bindings.field_values import FieldReader
from scbm.nodes.bindings.ros_binding import ActionCall
from scbm.nodes.bindings.ros_names import ROS_NAME, SharedNames
from scbm.nodes.bindings.service_keys import CONTENTS, FIELD_READINGS, FIELD_VALUES, read_measured
from scbm.nodes.bindings.type_names import TYPE_NAME

if TYPE_CHECKING:
    from scbm.model.resources import Resource


class ActionKeys(Keys):
    """An action, and how requests become goals of it."""

    name = Key(ROS_NAME, "The name of the action, from the root: `/gantry/follow_joint_trajectory`.", required=True)
    type = Key(TYPE_NAME, "The type of the action: `control_msgs/action/FollowJointTrajectory`.", required=True)
    goal = Key(CONTENTS, "What fields of a goal get, as under `request` of a service.")
    succeeded = Key(
        FIELD_VALUES,
        "The field values of a result that reports success, beside the status SUCCEEDED.",
        absent="`{}`",
    )
    measured = Key(FIELD_READINGS, "For variables under `measures`: the field of the result that measures each.")
    feedback = Key(FIELD_READINGS, "For variables under `publishes`: the field of the feedback that measures each.")

    def call(self, resource: Resource, shared: SharedNames) -> ActionCall | None:
        """Return the action for requests to a resource; valid only if no error is noted."""
        if not isinstance(self.node.plain, dict):
            return None
        kind = shared.action(self.type) if self.type is not None else None
        if kind is None:
            return None
        place = self.node.items["type"].place
        if self.name is not None:
            shared.note("action", self.name, kind, place)
        goals = FieldReader(self.reader, kind.goal, f"a goal of `{kind.name}`")
        results = FieldReader(self.reader, kind.result, f"a result of `{kind.name}`")
        feedback = FieldReader(self.reader, kind.feedback, f"feedback of `{kind.name}`")
        return ActionCall(
            self.name or "",
            kind,
            goals.request(self.goal, self.node.get("goal"), resource, place),
            tuple(results.succeeded(self.succeeded or ())),
            tuple(read_measured(self.measured, resource, results)),
            tuple(read_measured(self.feedback, resource, feedback, is_published=True)),
        )
