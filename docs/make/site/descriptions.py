"""Descriptions of parameters and attributes for the API reference (an extension of griffe).

Docstrings of the package say `name : description` where the signature has the type. Griffe reads
that text as the type.
"""

from __future__ import annotations

from typing import Any

import griffe

_KINDS = griffe.DocstringSectionKind.parameters, griffe.DocstringSectionKind.attributes


class Descriptions(griffe.Extension):
    """Moves texts from the place of the type to the description, and adds the type."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Correct the sections of an object's docstring."""
        if obj.docstring is None:
            return
        obj.docstring.parser = griffe.Parser.numpy
        obj.docstring.parser_options = {"warnings": False}
        for section in obj.docstring.parsed:
            if section.kind in _KINDS:
                for item in section.value:
                    _correct(item, obj)


def _correct(item: Any, obj: griffe.Object) -> None:
    """Correct one entry; those with a type and an indented description stay as they are."""
    text = str(item.annotation or "")
    if item.description and " " not in text:
        return
    item.description = " ".join(f"{text} {item.description or ''}".split())
    item.annotation = _signature(obj, item.name)


def _signature(obj: griffe.Object, name: str) -> Any:
    """Return the type of a parameter or attribute in the code, or None."""
    if isinstance(obj, griffe.Class):
        member = obj.members.get(name)
        if isinstance(member, griffe.Attribute):
            return member.annotation
        return member.returns if isinstance(member, griffe.Function) else None
    parameters = getattr(obj, "parameters", None)
    return parameters[name].annotation if parameters is not None and name in parameters else None
