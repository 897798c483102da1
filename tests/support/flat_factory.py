"""A flat model with hundreds of operations, as one writes that of a whole factory: no parameters, long lists.

Stations stand in lines. Each has a resource, and takes a part through four steps; a station loads what the station
before it has finished.
"""

from __future__ import annotations

_STEPS = ("load", "clamp", "process", "release")
_STATIONS_OF_A_LINE = 13


def flat_factory(operations: int = 314) -> str:
    """Return the text of a model with this number of operations as YAML; every second one has a deadline."""
    numbers = range(-(-operations // len(_STEPS)))
    rows = [row for number in numbers for row in _operations(number)][:operations]
    variables = [row for number in numbers for row in _variables(_name(number))]
    resources = [f"  {_name(number)}_plc: {{simulation: {{latency: 1 s}}}}" for number in numbers]
    goals = [f"  {_name(n)}: {_name(n)}_place == finished" for n in numbers if n % _STATIONS_OF_A_LINE in {0, 1}]
    sections = {"variables": variables, "resources": resources, "operations": rows, "goals": goals}
    lines = [line for name, section in sections.items() for line in (f"{name}:", *section)]
    return "\n".join(("behavior_model: flat_factory", *lines, ""))


def _name(number: int) -> str:
    line, place = divmod(number, _STATIONS_OF_A_LINE)
    return f"line_{line + 1}_station_{place + 1:02}"


def _variables(station: str) -> tuple[str, ...]:
    places = "none, loaded, clamped, processed, finished"
    return (f"  {station}_place: {{domain: [{places}], initial: none}}",)


def _operations(number: int) -> tuple[str, ...]:
    """Return the operations of a station, as rows of a model file."""
    station, place = _name(number), f"{_name(number)}_place"
    before = "" if number % _STATIONS_OF_A_LINE == 0 else f" && {_name(number - 1)}_place == finished"
    ways = (f"{place} == none{before}", f"{place} == loaded", f"{place} == clamped", f"{place} == processed")
    results = ("loaded", "clamped", "processed", "finished")
    trigger, state = f"{station}_plc_req_trigger", f"{station}_plc_req_state"
    return tuple(
        f"  {station}_{step}: {{{'deadline: 5 s, ' if step in {'load', 'process'} else ''}"
        f"pre: {{g: {way} && {state} == initial, a: [{trigger} <- true]}}, "
        f"post: {{g: true, gr: {state} == succeeded,"
        f" a: [{place} <- {result}, {trigger} <- false, {state} <- initial]}}}}"
        for step, way, result in zip(_STEPS, ways, results, strict=True)
    )
