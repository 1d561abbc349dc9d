"""Settings of a table, declared once: names, defaults, allowed values and help.

The builder, the plugin, recipes, the commands and the header of a table's file all read them here.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable
from dataclasses import Field, dataclass, field, fields
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


def _setting(default: Any, check: Callable[[Any], Any], help: str, must: str, **more: Any) -> Any:
    """Declare a field; `check` returns the value in its type, or raises ValueError."""
    return field(default=default, metadata={"check": check, "help": help, "must": must, **more})


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (str, numbers.Real)):
        raise ValueError
    return float(value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, (str, numbers.Integral)):
        raise ValueError
    return int(value)


def _among(*choices: str) -> Callable[[Any], str]:
    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in choices:
            raise ValueError
        return value

    return check


def _between(low: float, high: float) -> Callable[[Any], float]:
    """Return a check for a number above `low` and up to `high`."""

    def check(value: Any) -> float:
        number = _number(value)
        if not low < number <= high:
            raise ValueError
        return number

    return check


def _count(most: int) -> Callable[[Any], int | None]:
    def check(value: Any) -> int | None:
        if value is None:
            return None
        number = _whole(value)
        if not 1 <= number <= most:
            raise ValueError
        return number

    return check


def _pair(value: Any) -> tuple[float, float]:
    low, high = (_number(end) for end in value)
    return low, high


def _wavelengths(value: Any) -> tuple[float, float]:
    low, high = _pair(value)
    if not 10.0 <= low < high <= 1e5:
        raise ValueError
    return low, high


def _half_axes(value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    x, y = (value, value) if isinstance(value, (str, numbers.Real)) else value
    positive = _between(0.0, math.inf)
    return positive(x), positive(y)


def _width(value: Any) -> str | float:
    return "auto" if value == "auto" else _between(0.0, MAX_COHERENCE_WIDTH)(value)


def _window_width(value: Any) -> float | None:
    return None if value is None else _between(0.0, MAX_COHERENCE_WIDTH)(value)


def _taper_width(value: Any) -> float | None:
    return None if value is None else _between(0.0, math.inf)(value)


def _windows(value: Any) -> str | float:
    return "auto" if value in (None, "auto") else _between(0.0, math.inf)(value)


def _choices(*names: str) -> dict[str, Any]:
    return {"check": _among(*names), "must": f"one of {', '.join(names)}", "choices": names}


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
        averaged (`tables.build.windows`); "auto" as `heights.coherence.usual_window` has it.
    window_width : 4σ of the window of all orders but 0, µm, where a scan limits it
        (`heights.coherence`); None for `coherence_width`. Tables have it; users do not give it.
    taper_width : 4σ_t of a scan's windows, µm; None for a patch that tiles the plane. Its orders
        have lobes exp(−σ_t²Δ²), nearly; the look-up's window is as much wider than `window_width`,
        so that light has the lobe of that window. Tables have it; users do not give it.
    """

    coherence_width: str | float = _setting(
        "auto", _width, "coherence width, µm, 4σ of its window; auto is 65",
        f"a positive number of µm, at most {MAX_COHERENCE_WIDTH:g}, or auto",
        metavar="auto|W", type=str,
    )  # fmt: skip
    coherence: str = _setting(
        "ensemble", help="average over window positions, or one window on the patch",
        **_choices(*COHERENCES),
    )  # fmt: skip
    basis: str = _setting("auto", help="series in κ; auto is svd", **_choices(*BASES, "auto"))
    tolerance: float = _setting(
        1e-3, lambda value: _between(math.nextafter(1e-6, 0), math.nextafter(1.0, 0.0))(value),
        "relative error that is met", "between 1e-6 (single precision) and 1 (1e-3 is usual)",
        metavar="E",
    )  # fmt: skip
    terms: int | None = _setting(
        None, _count(MAX_TERMS), "terms of the series", f"a whole number from 1 to {MAX_TERMS}",
        metavar="N",
    )  # fmt: skip
    taps: int | None = _setting(
        None, _count(MAX_TAPS), "orders read in each direction",
        f"a whole number from 1 to {MAX_TAPS}", metavar="N",
    )  # fmt: skip
    wavelength_range: tuple[float, float] = _setting(
        (360.0, 830.0), _wavelengths, "nm",
        "two rising wavelengths in nm, between 10 and 100000", metavar=("FIRST", "LAST"),
    )  # fmt: skip
    height_scale_max: float = _setting(
        1.5, _between(0.0, MAX_HEIGHT_SCALE), "largest height_scale that the table serves",
        f"a positive factor, at most {MAX_HEIGHT_SCALE:g}", metavar="S",
    )  # fmt: skip
    frequency_limit: tuple[float, float] | None = _setting(
        None, _half_axes, "largest spatial frequency", "a positive number, or two, in rad/µm"
    )
    windows: str | float = _setting(
        "auto", _windows, "width of the windows of a scan, µm; auto: the smaller side up to 32 µm, "
        "or half the side", "auto, or a positive number of µm",
        metavar="auto|W", type=str,
    )  # fmt: skip
    window_width: float | None = _setting(
        None, _window_width, "µm, 4σ of the window of all orders but 0",
        "a positive number of µm, at most coherence_width", metavar="W", type=float,
    )  # fmt: skip
    taper_width: float | None = _setting(
        None, _taper_width, "µm, 4σ of the lobes that orders of a scan have",
        "a positive number of µm, above window_width", metavar="W", type=float,
    )  # fmt: skip

    def __post_init__(self) -> None:
        for name in _BY_NAME:
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
        values = ((name, getattr(self, name)) for name in _BY_NAME)
        return {name: value for name, value in values if value is not None}


_BY_NAME: dict[str, Field[Any]] = {item.name: item for item in fields(TableSettings)}

#: Settings that scenes and recipes may give.
SCENE_SETTINGS = ("coherence_width", "coherence", "basis", "tolerance", "terms", "windows")
RECIPE_SETTINGS = (*SCENE_SETTINGS, "wavelength_range", "height_scale_max", "frequency_limit")


def checked(name: str, value: Any) -> Any:
    """Return a setting's value in the setting's type.

    Raises a DiffractionError if it is not allowed.
    """
    described = _BY_NAME[name].metadata
    try:
        return described["check"](value)
    except (TypeError, ValueError, OverflowError):
        shown = f"{value:g}" if isinstance(value, float) else quoted(value)
        raise DiffractionError(f"{name}={shown} must be {described['must']}") from None


@dataclass(frozen=True)
class Setting:
    """Description of a field of `TableSettings` for help texts.

    Attributes
    ----------
    help, default_text : meaning of the setting, and its default in words.
    choices : allowed words, or None.
    metavar : name of its value, or of each of several values.
    type : type of its value: int, float or str.
    """

    help: str
    default_text: str
    choices: tuple[str, ...] | None
    metavar: str | tuple[str, ...] | None
    type: type


def described_setting(name: str) -> Setting:
    """Describe the field of this name."""
    default, described = _BY_NAME[name].default, _BY_NAME[name].metadata
    values = default if isinstance(default, tuple) else (default,)
    text = ":".join(value if isinstance(value, str) else f"{value:g}" for value in values if value)
    return Setting(
        help=described["help"],
        default_text=text or described.get("text", "as many as the tolerance requires"),
        choices=described.get("choices"),
        metavar=described.get("metavar"),
        type=described.get("type", int if default is None else float),
    )
