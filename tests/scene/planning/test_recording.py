"""What a session knows of the scene that was loaded in it."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.scene.planning.recording import Session

PATCH = md.HeightField(0.005 * np.random.default_rng(1).random((64, 64)), 0.0875)


def test_a_bsdf_without_id_is_called_by_its_heights(some_variant):
    session = Session()
    with session:
        for name in ({}, {"id": "foil"}):
            mi.load_dict({**md.bsdf_dict(PATCH, coherence_width=5.0), **name})
    names = [name for name, _ in session.bsdfs]
    assert names == [f"a diffraction BSDF without id (of {PATCH.name})", "foil"]


def test_only_what_is_loaded_in_a_session_belongs_to_it(some_variant):
    with Session(recording=True) as session:
        inside = mi.load_dict(md.bsdf_dict(PATCH, coherence_width=5.0))
        with pytest.raises(md.DiffractionError, match="one at a time"), Session():
            pass
    outside = mi.load_dict(md.bsdf_dict(PATCH, coherence_width=5.0))
    assert [bsdf for _, bsdf in session.bsdfs] == [inside]
    assert type(outside) is not type(inside)
    assert list(session.tables.values()) == [outside.table]
