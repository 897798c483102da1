"""Small models by hand."""

from __future__ import annotations

from msgspec.structs import replace

from scbm.files import read_model
from scbm.model import BehaviorModel, GoalOrder, RunsDeclaration, VariableSource
from scbm.model.sources import is_triggered

SCAN_CELL = """
behavior_model: scan_cell
variables:
  box_is_scanned: {domain: bool, initial: false}
  light: {domain: [green, red, blue], initial: green}
  count: {domain: 0..2, initial: 0}
  temperature: {domain: 0..9, initial: 5}
  scan_command: {domain: [none, scan_box], initial: none}
resources:
  scan:
    request: [scan_command]
    measures: [temperature]
operations:
  scan_box:
    deadline: 10 seconds
    pre:
      name: start_scan_box
      g: scan_req_state == initial && scan_req_trigger == false && box_is_scanned == false
      gr: light != red
      a: [scan_req_trigger <- true, scan_command <- scan_box]
    post:
      name: complete_scan_box
      g: true
      gr: scan_req_state == succeeded
      a: [scan_req_state <- initial, scan_req_trigger <- false, box_is_scanned <- true]
    timedout: [scan_req_trigger <- false]
automatic_transitions:
  scan_failed:
    g: scan_req_state == failed && current.state == executing
    a: [current.state <- failed, scan_req_state <- initial, scan_req_trigger <- false]
goals:
  scanned: box_is_scanned == true
"""

STOPPED = """
behavior_model: stopped
variables:
  item: {domain: [shelf, gripped, placed], initial: shelf}
  preempt: {domain: [none, asked], initial: none, source: state}
  stop: {domain: [up, down], initial: up}
resources:
  arm: {simulation: {latency: 4 s}}
operations:
  grip: {request: arm, deadline: 20 s, guard: item == shelf, effects: [item <- gripped]}
  place: {request: arm, deadline: 20 s, guard: item == gripped, effects: [item <- placed]}
automatic_transitions:
  ask: {g: stop == down && preempt == none && current.state == executing, a: [preempt <- asked]}
  leave: {g: preempt == asked && current.state == executing, a: [plan.state <- aborted]}
environment:
  press: {guard: stop == up, actions: [stop <- down], every: {exponential: 10 s}}
  pull: {guard: stop == down, actions: [stop <- up], after: 1 s}
goals:
  placed: {goal: item == placed, may_end: [aborted]}
"""
"""A stop sets a latch, which ends plans and which nothing resets."""

DRIVE = """
behavior_model: drive
variables:
  at_goal: {domain: bool, initial: false}
  cancel: {domain: [none, wanted], initial: none, source: input}
resources:
  controller: {simulation: {latency: 20 s}}
operations:
  follow_path:
    request: controller
    deadline: 60 s
    guard: at_goal == false && cancel == none
    effects: [at_goal <- true]
automatic_transitions:
  give_up: {g: cancel == wanted && plan.state == executing, a: [plan.state <- aborted]}
goals:
  arrived: {goal: at_goal == true, may_end: [aborted]}
"""
"""The user cancels a drive; the device may drive on."""


def scan_cell(*replacements: tuple[str, str], more: str = "", is_open: bool = False) -> BehaviorModel:
    """The paper's scanning cell, with texts replaced and sections added; in a closed world unless `is_open`."""
    text = SCAN_CELL
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    model = read_model(text + more)
    return model if is_open else as_closed(model)


def as_closed(model: BehaviorModel) -> BehaviorModel:
    """The model in a world in which only the model and replies change variables, and each run has one goal."""
    resources = tuple(r if is_triggered(r, model) else replace(r, measures=()) for r in model.resources)
    known = dict.fromkeys(name for resource in resources for name in (*resource.measures, *resource.publishes))
    variables = (
        v if v.source is not None or v.name in known else replace(v, source=VariableSource.STATE)
        for v in model.variables
    )
    return replace(model, variables=tuple(variables), resources=resources, runs=RunsDeclaration(GoalOrder.SINGLE))
