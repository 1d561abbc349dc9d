"""Measured gratings: efficiencies, printed properties, and fitted grooves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from docs.make.figures.pages import write_text
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.orders.solve.profiles import Profile

from . import predict
from .grooves import Groove

_DATA = Path(__file__).parent / "data"
#: File of the fitted grooves.
FITTED = _DATA / "fitted.csv"
#: Unknowns of a fit, in the order of `Groove`: the facet alone, or with apex and roughness.
FITS = (1, 3)
# first steps of the unknowns: degrees, degrees, nm
_STEPS = np.array([0.5, 10.0, 10.0])
# wavelengths that are fitted: each third
_EVERY = 3
# degrees and nm between which the fit has converged; the efficiencies then change by 1e-3
_FINE = 0.05
#: Index of replicated glass and resin, assumed.
GLASS = 1.52
# index in the violet, assumed: one of 1.52 in the middle of the spectrum rises as much
_ULTRAVIOLET = 1.54
# degrees of the transmission grating's facet, from the first trial; the source prints none
_THOR = 17.5
# file of the six gratings: lines/mm and the wavelength (nm) of the blaze that is printed
_GMOS = {
    "B1200_G5301": (1200, 463), "R831_G5302": (831, 757), "B600_G5303": (600, 461),
    "R600_G5304": (600, 926), "R400_G5305": (400, 764), "R150_G5306": (150, 717),
}  # fmt: skip
# ratio of the wavelength in the instrument to the wavelength in the laboratory
_MOUNT = 0.906


@cache
def table(name: str) -> NDArray[np.void]:
    """Return the rows of a file of `data`, with the columns of its header line."""
    lines = (_DATA / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    return np.atleast_1d(np.genfromtxt(rows, delimiter=",", names=True, dtype=None))


@dataclass(frozen=True, eq=False)
class Case:
    """Efficiencies of one order of one grating over wavelength.

    Attributes
    ----------
    name, laboratory : of the grating, and who measured it.
    wavelengths, measured, error : (n,); wavelengths in nm, error 0 where none is printed.
    drawing : groove as it is printed, before any fit.
    period : µm.
    solved, modelled : efficiencies of a profile at wavelengths.
    path : of light per height of the surface, for roughness.
    fits : whether the measurement is used to fit; else `like` has the fitted groove.
    """

    name: str
    laboratory: str
    wavelengths: Real
    measured: Real
    error: Real
    drawing: Groove
    period: float
    solved: Callable[[Profile, Real], Real]
    modelled: Callable[[Profile, Real], Real]
    path: float = 2.0
    like: Case | None = None

    def predicted(self, method: str, groove: Groove, step: int = 1) -> Real:
        """Return the efficiencies by `solved` or `modelled`, less what roughness scatters."""
        wavelengths = self.wavelengths[::step]
        smooth = getattr(self, method)(groove.profile(self.period), wavelengths)
        left = [groove.specular(lam, self.path) for lam in wavelengths]
        return np.asarray(smooth * left)

    def thinned(self, step: int) -> Case:
        """Return the case with some of its wavelengths."""
        return replace(
            self,
            wavelengths=self.wavelengths[::step],
            measured=self.measured[::step],
            error=self.error[::step],
        )

    def missed(self, values: Real, step: int = 1) -> float:
        """Return the mean deviation of efficiencies from the measured ones."""
        return float(np.abs(values - self.measured[::step]).mean())

    @cached_property
    def grooves(self) -> dict[int, Groove]:
        """Groove by number of fitted parameters: 0, the drawing, and each of `FITS`."""
        if self.like:
            return self.like.grooves
        stored = {
            int(row["unknowns"]): Groove(*(float(row[name]) for name in Groove._fields[:3]))
            for row in table(FITTED.stem)
            if row["grating"].replace(";", ",") == self.name
        }
        return {0: self.drawing} | stored

    def fit(self) -> dict[int, Groove]:
        """Fit the groove's unknowns by solved orders; a minute."""
        return {count: self._fitted(count) for count in FITS}

    @cached_property
    def curves(self) -> dict[tuple[str, int], Real]:
        """Efficiencies by method and number of fitted unknowns."""
        return {
            (method, count): self.predicted(method, groove)
            for method in ("modelled", "solved")
            for count, groove in self.grooves.items()
        }

    def deviation(self, method: str, count: int) -> float:
        """Return the mean deviation by method and number of fitted unknowns."""
        return self.missed(self.curves[method, count])

    def _fitted(self, count: int) -> Groove:
        start = np.array([self.drawing.facet, self.drawing.apex + 10.0, 5.0][:count])

        def groove(values: Real) -> Groove:
            return self.drawing._replace(
                **dict(zip(("facet", "apex", "roughness"), map(float, values), strict=False))
            )

        simplex = np.vstack([start, start + np.diag(_STEPS[:count])])
        found = minimize(
            lambda values: self.missed(
                self.predicted("solved", groove(np.abs(values)), _EVERY), _EVERY
            ),
            start,
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "xatol": _FINE, "fatol": 2e-4, "maxfev": 50},
        )
        return groove(np.abs(found.x))


def reflection_gratings() -> list[Case]:
    """Six ruled gratings of aluminium, whose light returns along itself."""
    rows = table("gmos")
    cases = []
    for name, (lines, blaze) in _GMOS.items():
        period = 1e3 / lines
        facet = float(np.degrees(np.arcsin(0.5e-6 * blaze / _MOUNT * lines)))
        cases.append(
            Case(
                f"GMOS {name.split('_')[0]}, {lines}/mm", "Richardson", rows["wavelength_nm"] * 1.0,
                rows[name], np.zeros(len(rows)), Groove(facet), period,
                partial(predict.littrow_solved, "Al"), partial(predict.littrow_modelled, "Al"),
            )
        )  # fmt: skip
    return cases


def transmission_gratings() -> list[Case]:
    """Cases of a ruled glass grating: both mounts on a bench, and its maker's data sheet.

    The data sheet gives two cases: the index of the fit, and a higher index.
    """
    rows = table("thor300")
    period = 1e3 / 300.0

    def case(laboratory: str, outwards: bool, like: Case | None = None, n: float = GLASS) -> Case:
        chosen = rows[rows["laboratory"] == laboratory]
        side = ("glass to air" if outwards else "air to glass") + (f", n = {n}" if like else "")
        return Case(
            f"Thorlabs 300/mm, {side}", laboratory, chosen["wavelength_nm"],
            chosen["efficiency"], chosen["error"], Groove(_THOR), period,
            partial(predict.through_solved, n, outwards),
            partial(predict.through_modelled, n, outwards), n - 1.0, like,
        )  # fmt: skip

    bench = case("LPNHE", True)
    sheets = [case("Thorlabs", True, bench, n) for n in (GLASS, _ULTRAVIOLET)]
    return [bench, case("LPNHE", False), *sheets]


def write_fits() -> None:
    """Fit all grooves and store them in `data`; some minutes."""
    header = "# Grooves fitted by `python -m docs.make.measured --fit` (degrees, nm).\n"
    lines = [",".join(("grating", "unknowns", *Groove._fields[:3]))]
    for case in reflection_gratings() + transmission_gratings():
        for count, groove in case.fit().items() if not case.like else ():
            values = ",".join(f"{value:.2f}" for value in groove[:3])
            lines.append(f"{case.name.replace(',', ';')},{count},{values}")
    write_text(FITTED, header + "\n".join(lines) + "\n")
