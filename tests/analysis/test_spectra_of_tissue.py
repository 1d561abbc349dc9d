"""Spectra of a sinusoid in tissue, water and over pigment, order by order, against the reference.

A detector around an order collects all of its lobe: f(ωi, ω_m) π/(σk)² of the reference, since
∫ f cosθo dωo = ∫ f du dv over the lobe exp(−σ²k²|Δ(u, v)|²), and f bends by 1e-3 over it.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.media import follow, in_medium, loaded_in_media
from mitsuba_diffraction.analysis.scans import bsdf_of, table_of
from mitsuba_diffraction.analysis.spectra import spectrum, table_range
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.optics.materials import TISSUES
from mitsuba_diffraction.settings import TableSettings
from mitsuba_diffraction.tables.energy import conservation

pytestmark = pytest.mark.usefixtures("spectral")

PERIOD, LIGHT, ACCEPTANCE = 1.6, 20.0, 4.0
LAM = np.array([310.0, 400.0, 420.0, 550.0, 700.0])
ORDERS = (-2, -1, 0, 1)
GREY = 0.3


def sinusoid():
    return md.gratings.sinusoidal(period=PERIOD, depth=0.06, periods=2, rows=4)


def index(name, lam):
    return TISSUES[name].index(lam) if name in TISSUES else complex(name.replace("i", "j"))


def direction(theta):
    """Unit vector at an angle in degrees, + away from the lamp."""
    theta = math.radians(theta)
    return np.array([-math.sin(theta), 0.0, math.cos(theta)])


def order_angle(theta, order, lam, above):
    """Angle in degrees at which an order leaves, of light from `theta`; NaN if it does not."""
    sine = math.sin(math.radians(theta)) + order * 1e-3 * lam / (PERIOD * above)
    return math.degrees(math.asin(sine)) if abs(sine) < 0.95 else math.nan


def collected(theta, angle, lam, material, coat, above):
    """∫ f cosθo dωo over an order's lobe by the reference; `above`: index of the medium."""
    n = index(material, lam) / above
    f = md.reference.brdf(sinusoid(), direction(-theta), direction(angle), lam / above,
                          eta=n.real, k=n.imag, coat=coat)  # fmt: skip
    return float(f[0]) * math.pi / (sigma_of(65.0) * 2e3 * math.pi * above / lam) ** 2


def measuring(parameters):
    """A function of wavelength and angles: reflectance factors, as the command measures them."""
    settings = TableSettings(wavelength_range=table_range(LAM))
    source = in_medium(md.TableSource.of(sinusoid()), parameters.get("ext_ior"), LAM[0])
    bsdf = bsdf_of(md.bsdf_dict(table_of(source, settings), **loaded_in_media(parameters)))
    before = follow(bsdf, parameters, LAM[0])
    return lambda lam, angles: spectrum(
        bsdf, LIGHT, angles, acceptance=ACCEPTANCE, wavelengths=[lam], before=before
    ).value[0]


@pytest.mark.parametrize(
    "parameters",
    [
        {"material": "keratin", "ext_ior": "water"},
        {"material": "keratin", "coat_ior": "water"},
        {"material": "1.5", "ext_ior": "water"},
        {"material": "1.5", "coat_ior": "water"},
        {"material": "1.5", "coat_ior": "water", "ext_ior": "water"},
        {"material": "1.56+0.05i"},
        {"material": "1.56+0.05i", "ext_ior": "water"},
        {"material": "melanin", "coat_ior": "water"},
    ],
    ids=lambda parameters: " ".join(parameters.values()),
)
def test_orders_through_water_and_of_absorbing_tissue_are_the_reference_s(parameters):
    measured = measuring(parameters)
    for lam in LAM:
        water = float(index("water", lam).real)
        above = water if "ext_ior" in parameters else 1.0
        coat = water / above if "coat_ior" in parameters else None
        angles = [order_angle(LIGHT, m, lam, above) for m in ORDERS]
        angles = [a for a in angles if not math.isnan(a)]
        standard = np.cos(np.radians(angles)) * math.sin(math.radians(ACCEPTANCE / 2)) ** 2
        light = [collected(LIGHT, a, lam, parameters["material"], coat, above) for a in angles]
        # the table's tolerance of 0.1 % and the lobe's bend
        assert measured(lam, angles) == pytest.approx(np.array(light) / standard, rel=0.01)


def test_scales_of_energy_are_found_once_for_all_wavelengths_in_water(monkeypatch):
    parameters, found = {"material": "Al", "ext_ior": "water"}, []
    conserve = conservation.SurfaceEnergy.conservation
    monkeypatch.setattr(
        conservation.SurfaceEnergy,
        "conservation",
        lambda self, *light: found.append(light) or conserve(self, *light),
    )
    measured = measuring(parameters)
    loaded = len(found)
    for lam in np.linspace(LAM[0], LAM[-1], 8):
        measured(lam, [LIGHT])
    # at two height scales for the shortest wavelength, and for the 2 % below its index
    assert len(found) - loaded <= 4


@pytest.mark.parametrize("lam", LAM)
def test_pigment_has_the_light_that_the_reference_does_not_reflect(lam):
    """T(ωi) T(ωo) ρ beside the orders' light, T = 1 − a and a the sum over all orders."""

    def passed(theta):
        angles = (order_angle(theta, m, lam, 1.0) for m in range(-9, 10))
        return 1.0 - sum(
            collected(theta, a, lam, "keratin", None, 1.0) for a in angles if not math.isnan(a)
        )

    first = order_angle(LIGHT, -1, lam, 1.0)
    angles = [first, 0.5 * (first + LIGHT), -50.0]  # on an order, and between orders
    standard = math.cos(math.radians(first)) * math.sin(math.radians(ACCEPTANCE / 2)) ** 2
    order = np.array([collected(LIGHT, first, lam, "keratin", None, 1.0) / standard, 0.0, 0.0])
    beneath = GREY * passed(LIGHT) * np.array([passed(a) for a in angles])
    found = measuring({"material": "keratin", "pigment": str(GREY)})(lam, angles)
    assert found == pytest.approx(order + beneath, rel=0.01)
