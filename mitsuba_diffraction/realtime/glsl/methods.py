"""Methods of the fragment stage: their files, the features that they draw, and their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...errors import DiffractionError, check_choice
from .texels import Packed

if TYPE_CHECKING:
    from ...plugin.description import Consumer, Surface


@dataclass(frozen=True)
class ShaderMethod:
    """Method of the fragment stage.

    Attributes
    ----------
    files : names of its sources in GLSL; the last one defines `diffracted`.
    package : package whose folder has them; the renderer's folder `shaders` if it is empty.
    consumer : function that returns the features that it draws; None for those of the renderer.
    tables : function that packs the table of a surface with heights; None for the renderer's own.
    """

    files: tuple[str, ...]
    package: str = ""
    consumer: Callable[[], Consumer] | None = None
    tables: Callable[[Surface], Packed] | None = None


def _exact() -> Consumer:
    from ...plugin.description import Consumer, Feature
    from .features import GLSL

    return Consumer("method exact", GLSL.shows - {Feature.PATCH}, "use method fast")


#: All methods by name; see `register_method`.
METHODS = {
    "fast": ShaderMethod(("fast.glsl",)),
    "exact": ShaderMethod(("responses.glsl", "exact.glsl"), consumer=_exact),
}
#: Methods that pages and exported shaders support.
WEB_METHODS = tuple(METHODS)


def register_method(name: str, method: ShaderMethod) -> None:
    """Add a method to the renderer.

    Raises a DiffractionError if the name is taken by another method.
    """
    if METHODS.setdefault(name, method) != method:
        raise DiffractionError(f"method '{name}' is registered already; choose another name")


def method_of(name: str) -> ShaderMethod:
    """Return a method; raises a DiffractionError if it is unknown."""
    check_choice("method", name, tuple(METHODS))
    return METHODS[name]


def check_methods(methods: Sequence[str], known: Iterable[str]) -> None:
    """Check that methods are some of the known ones, each once.

    Raises a DiffractionError that lists the known ones.
    """
    known = list(known)
    if not methods or len(set(methods)) < len(methods) or not set(methods) <= set(known):
        raise DiffractionError(
            f"methods={list(methods)!r}: choose from {', '.join(known)}, each at most once"
        )


def refusal(name: str, described: Surface) -> str | None:
    """Return why a method cannot draw a surface that the renderer can, or None."""
    consumer = method_of(name).consumer
    return None if consumer is None else consumer().refusal(described)
