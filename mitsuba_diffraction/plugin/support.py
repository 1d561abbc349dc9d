"""Features of the model that go together, declared by each choice that a scene makes.

A choice is a material, a layer, a model, a coherence or a plugin. What a scene asks for is checked
against the declarations of all its choices, and settings that are automatic follow them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..errors import DiffractionError


@dataclass(frozen=True)
class Support:
    """Features that one choice can be combined with.

    Attributes
    ----------
    choice : name of the choice, for messages.
    index : boundary models that need a refractive index, all but Kirchhoff's.
    second_order : the second order of small slope.
    coat, film, layers : layers over the structure.
    nested : a BSDF beneath the structure.
    thesis : the layering of the thesis of 2014.
    placed : windows that sit where the light falls, `coherence="surface"`.
    """

    choice: str
    index: bool = True
    second_order: bool = True
    coat: bool = True
    film: bool = True
    layers: bool = True
    nested: bool = True
    thesis: bool = True
    placed: bool = True


MIRROR = Support(
    "material='none', a mirror without a refractive index",
    index=False, second_order=False, coat=False, film=False, layers=False, nested=False,
)  # fmt: skip
CONDUCTOR = Support("a conductor, which lets no light through", second_order=False, nested=False)
DISPERSIVE = Support("a material whose index varies with the wavelength", second_order=False)
RARER = Support("an int_ior below the index of the medium above", second_order=False)
COAT = Support("coat_ior", film=False, layers=False, thesis=False)
FILM = Support("a thin film (film_ior)", second_order=False, coat=False, layers=False, thesis=False)
STACK = Support("layers, a stack", index=False, second_order=False, coat=False, film=False)
OPAQUE = Support("layers that absorb the light for what lies beneath", nested=False)
ABSORBING = Support("film_k, which absorbs the light for a nested BSDF", nested=False)
THESIS = Support("layering='thesis'", second_order=False)
PATCH = Support("coherence='patch'", second_order=False)
PLACED = Support("coherence='surface'", second_order=False)
COLOURS = Support("an RGB variant, whose light has no wavelengths to tell speckle by", placed=False)
TRANSMISSION = Support(
    "the plugin diffraction_dielectric, through which light goes",
    nested=False, placed=False,
)  # fmt: skip


def without_second_order(model: str) -> Support:
    """Return the declaration of a boundary model other than small slope."""
    return Support(f"model='{model}'", second_order=False)


def check_combination(asked: Mapping[str, str], choices: Sequence[Support]) -> None:
    """Refuse a feature that one of a scene's choices does not support.

    Raises a DiffractionError with the feature and the choice.

    Parameters
    ----------
    asked : choices of the scene in the words of messages, by the name of the feature.
    choices : declarations of all choices of the scene.
    """
    for feature, phrase in asked.items():
        for support in choices:
            if not getattr(support, feature):
                raise DiffractionError(refusal(phrase, support))


def refusal(phrase: str, support: Support) -> str:
    """Return the message on a feature that a choice does not support."""
    return f"{phrase} cannot be combined with {support.choice}; leave one of them out"


def supported(feature: str, choices: Sequence[Support]) -> bool:
    """Whether all choices support a feature."""
    return all(getattr(support, feature) for support in choices)
