"""What a session knows of the scene that was loaded in it."""

from __future__ import annotations

from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.scene.planning.session import Session

# of coarse pixels, which the plugin warns of
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning")

PATCH = md.HeightField(0.005 * np.random.default_rng(1).random((24, 24)), 0.25)


def test_a_bsdf_without_id_is_called_by_its_heights():
    bsdf = SimpleNamespace(table=SimpleNamespace(source={"name": "grating.npy"}))
    session = Session()
    session.register(bsdf, "_unnamed_3")
    session.register(bsdf, "foil")
    names = [name for name, _ in session.bsdfs]
    assert names == ["a diffraction BSDF without id (of grating.npy)", "foil"]


def test_only_what_is_loaded_in_a_session_belongs_to_it(some_variant):
    with Session(recording=True) as session:
        inside = mi.load_dict(md.bsdf_dict(PATCH, coherence_width=6.0))
        with pytest.raises(md.DiffractionError, match="one at a time"), Session():
            pass
    outside = mi.load_dict(md.bsdf_dict(PATCH, coherence_width=6.0))
    assert [bsdf for _, bsdf in session.bsdfs] == [inside]
    assert type(outside) is not type(inside)
    assert list(session.tables.values()) == [outside.table]
