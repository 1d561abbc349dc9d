"""Parameters, declared once: default, check, allowed values and help; the settings of a table.

The builder, the plugin, recipes, the commands and the header of a table's file all read them here.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

from .errors import DiffractionError, quoted

COHERENCES = ("ensemble", "patch")
#: Third coherence, for scenes and the reference: one window, centred where the light falls. It uses
#: the table of "patch"; another position changes only the phases of the amplitudes.
SURFACE = "surface"
BASES = ("svd", "chebyshev", "taylor")
#: Largest number of bins that a look-up reads in each direction: more would take minutes.
MAX_TAPS = 64
#: Largest number of terms of a series.
MAX_TERMS = 400
#: Largest factor on heights.
MAX_HEIGHT_SCALE = 1e3
#: Width over which sunlight is coherent, µm: 4σ for a source 0.53° wide.
USUAL_WIDTH = 65.0
#: Widest coherence window, µm. Sunlight has 65 µm; lobes of much wider windows are narrower than
#: the cells from which directions are drawn.
MAX_COHERENCE_WIDTH = 500.0


@dataclass(frozen=True)
class Parameter:
    """Parameter of a record, declared in its field.

    Attributes
    ----------
    default : value where none is given.
    check : function that returns a value in its type; raises ValueError, or a DiffractionError.
    help : meaning of the parameter.
    must : allowed values, for the error.
    metavar : name of its value, or of each of several values; None without an option.
    choices : allowed words, or None.
    type : type of its value on a command line: int, float or str.
    """

    default: Any
    check: Callable[[Any], Any]
    help: str
    must: str = ""
    metavar: str | tuple[str, ...] | None = None
    choices: tuple[str, ...] | None = None
    type: type = float

    def checked(self, name: str, value: Any) -> Any:
        """Return a value in its type; `name` is the parameter's in the error.

        Raises a DiffractionError if the value is not allowed.
        """
        try:
            return self.check(value)
        except DiffractionError:
            raise
        except (TypeError, ValueError, OverflowError):
            shown = f"{value:g}" if isinstance(value, float) else quoted(value)
            raise DiffractionError(f"{name}={shown} must be {self.must}") from None

    @property
    def default_text(self) -> str:
        """Default in words."""
        if self.default is None:
            return "as many as the tolerance requires"
        values = self.default if isinstance(self.default, tuple) else (self.default,)
        return ":".join(v if isinstance(v, str) else f"{v:g}" for v in values)


def parameter(default: Any, check: Callable[[Any], Any], help: str, *rest: Any, **more: Any) -> Any:
    """Return the field of a record's class for a parameter; values as of `Parameter`."""
    described = Parameter(default, check, help, *rest, **more)
    return field(default=default, metadata={"parameter": described})


def parameters_of(record: type) -> dict[str, Parameter]:
    """Return the parameters of a record's class by name."""
    return {item.name: item.metadata["parameter"] for item in fields(record)}


def among(*choices: str) -> Callable[[Any], str]:
    """Return a check for one of these words."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in choices:
            raise ValueError
        return value

    return check


def _between(low: float, high: float, kind: type = float) -> Callable[[Any], Any]:
    """Return a check for a number, or a whole number by kind=int, above `low` and up to `high`."""
    accepted = str, numbers.Integral if kind is int else numbers.Real

    def check(value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, accepted):
            raise ValueError
        number = kind(value)
        if not low < number <= high:
            raise ValueError
        return number

    return check


def _or(word: str | None, check: Callable[[Any], Any], *also: None) -> Callable[[Any], Any]:
    """Return a check that also allows a word, or None, and what is the same as the word."""
    return lambda value: word if value in (word, *also) else check(value)


def _wavelengths(value: Any) -> tuple[float, float]:
    low, high = map(_between(math.nextafter(10.0, 0.0), 1e5), value)
    if not low < high:
        raise ValueError
    return low, high


def _half_axes(value: Any) -> tuple[float, float]:
    x, y = (value, value) if isinstance(value, (str, numbers.Real)) else value
    positive = _between(0.0, math.inf)
    return positive(x), positive(y)


def _choices(*names: str) -> dict[str, Any]:
    return {"check": among(*names), "must": f"one of {', '.join(names)}", "choices": names}


@dataclass(frozen=True)
class TableSettings:
    """Settings with which a table is built; lengths in µm, wavelengths in nm.

    The constructor checks values and converts their types; it accepts numbers as text.

    Raises a DiffractionError with the setting, its value and the allowed values.

    Attributes
    ----------
    coherence_width : µm over which the light is coherent, 4σ₀ of order 0's amplitude window; "auto"
        is 65 µm, as in sunlight.
    coherence : "ensemble" (window power averaged over its position) or "patch" (one window).
    basis : "svd" (also as "auto"), "chebyshev" or "taylor"; see `tables.expansion`.
    tolerance : relative error of ⟨|P|²⟩ at the worst κ, as `tables.build.error` measures it.
    terms : coefficients of a series; None for as many as the tolerance requires.
    taps : bins read in each direction; None for as many as the tolerance requires.
    wavelength_range : nm; the shortest sets the largest frequency that light can probe.
    height_scale_max : largest factor on the heights that the table serves.
    frequency_limit : half axes along x and y, in rad/µm, of the ellipse of spatial frequencies
        k·(u, v) that are tabulated: the table is dark beyond. None for all that light can probe.
    windows : width in µm of the tapered windows that a scan is seen through, whose powers are
        averaged (`tables.build.screens`); "auto" as `heights.coherence.usual_window` has it.
    window_width : 4σ of the window of all orders but 0, µm, where a scan limits it
        (`heights.coherence`); None for `coherence_width`. Tables have it; users do not give it.
    taper_width : 4σ_t of a scan's windows, µm; None for a patch that tiles the plane. Its orders
        have lobes exp(−σ_t²Δ²), nearly; the look-up's window is as much wider than `window_width`,
        so that light has the lobe of that window. Tables have it; users do not give it.
    """

    coherence_width: str | float = parameter(
        "auto", _or("auto", _between(0.0, MAX_COHERENCE_WIDTH)),
        "coherence width, µm, 4σ of its window; auto is 65",
        f"a positive number of µm, at most {MAX_COHERENCE_WIDTH:g}, or auto",
        metavar="auto|W", type=str,
    )  # fmt: skip
    coherence: str = parameter(
        "ensemble", help="average over window positions, or one window on the patch",
        **_choices(*COHERENCES),
    )  # fmt: skip
    basis: str = parameter("auto", help="series in κ; auto is svd", **_choices(*BASES, "auto"))
    tolerance: float = parameter(
        1e-3, _between(math.nextafter(1e-6, 0), math.nextafter(1.0, 0.0)),
        "relative error that is met", "between 1e-6 (single precision) and 1 (1e-3 is usual)", "E",
    )  # fmt: skip
    terms: int | None = parameter(
        None, _or(None, _between(0, MAX_TERMS, int)), "terms of the series",
        f"a whole number from 1 to {MAX_TERMS}", "N", type=int,
    )  # fmt: skip
    taps: int | None = parameter(
        None, _or(None, _between(0, MAX_TAPS, int)), "orders read in each direction",
        f"a whole number from 1 to {MAX_TAPS}", "N", type=int,
    )  # fmt: skip
    wavelength_range: tuple[float, float] = parameter(
        (360.0, 830.0), _wavelengths, "nm",
        "two rising wavelengths in nm, between 10 and 100000", ("FIRST", "LAST"),
    )  # fmt: skip
    height_scale_max: float = parameter(
        1.5, _between(0.0, MAX_HEIGHT_SCALE), "largest height_scale that the table serves",
        f"a positive factor, at most {MAX_HEIGHT_SCALE:g}", "S",
    )  # fmt: skip
    frequency_limit: tuple[float, float] | None = parameter(
        None, _or(None, _half_axes), "largest spatial frequency",
        "a positive number, or two, in rad/µm",
    )  # fmt: skip
    windows: str | float = parameter(
        "auto", _or("auto", _between(0.0, math.inf), None), "width of the windows of a scan, µm; "
        "auto: the smaller side up to 32 µm, or half the side", "auto, or a positive number of µm",
        "auto|W", type=str,
    )  # fmt: skip
    window_width: float | None = parameter(
        None, _or(None, _between(0.0, MAX_COHERENCE_WIDTH)),
        "µm, 4σ of the window of all orders but 0",
        "a positive number of µm, at most coherence_width", "W",
    )  # fmt: skip
    taper_width: float | None = parameter(
        None, _or(None, _between(0.0, math.inf)), "µm, 4σ of the lobes that orders of a scan have",
        "a positive number of µm, above window_width", "W",
    )  # fmt: skip

    def __post_init__(self) -> None:
        for name in SETTINGS:
            object.__setattr__(self, name, checked(name, getattr(self, name)))
        if self.window_width is not None and not self.window_width < self.light_width:
            object.__setattr__(self, "window_width", None)

    @property
    def light_width(self) -> float:
        """Width over which the light is coherent, µm: `coherence_width`, or 65 for "auto"."""
        return USUAL_WIDTH if isinstance(self.coherence_width, str) else self.coherence_width

    @property
    def width(self) -> float:
        """Width of the window of all orders but 0, µm, as `heights.coherence.resolved` left it."""
        return self.light_width if self.window_width is None else self.window_width

    @property
    def lookup_width(self) -> float:
        """4σ of the window by which orders are looked up, µm: `width` with the taper taken out."""
        if self.taper_width is None:
            return self.width
        return (self.width**-2 - self.taper_width**-2) ** -0.5

    @property
    def coherent(self) -> bool:
        """Whether amplitudes are added, not powers."""
        return self.coherence == "patch"

    def as_json(self) -> dict[str, Any]:
        """Return the settings by name, except None."""
        values = ((name, getattr(self, name)) for name in SETTINGS)
        return {name: value for name, value in values if value is not None}


#: Parameters of `TableSettings` by name.
SETTINGS = parameters_of(TableSettings)

#: Settings that scenes and recipes may give.
SCENE_SETTINGS = ("coherence_width", "coherence", "basis", "tolerance", "terms", "windows")
RECIPE_SETTINGS = (*SCENE_SETTINGS, "wavelength_range", "height_scale_max", "frequency_limit")


def checked(name: str, value: Any) -> Any:
    """Return a setting's value in the setting's type.

    Raises a DiffractionError if it is not allowed.
    """
    return SETTINGS[name].checked(name, value)
