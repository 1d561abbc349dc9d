"""Parts and figure of docs/validation/measured.md."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from docs.make.validation.pages.markdown import table
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.orders.solve import CoupledWaves, IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import Profile

from . import cases, outside, predict, shapes
from .cases import Case
from .grooves import Groove

# three colours that keep apart in grey and for colour-blind readers
_STYLES = {"modelled": ("#d55e00", "--"), "solved": ("#0072b2", "-")}
_PEAKS = np.arange(520.0, 881.0, 20.0)


class Comparisons:
    """Everything that the page shows, computed on first use.

    Parameters
    ----------
    clone : of `outside.REPOSITORY`; None leaves its part of the page as it is.
    quick : one grating of each kind, for tests.
    """

    def __init__(self, clone: Path | None = None, quick: bool = False) -> None:
        self.clone, self.quick = clone, quick

    @cached_property
    def gratings(self) -> list[Case]:
        """Gratings with curves over wavelength, those that solutions miss most first."""
        chosen = cases.reflection_gratings(), cases.transmission_gratings()
        found = [case for group in chosen for case in group[: 1 if self.quick else None]]
        if self.quick:
            found = [case.thinned(6) for case in found]
        return sorted(found, key=lambda case: -case.deviation("solved", cases.FITS[-1]))

    @cached_property
    def pair(self) -> tuple[Real, Real]:
        """Orders ±1 of the silver sinusoid at `_PEAKS`, over silver: solved and by the model."""
        row = cases.table("fourier_surface")[0]
        period, phase = 1e-3 * row["period_nm"] * row["period_scale"], np.arange(240) / 240
        heights = 1e-3 * row["amplitude_nm"] * (1.0 + np.cos(2.0 * np.pi * phase))
        profile = Profile(phase * period, heights, period, "sinusoid of silver")
        silver = predict.mirror_reflectance("Ag", _PEAKS)
        solved, modelled = predict.normal_pair(profile, "Ag", _PEAKS)
        return solved / silver, modelled / silver

    @cached_property
    def effects(self) -> dict[str, tuple[shapes.Effect | None, shapes.Effect | None]]:
        """Effects of a groove's flaws."""
        return shapes.effects(self.quick)

    @cached_property
    def solvers(self) -> tuple[float, float]:
        """Largest differences of other solvers from the page's: in reflection, and through."""
        lam = np.array([455.0, 655.0, 805.0][-1 if self.quick else 0 :])
        prism = shapes.PRISM.profile(shapes.TRANSMITTING)
        mirror = shapes.MIRROR.profile(shapes.REFLECTING)
        back = [
            predict.littrow_solved("Al", mirror, lam, solver)
            for solver in (None, IntegralSolver(mirror, 240))
        ]
        through = [
            predict.through_solved(cases.GLASS, False, prism, lam, solver)
            for solver in (None, CoupledWaves(prism, 25))
        ]
        return float(np.abs(np.subtract(*back)).max()), float(np.abs(np.subtract(*through)).max())

    @property
    def blazed(self) -> list[Case]:
        """Gratings whose grooves are fitted to their own measurement."""
        return [case for case in self.gratings if not case.like]


def figure(found: Comparisons) -> Figure:
    """Draw the measured efficiencies, the model and the solutions."""
    hidden = "air to glass", "n = 1.54"
    shown = [case for case in found.gratings if not any(part in case.name for part in hidden)]
    rows = -(-(len(shown) + 1) // 3)
    drawing = Figure(figsize=(10.5, 2.9 * rows), layout="constrained")
    axes = drawing.subplots(rows, 3, squeeze=False).ravel()
    for ax, case in zip(axes, shown, strict=False):
        bars = case.error if case.error.any() else None
        ax.errorbar(case.wavelengths, case.measured, bars, fmt="k.", ms=4, label="measured")
        for method, (tint, line) in _STYLES.items():
            label = "model" if method == "modelled" else "solved"
            curve = case.curves[method, cases.FITS[-1]]
            ax.plot(case.wavelengths, curve, line, color=tint, lw=1.5, label=label)
        dotted = case.curves["solved", 0]
        ax.plot(case.wavelengths, dotted, ":", color=_STYLES["solved"][0], label="solved, unfitted")
        ax.set_title(f"{case.name} ({case.laboratory})", fontsize=9)
    last = axes[len(shown)]
    row = cases.table("fourier_surface")[0]
    low, high = row["efficiency"] - row["error"], row["efficiency"] + row["error"]
    last.axhspan(low, high, color="0.85", label="measured peak")
    for values, (tint, line), label in zip(
        found.pair, reversed(list(_STYLES.values())), ("solved", "model"), strict=True
    ):
        last.plot(_PEAKS, values, line, color=tint, lw=1.5, label=label)
    last.set_title("silver sinusoid, orders ±1, p (ETH Zürich)", fontsize=9)
    for ax in axes:
        ax.set_ylim(0.0, 1.05)
        ax.set_xlabel("wavelength, nm", fontsize=8)
        ax.tick_params(labelsize=8)
    for ax in (axes[0], last):
        ax.legend(fontsize=7)
    for ax in axes[len(shown) + 1 :]:
        ax.remove()
    return drawing


def points(value: float) -> str:
    """Return a part of the light in hundredths, with one digit."""
    return f"{100 * value:.1f}"


def summary(found: Comparisons) -> str:
    """Return the one line that the README ends with."""
    done = [case.deviation("solved", cases.FITS[-1]) for case in found.blazed]
    model = [case.deviation("modelled", cases.FITS[-1]) for case in found.blazed]
    return (
        f"Beside measured gratings, with three unknowns of each groove fitted, solved orders are "
        f"within {points(min(done))} to {points(max(done))} points of the light on average, and "
        f"the model within {points(min(model))} to {points(max(model))}"
    )


def parts(found: Comparisons) -> dict[str, str]:
    """Return the parts of the page by name, without a clone all but the other renderer's."""
    solved, modelled = found.pair
    peak = int(solved.argmax())
    ronchi = points(cases.table("ronchi400")["efficiency"].mean())
    mask = points(predict.face(cases.GLASS) ** 2 / np.pi**2)
    bench = [case for case in found.blazed if case.laboratory == "LPNHE"]
    fitted = [case.grooves[cases.FITS[-1]] for case in bench]
    apices = " or ".join(f"{groove.apex:.0f}°" for groove in fitted)
    roughnesses = " or ".join(f"{groove.roughness:.0f} nm" for groove in fitted)
    walls = bench[0].drawing._replace(apex=90.0 - bench[0].drawing.facet)
    steep = next(case for case in found.gratings if "1200" in case.name)
    return {
        "summary": f"{summary(found)}.",
        "agreement-with-measurements": _table(found),
        "steep-model": points(steep.deviation("modelled", cases.FITS[-1])),
        "steep-solved": points(steep.deviation("solved", cases.FITS[-1])),
        "silver": f"{100 * solved[peak]:.0f} % at {_PEAKS[peak]:.0f} nm. The model: "
        f"{100 * modelled.max():.0f} %",
        "what-was-fitted": _grooves(found),
        "factors": _factors(bench, bench[0].drawing),
        "walls": _factors(bench, walls),
        "ronchi": f"{ronchi} %, an ideal one between two faces of glass {mask} %",
        "face": f"{predict.face(cases.GLASS):.3f}",
        "groove": f"{apices} and {roughnesses}",
        "a-real-groove-is-not-its-drawing": _effects(found),
        **_pictures(found),
        "reflected": f"{100 * found.solvers[0]:.2f}",
        "through": f"{100 * found.solvers[1]:.2f}",
    }


def _factors(bench: list[Case], groove: Groove) -> str:
    """Return measured over solved in each mount, of a groove."""
    texts = []
    for case in bench:
        ratio = case.measured / case.predicted("solved", groove)
        texts.append(f"{ratio.mean():.2f} ± {ratio.std():.2f} ({case.name.split(', ')[1]})")
    return ", ".join(texts)


def _table(found: Comparisons) -> str:
    rows = [
        [
            case.name, case.laboratory,
            *(points(case.deviation(m, n)) for n in (0, *cases.FITS) for m in _STYLES),
            points(float(case.error.mean())) if case.error.any() else "not given",
        ]
        for case in found.gratings
    ]  # fmt: skip
    row = cases.table("fourier_surface")[0]
    peaks = [float(abs(values.max() - row["efficiency"])) for values in reversed(found.pair)]
    silver = [*map(points, peaks), *["–"] * 4, points(row["error"])]
    rows.append(["silver sinusoid, highest orders ±1, p", "ETH Zürich", *silver])
    header = ["grating", "measured by"]
    for stage in ("drawing", "1 fitted", "3 fitted"):
        header += [f"{stage}: model", "solved"]
    return table([*header, "instrument"], rows)


def _grooves(found: Comparisons) -> str:
    rows = []
    for case in found.blazed:
        groove = case.grooves[cases.FITS[-1]]
        rows.append(
            [
                case.name, f"{case.drawing.facet:.1f}°", f"{groove.facet:.1f}°",
                f"{groove.apex:.0f}°", f"{groove.roughness:.0f} nm",
            ]
        )  # fmt: skip
    return table(["grating", "facet, printed", "facet, fitted", "apex", "roughness"], rows)


def _effects(found: Comparisons) -> str:
    def cell(effect: shapes.Effect | None) -> str:
        if effect is None:
            return "–"
        return f"{100 * effect.mean:+.1f} ({100 * effect.largest:+.1f})".replace("-", "−")

    rows = [[name, *map(cell, pair)] for name, pair in found.effects.items()]
    return table(["flaw", "aluminium, 600/mm, 9.4°", "glass, 300/mm, 17.5°"], rows)


def _pictures(found: Comparisons) -> dict[str, str]:
    if not found.clone:
        return {}
    rows = [
        [p.name, f"{p.correlation:.4f}", f"{p.factor:.2f}", f"{100 * p.deviation:.1f} %"]
        for p in outside.compare(found.clone)
    ]
    header = ["height map", "correlation", "theirs over ours", "mean deviation"]
    return {"pictures": table(header, rows)}
