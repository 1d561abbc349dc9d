"""mitsuba_diffraction: iridescence of measured surfaces as a BSDF for Mitsuba 3.

Contents
--------
HeightField        a patch of surface, heights in µm
gratings           ideal gratings, look-alikes of snake scales, optical discs
DiffractionTable   precomputed diffraction orders of a patch
TableSource        table of a file, recipe or height field, built once for all that ask
OrderTable         solved efficiencies of a grating's orders
maps               pictures of the BRDF over all directions
period_fit         periods of a patch from its response to a beam, by the grating equation
solve_orders       orders of a grating by a rigorous solver
read_orders        orders from a file of efficiencies
profiles           one period of a grating's grooves
tradeoff           accuracy against speed and memory, setting by setting
glsl               the realtime renderer
design             patches from their BRDF, reliefs for given colours
shader_comparison  comparison of the shaders with the path tracer
cluster            rendering on many processes and machines
osl                shaders for Blender's Cycles
web                pages that show a scene in a browser or a notebook
spectrum           reflectance spectra as a spectrometer measures them
reference          the BRDF straight from its integral, in double precision
hologram           textures of a dot-matrix hologram from a picture
bsdf_dict          a dictionary for `mi.load_dict` from arrays
preset             a dictionary for `mi.load_dict` of a preset, e.g. preset("cd")
DiffractionError   error of every bad input, in one line

Importing the package and Mitsuba, in either order, registers the BSDF plugin `diffraction` in the
current variant of Mitsuba and in every variant that is set later.
"""

from __future__ import annotations

import os
import sys

if sys.argv[:1] == ["-m"] and __name__ in sys.orig_argv:  # `python -m`: __main__ comes last
    # Python would import what follows from the current folder, which may be somebody else's
    if not sys.flags.safe_path and sys.path[0] != os.path.dirname(os.path.dirname(__file__)):
        del sys.path[0]
    from _mitsuba_diffraction import prepare

    prepare()

import importlib
import pkgutil
from typing import TYPE_CHECKING, Any

from .errors import DiffractionError, DiffractionWarning
from .llvm import select_llvm
from .when_imported import when_imported

if TYPE_CHECKING:
    from . import cluster, osl, reference
    from .analysis import design, maps, tradeoff
    from .analysis.spectra import spectrum
    from .heights import HeightField, gratings
    from .orders import OrderTable
    from .orders.imported import read_orders
    from .orders.solve import profiles
    from .orders.solve.orders import solve_orders
    from .plugin.dictionary import bsdf_dict
    from .plugin.presets import preset
    from .realtime import glsl, shader_comparison, web
    from .scene.hologram import hologram
    from .tables import DiffractionTable, TableSource
    from .thesis import period_fit

    __version__: str

__all__ = [
    "DiffractionError",
    "DiffractionTable",
    "DiffractionWarning",
    "HeightField",
    "OrderTable",
    "TableSource",
    "bsdf_dict",
    "cluster",
    "design",
    "glsl",
    "gratings",
    "hologram",
    "maps",
    "osl",
    "period_fit",
    "preset",
    "profiles",
    "read_orders",
    "reference",
    "shader_comparison",
    "solve_orders",
    "spectrum",
    "tradeoff",
    "web",
]

# Imported when first asked for: heights, tables and the reference need no Mitsuba, and renders
# need no Matplotlib, which some load.
_PLACES = {
    "DiffractionTable": "tables:DiffractionTable",
    "HeightField": "heights:HeightField",
    "OrderTable": "orders:OrderTable",
    "TableSource": "tables:TableSource",
    "bsdf_dict": "plugin.dictionary:bsdf_dict",
    "cluster": "cluster",
    "design": "analysis.design",
    "glsl": "realtime.glsl",
    "gratings": "heights.gratings",
    "hologram": "scene.hologram:hologram",
    "maps": "analysis.maps",
    "osl": "osl",
    "period_fit": "thesis.period_fit",
    "preset": "plugin.presets:preset",
    "profiles": "orders.solve.profiles",
    "read_orders": "orders.imported:read_orders",
    "reference": "reference",
    "shader_comparison": "realtime.shader_comparison",
    "solve_orders": "orders.solve.orders:solve_orders",
    "spectrum": "analysis.spectra:spectrum",
    "tradeoff": "analysis.tradeoff",
    "web": "realtime.web",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name in ("glsl", "shader_comparison"):
        importlib.import_module(f"{__name__}.thesis.shaders")  # registers its methods
    return pkgutil.resolve_name(f"{__name__}.{_PLACES[name]}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _register() -> None:
    from .plugin.registration import register_in_all

    register_in_all(f"{__name__}.orders.bsdf.diffraction_orders")


select_llvm()  # before Dr.Jit picks a library by itself: some would end the process
when_imported("mitsuba", _register)
