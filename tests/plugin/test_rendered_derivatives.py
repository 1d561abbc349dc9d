"""Derivatives of a rendering where a look-up is a loop; the other surfaces are thorough."""

from __future__ import annotations

from tests.support.rendered import check, plate


def test_a_loop_over_taps_has_all_derivatives(mono):
    at = {"orientation": 20.0, "lateral_scale": 1.5, "height_scale": 0.9}
    check(plate("metal", 6.0), at, spp=16)
