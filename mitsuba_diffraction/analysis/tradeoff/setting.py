"""What tables are tried: one parameter after the other, the rest as by default."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Setting:
    """One table.

    Attributes
    ----------
    group : the parameter that is varied.
    name : what is said of this value.
    arguments : of `DiffractionTable.build`, besides the patch and the coherence width.
    stored : numbers the coefficients are stored as afterwards: "half", "single", or as built.
    crop : largest spatial frequency as a share of what light can probe, or None.
    """

    group: str
    name: str
    arguments: dict[str, Any] = field(default_factory=dict)
    stored: str | None = None
    crop: float | None = None

    @property
    def usable(self) -> bool:
        """Whether a user can ask for it, tolerance and all."""
        return self.stored is None and self.arguments.get("tolerance", 1e-3) < _ANY


#: A tolerance that everything meets: then the error is what the other parameters leave.
_ANY = 0.999


def settings(quick: bool) -> Iterator[Setting]:
    """All tables that are tried, the defaults first."""
    yield Setting("default", "the defaults")
    tolerances = (1e-2, 1e-4) if quick else (1e-2, 1e-4, 1e-5, 1e-6)
    for tolerance in tolerances:
        yield Setting("tolerance", f"tolerance {tolerance:.0e}", {"tolerance": tolerance})
    for basis in ("chebyshev", "taylor"):
        for tolerance in (1e-3,) if quick else (1e-2, 1e-3, 1e-4):
            arguments = {"basis": basis, "tolerance": tolerance}
            yield Setting("basis", f"{basis}, {tolerance:.0e}", arguments)
    if quick:
        counts: tuple[int, ...] = (4, 8)
    else:
        counts = (4, 6, 8, 12)
    for basis in ("svd", "chebyshev"):
        for terms in counts:
            arguments = {"basis": basis, "terms": terms}
            yield Setting(f"terms, {basis}", f"{terms} terms, {basis}", arguments)
    for taps in (2, 3, 4) if quick else (2, 3, 4, 5):
        arguments = {"terms": 12, "taps": taps, "tolerance": _ANY}
        yield Setting("taps", f"{taps} × {taps} taps", arguments)
    for stored in ("half", "single"):
        yield Setting("precision", f"tolerance 1e-4 in {stored}", {"tolerance": 1e-4}, stored)
    for crop in (0.5,) if quick else (0.75, 0.5, 0.35):
        yield Setting("crop", f"up to {crop:g} of all frequencies", crop=crop)
    for tolerance in (1e-3,) if quick else (1e-2, 1e-3):
        arguments = {"coherence": "patch", "tolerance": tolerance}
        yield Setting("coherence", f"patch, {tolerance:.0e}", arguments)
