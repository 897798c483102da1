"""Helpers for SVG inside the HTML page: elements with escaped attributes, and colours of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, tostring

if TYPE_CHECKING:
    from collections.abc import Mapping

_COLOURS = {
    "fg": "#1f2328",
    "muted": "#59636e",
    "line": "#d1d9e0",
    "accent": "#0969da",
    "surface": "#f6f8fa",
    "visited": "#1a7f37",
    "missed": "#cf222e",
}


def colour(name: str) -> str:
    """Return a colour of the page by the name of its CSS property, with a fallback for a white background."""
    return f"var(--{name}, {_COLOURS[name]})"


def picture(title: str, description: str, identifier: str, **attributes: str | float) -> Element:
    """Return an `<svg>` element with a title and a description for screen readers.

    Args:
        title: the title of the picture.
        description: its content in words.
        identifier: an identifier that is unique in the page.
        attributes: attributes of the `svg` element; `role` is `img` only if the picture has no links.
    """
    names = f"{identifier}-title {identifier}-text"
    root = Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "aria-labelledby": names})
    _set(root, attributes)
    add(root, "title", title, id=f"{identifier}-title")
    add(root, "desc", description, id=f"{identifier}-text")
    return root


def add(parent: Element, tag: str, text: str = "", **attributes: str | float) -> Element:
    """Append a child and return it; `stroke_width=2` becomes `stroke-width="2"`, `class_` becomes `class`."""
    child = SubElement(parent, tag)
    child.text = text or None
    _set(child, attributes)
    return child


def _set(element: Element, attributes: Mapping[str, str | float]) -> None:
    for name, value in attributes.items():
        written = f"{value:.6g}" if isinstance(value, float) else str(value)
        element.set(name.rstrip("_").replace("_", "-"), written)


def written(root: Element) -> str:
    """Return the picture as text."""
    return tostring(root, encoding="unicode")
