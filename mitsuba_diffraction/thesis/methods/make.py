"""Methods by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...progress import Progress
from ...tables.build.checks import TAPS_SHARE
from ...tables.table import DiffractionTable
from ...tables.window import taps_for
from .method import FullSpectrum, Method, trapezoid_rule
from .nmm import OrdersOnly
from .period import check_period, estimate_periods, required_period
from .pq import Repeated
from .rainbow import Rainbow

NAMES = ("default", "flss", "nmm", "pq", "pq-sinc", "rainbow")

#: Makes a table of a patch, like `DiffractionTable.build`.
Build = Callable[..., DiffractionTable]

#: Bins that "pq-sinc" reads along each axis.
SINC_TAPS = 8


def make(name: str, heights: HeightField, **settings: object) -> Method:
    """The method of that name; settings as in `make_all`."""
    return make_all((name,), heights, **settings)[name]  # type: ignore[arg-type]


def make_all(
    names: Sequence[str],
    heights: HeightField,
    *,
    coherence_width: float = 65.0,
    coherence: str | None = None,
    tolerance: float = 1e-3,
    terms: int | None = None,
    taps: int | None = None,
    wavelength_range: tuple[float, float] = (380.0, 780.0),
    step: float = 5.0,
    period: float | None = None,
    repeats: tuple[int, int] | None = None,
    nmm_weights: str = "step",
    specular: float | None = None,
    progress: Progress | None = None,
    build: Build | None = None,
) -> dict[str, Method]:
    """Methods by name, for one patch.

    Parameters
    ----------
    names : of `NAMES`.
    heights : the patch, which tiles the plane.
    coherence_width : 4σ of the Gaussian amplitude window, µm; for `pq`, the width that is filled
        with copies of the patch.
    coherence : "patch", one window on the patch's centre, or "ensemble", the mean power of all its
        positions. By default "ensemble" for `default`, and "patch", as in the thesis, for `flss`
        and `nmm`. `pq` always adds amplitudes; `rainbow` has neither.
    tolerance : of the tables.
    terms, taps : of the Taylor series and the window of `flss`, `nmm` and `pq`; by default as many
        as the tolerance takes. The thesis has 30 and 3: fewer than the tolerance takes
        are accepted if it is raised.
    wavelength_range, step : nm, of the colours.
    period : µm, for `nmm` (along the axis where the patch is most periodic) and `rainbow`; by
        default estimated from the heights.
    repeats : (N₁, N₂) of `pq`; by default as many as fill the coherence width, at least 2.
    nmm_weights, specular : see `OrdersOnly`.
    progress : called as progress(done, total, text) while tables are built.
    build : makes a table of heights and the arguments of `DiffractionTable.build`, that function by
        default; another may keep them.

    Raises
    ------
    DiffractionError
        If a name is unknown, a parameter does not fit, a table cannot be built, or the patch has no
        period and the method needs one.
    """
    for name in names:
        if name not in NAMES:
            raise DiffractionError(f"method='{name}' is unknown; choose one of {', '.join(NAMES)}")
    trapezoid_rule(wavelength_range, step)
    if period is not None:
        check_period(period)
    tables = _Tables(
        heights, coherence_width, tolerance, terms, taps, wavelength_range, progress,
        build or DiffractionTable.build,
    )  # fmt: skip

    def flss(name: str) -> FullSpectrum:
        table = tables.taylor(coherence or "patch")
        return FullSpectrum(name, table, wavelength_range, step)

    def nmm(name: str) -> OrdersOnly:
        periods = _periods(heights, name, period)
        return OrdersOnly(flss("flss"), periods, weights=nmm_weights, specular=specular, name=name)

    def pq(name: str) -> Repeated:
        fill = [max(2, round(coherence_width / extent)) for extent in heights.extent]
        return Repeated(
            tables.for_copies(), repeats or (fill[0], fill[1]),
            interpolation="sinc" if name == "pq-sinc" else "linear", taps=SINC_TAPS,
            wavelength_range=wavelength_range, step=step, name=name,
        )  # fmt: skip

    makers: dict[str, Callable[[str], Method]] = {
        "default": lambda name: FullSpectrum(
            name, tables.own(coherence or "ensemble"), wavelength_range, step
        ),
        "flss": flss,
        "nmm": nmm,
        "pq": pq,
        "pq-sinc": pq,
        "rainbow": lambda name: Rainbow(
            required_period(heights, name, period), coherence_width=coherence_width,
            wavelength_range=wavelength_range, name=name,
        ),
    }  # fmt: skip
    return {name: makers[name](name) for name in names}


def _periods(
    heights: HeightField, method: str, period: float | None
) -> tuple[float | None, float | None]:
    """Periods along x and y, `None` where there is none."""
    main = required_period(heights, method, period)
    if period is None:
        x, y = (p.length if p.found else None for p in estimate_periods(heights))
        return x, y
    return (main.length, None) if main.axis == "x" else (None, main.length)


@dataclass
class _Tables:
    """Tables of one patch, built when they are first asked for."""

    heights: HeightField
    coherence_width: float
    tolerance: float
    terms: int | None
    taps: int | None
    wavelength_range: tuple[float, float]
    progress: Progress | None
    build: Build
    _built: dict[str, DiffractionTable] = field(default_factory=dict)

    def own(self, coherence: str) -> DiffractionTable:
        """What the package would build by itself."""
        return self._build(f"own {coherence}", coherence=coherence)

    def taylor(self, coherence: str) -> DiffractionTable:
        """The thesis' series."""
        return self._build(
            f"taylor {coherence}", coherence=coherence, basis="taylor", terms=self.terms,
            taps=self.taps,
        )  # fmt: skip

    def for_copies(self) -> DiffractionTable:
        """The thesis' series with taps for `pq`; its own window does not matter."""
        width = max(self.heights.extent)
        steps = [0.5 * 3.141592653589793 * width / extent for extent in self.heights.extent]
        least = taps_for((steps[0], steps[1]), self.tolerance * TAPS_SHARE, True)
        return self._build(
            "copies", coherence="patch", basis="taylor", terms=self.terms,
            coherence_width=width, taps=max(SINC_TAPS, *least),
        )  # fmt: skip

    def _build(self, key: str, **arguments: object) -> DiffractionTable:
        if key not in self._built:
            settings: dict[str, object] = {
                "coherence_width": self.coherence_width,
                "tolerance": self.tolerance,
                "wavelength_range": self.wavelength_range,
                "height_scale_max": 1.0,
                "progress": self.progress,
            }
            self._built[key] = self.build(self.heights, **(settings | arguments))
        return self._built[key]
