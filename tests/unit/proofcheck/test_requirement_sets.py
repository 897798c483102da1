"""Requirements in sets: what no state violates is proved and checked, those in the midst of an end included."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing.requirements.requirement_certificates import requirement_certificates
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.closing.symbolic.reached_sets import SetSearch
from scbm.closing.symbolic.requirement_sets import RequirementSets
from scbm.closing.symbolic.run_moves import RunMoves
from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.proofcheck import Certificate, CertificateFlaw, RequirementSetsArgument, check_certificate
from support.wording import Wording

PAIR = """
behavior_model: pair
variables:
  at: {domain: [home, work], initial: home}
  count: {domain: 0..1, initial: 0}
resources:
  a: {}
  b: {}
operations:
  go:
    pre:
      g: at == home && a_req_trigger == false && b_req_trigger == false
      a: [a_req_trigger <- true, b_req_trigger <- true]
    post:
      g: true
      gr: a_req_state == succeeded && b_req_state == succeeded
      a: [at <- work, a_req_trigger <- false, b_req_trigger <- false, a_req_state <- initial, b_req_state <- initial]
      ar: [count <- 1]
  back: {pre: {g: at == work}, post: {g: true, a: [at <- home]}}
goals:
  worked: at == work
  home: at == home
requirements:
  r: %s
"""
"""Both requests are in flight together. The end of a run cancels them one after the other, `a` first."""

ALONE = "a_req_trigger == false && b_req_trigger == true"
HOLDS = {
    "always": "always at == work -> a_req_trigger == false",
    "never": "never at == work && a_req_state == executing",
    "counted": "never count == 1 && current.state == timedout",
    "before": "go.state == executing before at == work",
    "before, never": "at == work before a_req_trigger == true && at == work",
    "after": "after go.state == executing always at == home until go.state == completed",
    "after, never": "after at == work always a_req_trigger == false until at == home",
    "after, in an end": f"after {ALONE} && go.state == executing always at == home until go.state == completed",
}
"""Requirements that hold in all runs. Where a state would violate one at another time, there are two sets."""

MIDWAY = {
    "never": f"never {ALONE}",
    "before": f"at == work before {ALONE}",
    "after": "after go.state == executing always a_req_trigger == b_req_trigger until go.state == completed",
    "begins and ends": f"after {ALONE} always b_req_trigger == true until current.name == none",
    "begins": f"after {ALONE} always plan.state == executing until at == work",
}
"""Requirements that runs violate only while they end, or since something was so only then."""

VIOLATED = {
    "always": "always at == home",
    "never": "never current.name == back",
    "before": "at == work before go.state == executing",
    "before, late": "current.name == back before at == work",
    "after": "after at == work always at == work until go.state == executing",
    "after, in no end": "after go.state == completed always go.state == completed until go.state == executing",
    "after, at once": "after at == work always count == 0 until at == home",
    "after, later": "after go.state == executing always at == home until back.state == executing",
}
"""Requirements that runs violate in a situation."""


def model_of(sentence: str) -> BehaviorModel:
    return read_model(PAIR % sentence)


def sets_of(sentence: str) -> tuple[BehaviorModel, RequirementSets]:
    model = model_of(sentence)
    return model, RequirementSets.of(model, model.requirements, lambda _: None)


def proves(sentence: str) -> bool:
    model, sets = sets_of(sentence)
    return sets.proves(model.requirements[0])


def certificate_of(sentence: str) -> Certificate:
    """The certificate of what a set proves, or what a wrong finder says that it proves."""
    model, sets = sets_of(sentence)
    assert sets.proves(model.requirements[0])
    ((_, certificate),) = requirement_certificates(model, {RequirementKey("r"): sets}, None)
    return certificate


def flaws(sentence: str, certificate: Certificate) -> list[CertificateFlaw]:
    return list(check_certificate(certificate, model_of(sentence)))


def watched_in(certificate: Certificate, number: int) -> Certificate:
    assert isinstance(certificate.argument, RequirementSetsArgument)
    return replace(certificate, argument=replace(certificate.argument, watched=(number,)))


@pytest.mark.parametrize("sentence", HOLDS.values(), ids=HOLDS)
def test_what_holds_is_proved_and_accepted(sentence: str) -> None:
    certificate = certificate_of(sentence)
    assert flaws(sentence, certificate) == []
    if not sentence.startswith(("always", "never")):
        assert isinstance(certificate.argument, RequirementSetsArgument)
        everywhere = watched_in(certificate, certificate.argument.reached)
        assert (flaws(sentence, everywhere) == []) == (everywhere == certificate)


@pytest.mark.parametrize("name", ["before", "after", "after, in an end"])
def test_where_something_is_remembered_fewer_situations_are_watched(name: str) -> None:
    argument = certificate_of(HOLDS[name]).argument
    assert isinstance(argument, RequirementSetsArgument)
    assert argument.watched != (argument.reached,)


@pytest.mark.parametrize("sentence", [*VIOLATED.values(), *MIDWAY.values()])
def test_what_runs_violate_is_not_proved(sentence: str) -> None:
    assert not proves(sentence)


def overlooked(sentence: str, monkeypatch: pytest.MonkeyPatch) -> tuple[Certificate, RequirementSetsArgument]:
    """The certificate of a finder that finds no violation, and watches all situations."""
    monkeypatch.setattr(RequirementSets, "_is_any", lambda *_: False)
    certificate = certificate_of(sentence)
    assert isinstance(certificate.argument, RequirementSetsArgument)
    return certificate, certificate.argument


@pytest.mark.parametrize("sentence", VIOLATED.values(), ids=VIOLATED)
def test_a_finder_that_overlooks_violations_is_noticed(sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    certificate, argument = overlooked(sentence, monkeypatch)
    for number in (0, 1, argument.reached):
        assert flaws(sentence, watched_in(certificate, number)), number


@pytest.mark.longer
@pytest.mark.parametrize("sentence", VIOLATED.values(), ids=VIOLATED)
def test_no_set_makes_a_false_claim_true(sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    certificate, argument = overlooked(sentence, monkeypatch)
    for number in range(0, len(argument.nodes) + 2, 4):
        assert flaws(sentence, watched_in(certificate, number)), number


@pytest.mark.parametrize("sentence", MIDWAY.values(), ids=MIDWAY)
def test_a_finder_that_forgets_states_in_the_midst_of_ends_is_noticed(
    sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RunMoves, "cancelled", lambda _, situations: situations)
    assert flaws(sentence, certificate_of(sentence))


@pytest.mark.parametrize("name", ["begins", "begins and ends"])
def test_what_begins_in_the_midst_of_an_end_is_watched(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """One finder watches nothing, another one all that follows the end, whatever it is."""
    model, sets = sets_of(MIDWAY[name])
    alone = sets.found.moves.where(model.requirements[0].sentence.predicates[0])
    nothing = sets.found.space.manager.false
    first = sets._first(alone, nothing)
    assert first is not None
    for watched in (nothing, sets._search.following(sets.found, first, nothing)):
        monkeypatch.setattr(RequirementSets, "_watched", lambda *_, found=watched: found)
        sets._known.clear()
        assert sets.proves(model.requirements[0])
        ((_, certificate),) = requirement_certificates(model, {RequirementKey("r"): sets}, None)
        assert flaws(MIDWAY[name], certificate)


@pytest.mark.parametrize("name", ["before", "after"])
def test_a_finder_that_follows_no_steps_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SetSearch, "following", lambda _, __, first, beyond: first & ~beyond)
    assert flaws(VIOLATED[f"{name}, {'late' if name == 'before' else 'later'}"], certificate_of(VIOLATED[name]))


def test_a_finder_that_forgets_steps_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RunMoves, "_replies", lambda _: iter(()))
    assert flaws("never at == work", certificate_of("never at == work"))


def test_shapes_and_claims_that_are_none_are_refused(wording: Wording) -> None:
    certificate = certificate_of(HOLDS["before"])
    argument = certificate.argument
    assert isinstance(argument, RequirementSetsArgument)
    wrong = [
        replace(certificate, argument=replace(argument, watched=())),
        watched_in(certificate, len(argument.nodes) + 2),
        replace(certificate, claims=("built_in/stops",)),
        replace(certificate, claims=("requirement/s",)),
    ]
    wording("\n".join(str(flaw) for each in wrong for flaw in flaws(HOLDS["before"], each)))
    wording("\n".join(map(str, flaws("at == work leads to at == home", certificate))))
    wording("\n".join(map(str, flaws(HOLDS["counted"], certificate))))
