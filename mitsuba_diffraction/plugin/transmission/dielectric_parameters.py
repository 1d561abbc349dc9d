"""Parameters of the plugin `diffraction_dielectric`, read from Mitsuba's Properties and checked."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr

from ...errors import DiffractionError
from ...optics import through
from ...settings import SURFACE
from ..boundary import Boundary, boundary_of
from ..fresnel import Dielectric
from ..layer_parameters import AIR, KERATIN
from ..properties import choice, class_of, flag
from ..sources import TableProvider
from ..support import TRANSMISSION, check_combination
from ..surface_parameters import (
    TRANSMITTING,
    SurfaceParameters,
    coherence_of,
    nested_of,
    read_index,
    read_surface,
)
from ..types import Properties

#: Smallest index relative to the medium above. Orders of light that goes through depend on n − 1.
LEAST_INDEX = 1.01


@dataclass(frozen=True)
class Parameters:
    """Parameters of `diffraction_dielectric`, checked.

    Attributes
    ----------
    surface : table, height scale, orientation.
    material : the dielectric, over the medium above it.
    boundary : model of the light above the surface.
    thin : whether the side below is beyond the flat side of a sheet.
    """

    surface: SurfaceParameters
    material: Dielectric
    boundary: Boundary
    thin: bool


def read_parameters(props: Properties, provider: TableProvider) -> Parameters:
    """Read and check everything, and get the table: loaded, or from `provider`.

    Raises a DiffractionError with the parameter, its value and the choices.
    """
    nested = nested_of(props, TRANSMITTING)
    asked = {} if nested is None else {"nested": f"the nested BSDF {class_of(nested)}"}
    if coherence_of(props) == SURFACE:
        asked["placed"] = f"coherence='{SURFACE}'"
    check_combination(asked, [TRANSMISSION])
    material = Dielectric(
        read_index(props, "int_ior", KERATIN), read_index(props, "ext_ior", AIR), least=LEAST_INDEX
    )
    if refused := material.refusal():
        raise DiffractionError(
            f"{refused}: int_ior must be at least {LEAST_INDEX:g} times ext_ior; turn the surface "
            "round if the denser medium is above"
        )
    thin, model = flag(props, "thin", False), choice(props, "model", tuple(through.MODELS))
    # Light below the surface has the wavelength λ/n
    surface = read_surface(props, provider, float(dr.slice(material.eta)), second_order=False)
    return Parameters(
        surface, material, boundary_of(model, material, surface.table.roughness), thin
    )
