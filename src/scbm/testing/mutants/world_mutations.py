"""Mutation operators for what stands around the transitions: initial values, requests, and the environment."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.model import format_value
from scbm.testing.mutants.action_mutations import other_actions
from scbm.testing.mutants.expression_edits import after, replaced, with_negated_conjuncts, without_conjuncts
from scbm.testing.mutants.model_parts import environment_actions, environment_guard
from scbm.testing.mutants.mutation import Mutant, MutatedPart, Mutation, SubjectKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, EnvironmentTransition, Resource, Variable


class OtherInitialValue(Mutation):
    """Begins with the next value of the domain."""

    name = "initial-value"
    group = "initial-values"
    summary = "the nominal initial value of a variable is the next one of its domain"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each variable whose domain has another value."""
        for variable in model.variables:
            for value in after(variable.initial, variable.domain.values):
                random = (value,) if variable.random == (variable.initial,) else variable.random
                changed = replace(variable, initial=value, random=random)
                yield Mutant(
                    name=f"variable/{variable.name}/initial/{format_value(value)}",
                    operator=self.name,
                    kind=SubjectKind.VARIABLE,
                    subject=variable.name,
                    parts=(MutatedPart.INITIAL,),
                    path=("variables", variable.name, "initial"),
                    before=f"initial: {format_value(variable.initial)}",
                    after=f"initial: {format_value(value)}",
                    change=f"{format_value(variable.initial)} → {format_value(value)}",
                    model=_with_variable(model, changed),
                )
                break


def _with_variable(model: BehaviorModel, changed: Variable) -> BehaviorModel:
    return replace(model, variables=tuple(changed if v.name == changed.name else v for v in model.variables))


class RequestMutation(Mutation):
    """Changes which variables a request carries; the mutant has no binding for the resource."""

    group = "resources"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each other request of each resource."""
        for resource in model.resources:
            for edit, request in self.others(resource, model):
                changed = replace(resource, request=request, binding=None)
                yield Mutant(
                    name=f"resource/{resource.name}/request/{edit}",
                    operator=self.name,
                    kind=SubjectKind.RESOURCE,
                    subject=resource.name,
                    parts=(MutatedPart.REQUEST,),
                    path=("resources", resource.name, "request"),
                    before=f"request: [{', '.join(resource.request)}]",
                    after=f"request: [{', '.join(request)}]",
                    change=edit.replace(":", " ", 1).replace("->", " → "),
                    model=replace(model, resources=tuple(changed if r is resource else r for r in model.resources)),
                )

    @abstractmethod
    def others(self, resource: Resource, model: BehaviorModel) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Yield the other requests of a resource, each after what changes."""


class DropRequestValue(RequestMutation):
    """Leaves out one variable of the requests to a resource."""

    name = "request-drop"
    summary = "the requests to a resource do not carry one of their variables"

    def others(self, resource: Resource, model: BehaviorModel) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Yield the request without each of its variables."""
        del model
        for index, name in enumerate(resource.request):
            yield f"drop:{name}", replaced(resource.request, index)


class OtherRequestValue(RequestMutation):
    """Carries another variable in the requests to a resource."""

    name = "request-other"
    summary = "the requests to a resource carry the next declared variable instead of one of theirs"

    def others(self, resource: Resource, model: BehaviorModel) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Yield the request with another variable instead of each of its variables."""
        declared = [variable.name for variable in model.variables]
        for index, name in enumerate(resource.request):
            following = after(name, declared) if name in declared else iter(declared)
            for other in (each for each in following if each not in resource.request):
                yield f"{name}->{other}", replaced(resource.request, index, other)
                break


class DropEnvironment(Mutation):
    """Leaves out an environment transition."""

    name = "environment-drop"
    group = "environment"
    summary = "an environment transition is left out"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each environment transition."""
        for index, transition in enumerate(model.environment):
            yield Mutant(
                name=f"environment/{transition.name}/drop",
                operator=self.name,
                kind=SubjectKind.ENVIRONMENT,
                subject=transition.name,
                parts=(MutatedPart.ENVIRONMENT,),
                path=("environment", transition.name),
                before=str(transition),
                after="",
                change="drop",
                model=replace(model, environment=replaced(model.environment, index)),
            )


class EnvironmentGuard(Mutation):
    """Leaves out or negates a conjunct of the guard of an environment transition."""

    name = "environment-guard"
    group = "environment"
    summary = "a conjunct of the guard of an environment transition is left out or negated"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield two mutants for each conjunct."""
        for transition in model.environment:
            yield from self._of(model, transition)

    def _of(self, model: BehaviorModel, transition: EnvironmentTransition) -> Iterator[Mutant]:
        guard = environment_guard(model, transition)
        changes = zip(without_conjuncts(guard.value), with_negated_conjuncts(guard.value), strict=True)
        for (conjunct, kept), each in changes:
            yield self.of_part(guard, f"drop:{conjunct}", kept)
            yield self.of_part(guard, f"negate:{conjunct}", each.whole, f"{conjunct} → {each.new}")


class EnvironmentActions(Mutation):
    """Leaves out an action of an environment transition, or assigns another value."""

    name = "environment-action"
    group = "environment"
    summary = "an action of an environment transition is left out, or assigns the next value of the domain"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield the mutants of each action; none leaves a transition without actions."""
        for transition in model.environment:
            part = environment_actions(model, transition)
            for index, action in enumerate(part.value):
                if len(part.value) > 1:
                    yield self.of_part(part, f"drop:{action}", replaced(part.value, index))
                for other in other_actions(action, model.running_space):
                    yield self.of_part(
                        part, f"value:{other}", replaced(part.value, index, other), f"{action} → {other}"
                    )
