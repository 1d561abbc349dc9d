"""What methods refuse, and that there is no light from below."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.thesis import methods
from tests.support.directions import polar


def test_light_from_below_is_none(rough, of_rough):
    wi, wo = polar(30.0), polar(120.0)
    for method in of_rough.values():
        assert method.brdf(wi, wo, 550.0) == 0.0
        assert np.all(method.xyz([wi, wo], [wo, wi]) == 0.0)


@pytest.mark.parametrize(
    ("name", "arguments", "text"),
    [
        ("ray", {}, "method='ray' is unknown; choose one of spectral, flss"),
        ("flss", {"step": 0.0}, "step=0 nm does not fit"),
        ("flss", {"step": 900.0}, "step=900 nm does not fit"),
        ("flss", {"wavelength_range": (700.0, 400.0)}, "wavelength_range=700, 400 nm"),
        ("flss", {"coherence": "some"}, "coherence='some' must be one of"),
        ("flss", {"terms": 3}, "terms=3 of basis='taylor' leave"),
        ("nmm", {"period": -1.0}, "period=-1.0 must be"),
        ("nmm", {"nmm_weights": "some"}, "weights='some' is unknown"),
        ("nmm", {"specular": 9.0}, "specular=9 must be"),
        ("pq", {"repeats": (0, 1)}, r"repeats=\(0, 1\) must be"),
    ],
)
def test_what_does_not_fit_is_refused(grating, name, arguments, text):
    with pytest.raises(DiffractionError, match=text):
        methods.make(name, grating, **arguments)


def test_shapes_that_do_not_fit_are_refused(of_rough):
    with pytest.raises(DiffractionError, match=r"must be \(n, 3\) or \(3,\)"):
        of_rough["flss"].brdf(np.zeros((4, 2)), np.zeros((4, 2)), 500.0)
    with pytest.raises(DiffractionError, match=r"must be \(n, 3\) or \(3,\)"):
        of_rough["flss"].xyz(np.zeros((4, 3)), np.zeros((5, 3)))
