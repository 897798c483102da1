"""The verbs of the command line: their modules, which are imported only where a verb is asked for."""

from __future__ import annotations

from typing import NamedTuple


class VerbEntry(NamedTuple):
    """A verb of the command line.

    Attributes:
        module: the module whose function `command` runs it and returns an exit code.
        summary: what it does, in one sentence; the docstring of `command` is the same.
    """

    module: str
    summary: str


VERBS: dict[str, VerbEntry] = {
    "init": VerbEntry(
        "scbm.cli.verbs.init",
        "Write a new folder with a model, cases, tests for pytest and a CI job, to start from.",
    ),
    "check": VerbEntry(
        "scbm.cli.verbs.check",
        "Report the errors of model files, and warnings about models that load.",
    ),
    "show": VerbEntry("scbm.cli.verbs.show", "Show the size of a model, or the model with everything written out."),
    "draw": VerbEntry(
        "scbm.drawing.draw",
        "Draw what changes each variable of a model, or the plan to a goal, colored by what the tests did.",
    ),
    "plan": VerbEntry(
        "scbm.cli.verbs.plan",
        "Find a plan to a goal, or show why there is none; without `--goal` for each goal of the model.",
    ),
    "run": VerbEntry("scbm.cli.verbs.run", "Run one goal against simulated resources, and show what happens."),
    "console": VerbEntry(
        "scbm.web.console",
        "Open a page to run a model step by step: each click is a line of a test case.",
    ),
    "test": VerbEntry(
        "scbm.cli.verbs.test",
        "Run case files and random cases, judge them, and report their coverage of the model.",
    ),
    "mutate": VerbEntry(
        "scbm.mutation.mutate",
        "Change the model in one small way at a time, and report which changes its cases notice.",
    ),
    "close": VerbEntry(
        "scbm.cli.verbs.close",
        "Generate cases for unvisited obligations, or prove that no run visits them; `--check` checks such proofs.",
    ),
    "explain": VerbEntry(
        "scbm.cli.verbs.explain",
        "Show how a case visits an obligation, such as `scan/failed`, or why no case does.",
    ),
    "replay": VerbEntry(
        "scbm.cli.verbs.replay",
        "Run a case file or the log of a real run again, and compare the run with the recorded one.",
    ),
    "trace": VerbEntry(
        "scbm.cli.verbs.trace",
        "Run a case or the log of a real run again, and write what happens as a file that Perfetto or Foxglove opens.",
    ),
    "combine": VerbEntry("scbm.cli.verbs.combine", "Combine coverage stores of one model into one store."),
    "report": VerbEntry("scbm.cli.verbs.report", "Report what the cases of a coverage store visited, in any format."),
    "schema": VerbEntry(
        "scbm.cli.verbs.schema",
        "Print the JSON Schema of model files, case files, files of bindings, of waivers or of parts.",
    ),
    "help": VerbEntry(
        "scbm.cli.verbs.message_help",
        "Explain an error or a warning, such as `unknown-variable`, with an example and a remedy.",
    ),
    "import pddl": VerbEntry(
        "scbm.pddl.import_pddl",
        "Write a model for a domain and a problem of PDDL, with its types, predicates and actions.",
    ),
    "export pddl": VerbEntry(
        "scbm.cli.verbs.export_pddl",
        "Write the planning part of a model as PDDL: a domain, and a problem for each goal.",
    ),
    "node controller": VerbEntry(
        "scbm.nodes.verbs.node_controller",
        "Run the controller of a cell: it runs what a tester sends, until you stop it.",
    ),
    "node resources": VerbEntry(
        "scbm.nodes.verbs.node_resources",
        "Simulate resources of a cell: they answer requests, until you stop them.",
    ),
    "node tester": VerbEntry(
        "scbm.nodes.verbs.node_tester",
        "Run cases in a cell whose controller and resources run elsewhere, and report as `scbm test` does.",
    ),
}
"""All verbs, in the order of the help. A verb of two words is in the group that the first names."""
