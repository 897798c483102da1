"""Bindings from a file beside the model: the same model, reached in another way."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files.codec.binding_keys import BINDINGS_SHAPE
from scbm.files.codec.bindings.binding_builder import BindingBuilder
from scbm.files.codec.common_parts import Parts
from scbm.files.codec.shape_check import check_shape
from scbm.files.language.scope import Scope
from scbm.files.language.spelling import suggestion
from scbm.files.yaml.text_files import read_file, read_tree
from scbm.model import Slug

if TYPE_CHECKING:
    from scbm.files.yaml.document import YamlNode
    from scbm.model.behavior import BehaviorModel
    from scbm.model.bindings import Binding

_START = "bindings begin with `bindings_of: <name of the model>`"


def load_bindings(path: str | Path, model: BehaviorModel) -> BehaviorModel:
    """The model with the bindings of a file, which replace those that it has.

    Raises:
        InputError: with everything that is wrong with the file.
    """
    return read_bindings(read_file(Path(path)), model, str(path))


def read_bindings(text: str, model: BehaviorModel, file: str = "bindings") -> BehaviorModel:
    """The model with the bindings that a text says. Raises `InputError` with everything that is wrong with it.

    Args:
        text: YAML.
        model: whose resources are bound.
        file: what errors call the text.
    """
    document, _, report = read_tree(text, file, BINDINGS_SHAPE, _START)
    check_shape(document, report, BINDINGS_SHAPE)
    parts = Parts(report, Scope.of(model))
    _refuse_other_models(document, parts, model)
    bindings = _bindings(document, parts, model)
    report.raise_any()
    resources = (replace(r, binding=bindings.get(r.name, r.binding)) for r in model.resources)
    return replace(model, resources=tuple(resources))


def _refuse_other_models(document: YamlNode, parts: Parts, model: BehaviorModel) -> None:
    """Complains of a file for another model; if it has no resource of this one, that is all that there is to say.

    Raises `InputError` then.
    """
    node, section = document.get("bindings_of"), document.get("resources")
    if node is None or node.text is None or node.plain is None or node.text == model.name:
        return
    message = f"these are bindings of `{node.text}`, and the model is `{model.name}`"
    parts.add(Slug.BAD_BINDING, message, node.place)
    if section is None or all(resource.name not in section.items for resource in model.resources):
        parts.report.raise_any()


def _bindings(document: YamlNode, parts: Parts, model: BehaviorModel) -> dict[str, Binding]:
    section = document.get("resources")
    if section is None:
        return {}
    builder = BindingBuilder(parts, model)
    known = {resource.name: resource for resource in model.resources}
    for resource in model.resources:
        if resource.name not in section.items:
            builder.know(resource)
    bindings: dict[str, Binding] = {}
    for name, node in section.items.items():
        if name in known:
            bindings[name] = builder.binding(known[name], node, section.key_places[name])
        else:
            remedy = suggestion(name, known, "the resources are")
            parts.add(Slug.UNKNOWN_RESOURCE, f"there is no resource `{name}`", section.key_places[name], remedy)
    return bindings
