"""The reference of parameters: the plugin's docstring, README and code say the same."""

from __future__ import annotations

import inspect
import re

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from docs.make.figures import parameters
from mitsuba_diffraction.errors import DiffractionError
from tests.support.lanes import refusal


def entries(plugin):
    """Entries of a plugin's docstring by the names of their parameters."""
    found = parameters.groups(parameters.docstring(plugin))
    return {name: e for entries in found.values() for e in entries for name in e.names}


BY_NAME = entries("diffraction")


@pytest.fixture
def patch():
    return md.gratings.sinusoidal(period=1.6, depth=0.06, periods=4, pixels_per_period=32)


def test_every_parameter_is_described_once(some_variant):
    from mitsuba_diffraction.plugin.parameters import NAMES

    shared = set(NAMES["diffraction"]) & set(NAMES["diffraction_dielectric"])
    assert set(BY_NAME) == {*NAMES["diffraction"], "(nested)"}
    transmitting = set(entries("diffraction_dielectric"))
    # Parameters of heights and table are described once
    assert set(NAMES["diffraction_dielectric"]) - shared <= transmitting
    assert transmitting <= set(NAMES["diffraction_dielectric"])


def test_the_defaults_are_those_of_the_code(some_variant, patch):
    from mitsuba_diffraction import DiffractionTable

    def default(name):
        return BY_NAME[name].default

    build = inspect.signature(DiffractionTable.build).parameters
    assert default("coherence_width") == build["coherence_width"].default
    assert float(default("tolerance")) == build["tolerance"].default
    for name in ("coherence", "basis"):
        assert default(name) == build[name].default

    bsdf = mi.load_dict(md.bsdf_dict(patch, coherence_width=4, tolerance=0.1))
    described = bsdf.describe()
    assert float(default("height_scale")) == described.height_scale.number
    assert float(default("wavelength")) == bsdf.wavelength
    assert default("energy_conserving") == str(bsdf.energy_conserving).lower()
    assert default("shadowing") == ("vcavity" if described.shadowing else "none")
    assert float(default("orientation")) == described.orientation.number
    assert default("model") == described.model
    interior, exterior = (float(index) for index in default("int_ior").split(","))
    # single precision
    assert bsdf.fresnel.eta[0] == pytest.approx(interior / exterior, rel=1e-6)


@pytest.mark.parametrize("name", ["fill", "level", "periodic", "shadowing", "basis"])
def test_the_choices_are_those_of_the_code(some_variant, tmp_path, name):
    np.save(tmp_path / "scan.npy", np.eye(8))
    scan = {"filename": str(tmp_path / "scan.npy"), "pixel_size": 0.1, "coherence_width": 0.4}
    said = refusal(lambda: mi.load_dict({"type": "diffraction", **scan, name: "other"}))
    allowed = set(re.findall(r"\w+", said.partition("one of ")[2])) - {"got", "other"}
    assert set(re.findall(r"`(\w+)`", BY_NAME[name].text)) == allowed


def test_what_is_marked_differentiable_is(some_variant, patch):
    named = {"eta": 1.4, "k": 6.0, "film_ior": 1.5, "film_thickness": 100.0, "lateral_scale": 1.0}
    bsdf = mi.load_dict(
        md.bsdf_dict(patch, coherence_width=4, tolerance=0.1, energy_conserving=False) | named
    )
    found = {key.split(".")[0] for key, _ in mi.traverse(bsdf) if key != "data"}
    marked = {name for name, entry in BY_NAME.items() if entry.differentiable}
    # of indices that are given as such the parameter is the ratio, under another name
    assert found - {"film_eta"} == marked - {"(nested)"}


@pytest.mark.parametrize("entry", ["depth\n    Text.", "depth : float"])
def test_a_line_that_is_no_entry_is_refused(entry):
    with pytest.raises(DiffractionError, match="expected 'name : type"):
        parameters.groups(f"The surface\n-----------\n{entry}\n\nThe model is that.")
