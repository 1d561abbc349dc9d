"""Options of a spectrometer: lamp, detectors, standard, wavelengths; and types of arguments."""

from __future__ import annotations

import argparse

from .options import number_between


def angles(text: str) -> list[float]:
    """Parse a number, or FIRST:LAST:STEP, in degrees."""
    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) == 1:
        return numbers
    if len(numbers) == 3 and numbers[2] > 0.0 and 0.0 <= numbers[1] - numbers[0] <= 180.0:
        count = int((numbers[1] - numbers[0]) / numbers[2] + 1e-9) + 1
        if count <= 1000:
            return [round(numbers[0] + n * numbers[2], 6) for n in range(count)]
    raise argparse.ArgumentTypeError(
        f"expected degrees, or FIRST:LAST:STEP such as 0:60:5, got {text!r}"
    )


def azimuth(text: str) -> float | str:
    """Parse an angle, or auto."""
    return text if text == "auto" else float(text)


def group(text: str) -> tuple[str, str]:
    """Parse NAME=PATTERN."""
    name, equals, pattern = text.partition("=")
    if not (equals and name and pattern):
        raise argparse.ArgumentTypeError(f"expected NAME=PATTERN, got {text!r}")
    return name, pattern


#: Options of the measurement.
SPECTROMETER = (
    ("--light DEG", "angle of the lamp from the normal", float, 30.0),
    ("--light-azimuth --azimuth DEG", "azimuth of the lamp from the patch's x axis towards y, or "
     "auto: across the grooves of each scan's strongest grating", azimuth, 0.0),
    ("--detector DEG ...", "angles of the detectors from the normal, positive on the far side from "
     "the lamp, or ranges FIRST:LAST:STEP; default: where a mirror reflects the lamp to", angles),
    ("--acceptance DEG", "full angle of the cone that a detector collects", float, 2.0),
    ("--relative", "per cent of a white standard, of a perfect mirror, or of the incident light",
     ("white", "mirror", "none"), "white"),
    ("--polarisation", "also light polarised across (s) and in (p) the plane of incidence", bool),
    ("--wavelength-range FIRST LAST", "nm; default: 300 830, or from where a table begins",
     number_between(100, 10000)),
    ("--step NM", "between wavelengths", number_between(0.01, 1000), 5.0),
)  # fmt: skip
