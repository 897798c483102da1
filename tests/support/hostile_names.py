"""A model whose names and values mean something in SVG, HTML, Markdown or Mermaid; no file can have most of them."""

from __future__ import annotations

from scbm.model import Assign, BehaviorModel, Constant, Domain, Equal, Operation, Reference, Transition, Truth, Variable

HOSTILE = (
    "end",
    "state",
    "note right of s0: x",
    'a"b',
    "c:d;e",
    "<script>alert(1)</script>",
    "x]]>y",
    "&amp; #35; %% {{z}}",
    "`tick`|pipe",
    "[*] --> s0",
    "\x00\x1b[31m\u202ered",
)
"""Names and values; the last one has control characters and a bidirectional mark."""


def hostile_model() -> BehaviorModel:
    """Return a model with a variable and an operation of each of these names, and a value for each."""
    domain = Domain(HOSTILE)
    variables = tuple(Variable(name, domain, HOSTILE[0], HOSTILE[:2]) for name in HOSTILE)
    operations = []
    for number, name in enumerate(HOSTILE):
        value = Constant(HOSTILE[(number + 1) % len(HOSTILE)])
        guard = Equal(Reference(name), Constant(HOSTILE[0]))
        pre, post = Transition("pre", guard), Transition("post", Truth(True), a=(Assign(name, value),))
        operations.append(Operation(name, pre, post))
    return BehaviorModel("hostile<&>", variables, tuple(operations))
