"""The delete relaxation: its fixed point, and the work that it takes."""

from __future__ import annotations

from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf
from scbm.planning.engines.delete_relaxation import Effect, RelaxedRule, relaxed_values

OFF, ON = 0b01, 0b10


def _switch_on(variable: int, guard: NormalForm) -> RelaxedRule:
    return RelaxedRule(guard, (Effect(variable, variable, lambda _: ON),))


def _is(variable: int, value: int) -> OneOf:
    return OneOf(variable, value, 2)


def test_a_rule_adds_values_once_its_guard_can_hold() -> None:
    rules = [
        _switch_on(2, AllOf((_is(0, ON), _is(1, ON)))),
        _switch_on(3, AnyOf((_is(0, ON), _is(4, ON)))),
        _switch_on(4, AllOf((_is(2, ON), _is(5, ON)))),
        _switch_on(1, True),
        _switch_on(0, _is(1, ON)),
    ]
    assert relaxed_values(rules, (OFF,) * 6) == (OFF | ON,) * 4 + (OFF,) * 2


def test_a_rule_waits_until_each_of_its_effects_has_an_image() -> None:
    copied = Effect(1, 0, lambda values: values & ON)
    assert relaxed_values([RelaxedRule(True, (copied,))], (OFF, OFF)) == (OFF, OFF)
    assert relaxed_values([RelaxedRule(True, (copied,)), _switch_on(0, True)], (OFF, OFF)) == (OFF | ON, OFF | ON)


def test_the_work_grows_with_a_chain_of_rules_and_not_with_its_square() -> None:
    images = 0

    def image(values: int) -> int:
        nonlocal images
        images += 1
        return values & ON

    length = 300
    chain = [RelaxedRule(True, (Effect(at + 1, at, image),)) for at in range(length)]
    assert relaxed_values(chain[::-1], (OFF | ON, *(OFF,) * length)) == (OFF | ON,) * (length + 1)
    assert images <= 5 * length
