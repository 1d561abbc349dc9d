"""Options that say what light a patch is looked at in; alike wherever a BRDF is evaluated."""

from __future__ import annotations

import argparse


def add_direction(group: argparse._ArgumentGroup, *, theta: float = 0.0) -> None:
    """Declare --theta, with this default, and --phi; both in degrees."""
    group.add_argument(
        "--theta", metavar="DEG", type=float, default=theta,
        help=f"angle of the light from the normal, 0 to below 90; default: {theta:g}",
    )  # fmt: skip
    group.add_argument(
        "--phi", metavar="DEG", type=float, default=0.0,
        help="azimuth of the light, from the patch's x axis towards y; default: 0",
    )  # fmt: skip


def add_wavelengths(
    group: argparse._ArgumentGroup, low: float, high: float, *, filled: bool = True
) -> None:
    """Declare --wavelength-range, with this default, and --step, 5 by default; both in nm.

    filled : whether the defaults are filled in; otherwise options that are not given are None.
    """
    group.add_argument(
        "--wavelength-range", metavar=("LOW", "HIGH"), nargs=2, type=float,
        default=(low, high) if filled else None, help=f"nm; default: {low:g} {high:g}",
    )  # fmt: skip
    group.add_argument(
        "--step", metavar="NM", type=float, default=5.0 if filled else None,
        help="between wavelengths; default: 5",
    )  # fmt: skip
