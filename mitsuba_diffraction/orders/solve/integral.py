"""Efficiencies of all channels of a grating by the boundary integral method of `gratinglab`.

Channels are the directions that differ by whole orders at one wavelength (`stations`). They have
one quasi-periodic Green's function, hence one system matrix: it is factorised once for all incident
channels and both polarisations. gratinglab's public call solves one incident direction and one
polarisation, 10 to 30 times the work, so its operators are assembled here. They lie in modules of
gratinglab that its documentation does not list; a test compares this assembly with the public call.

System (Goray and Schmidt 2010, JOSA A 27, 585; notation of `gratinglab.solvers.integral._finite`):
E and B are the field components along the grooves, w and τ the densities of their single layers in
the material,

    (½ + K⁺)V⁻ w − c_E V⁺(L⁻ − ½) w − s V⁺ ∂V⁻ τ = E of the incident wave
    (½ + K⁺)V⁻ τ − c_B V⁺(L⁻ − ½) τ + s V⁺ ∂V⁻ w = B of the incident wave

with c_E = n²k⁺²/k⁻², c_B = k⁺²/k⁻², s = cosγ (1 − k⁺²/k⁻²), k⁺ = k sinγ, k⁻ = k√(n² − cos²γ), and
cosγ the direction cosine of the light along the grooves.

Light that comes from within the material, with E and B of its plane wave on the boundary, has
instead the right-hand sides, from the same boundary relation,

    −(½ + K⁺) E + c_E V⁺ ∂ₙE + s V⁺ ∂ₜB,    −(½ + K⁺) B + c_B V⁺ ∂ₙB − s V⁺ ∂ₜE
"""

from __future__ import annotations

import importlib.metadata
import warnings
from typing import Any

import numpy as np
from scipy.linalg import solve as solve_linear

from ...arrays import Complex, Real
from ...errors import DiffractionError
from .profiles import Profile
from .stations import LEAST_NORMAL, Station

#: Order of the mesh graded towards corners, which gratinglab recommends (Kress 1990).
GRADING = 4


class IntegralSolver:
    """Boundary integral method for one profile; the mesh is kept for all stations.

    Raises a DiffractionError if gratinglab is not installed.

    Parameters
    ----------
    profile : one period of the grooves.
    points : nodes on the boundary.
    """

    def __init__(self, profile: Profile, points: int) -> None:
        try:
            from gratinglab import profiles
            from gratinglab.problem import Problem
            from gratinglab.solvers.integral import _nystrom
            from gratinglab.solvers.integral._boundary import physical_boundary
            from gratinglab.solvers.integral._nystrom import OperatorAssembler
        except ImportError as error:
            raise DiffractionError(
                "gratinglab is not installed; install the extra: pip install '.[solve]'"
            ) from error
        self.points, self.period, self._nystrom = points, profile.period, _nystrom
        x, z = profile.x / profile.period, profile.z / profile.period
        if len(x) == 2:  # gratinglab wants three vertices
            x, z = np.insert(x, 1, x.mean()), np.insert(z, 1, z.mean())
        polygon = profiles.FromProfileData(t=tuple(x), y=tuple(z))
        grading = GRADING if profile.corners else 0
        problem = Problem(period=profile.period, profile=polygon)
        self._boundary = physical_boundary(problem, points, grading=grading)
        self._terms = points // 2
        self._assembler = OperatorAssembler(self._boundary, period=self.period, terms=self._terms)

    @property
    def name(self) -> str:
        """Name, version and settings."""
        version = importlib.metadata.version("gratinglab")
        return f"gratinglab {version}, integral method, {self.points} points"

    def amplitudes(self, station: Station) -> Complex:
        """Return the amplitudes between all channels; see `stations.Solver`."""
        self._assembler.clear()
        waves = _Waves(self._boundary, station, self.period)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            # branches of the kernels that are not selected may overflow
            warnings.simplefilter("ignore", RuntimeWarning)
            if station.indices is None:
                return self._perfect(waves)[None]
            # single layer V and ½ + K (corners subtracted) of the medium above
            double = self._matrix("double_layer", waves.k, waves.reference, subtract_corners=True)
            single = self._matrix("single_layer", waves.k, waves.reference)
            above = single, double + 0.5 * np.eye(self.points)
            pairs = zip(station.wavelengths, station.indices, station.along, strict=True)
            return np.stack([self._finite(waves, above, *pair) for pair in pairs])

    def _finite(
        self,
        waves: _Waves,
        above: tuple[Complex, Complex],
        wavelength: float,
        index: complex,
        along: float,
    ) -> Complex:
        v_above, k_above = above
        root = np.sqrt(complex(index) ** 2 - along**2)
        k_below = 2 * np.pi / wavelength * (root if root.imag >= 0 else -root)
        ratio = (waves.k / k_below) ** 2
        c_e, c_b, s = index**2 * ratio, ratio, along * (1 - ratio)
        trace = self._matrix("single_layer", k_below, waves.reference)
        normal = self._matrix("adjoint_layer", k_below, waves.reference)
        normal[np.diag_indices(self.points)] -= 0.5
        if self._boundary.graded:
            derivative = self._nystrom.tangential_derivative_matrix
            tangential = derivative(self._boundary, alpha0=waves.reference) @ trace
        else:
            tangential = self._matrix("tangential_layer", k_below, waves.reference)
        first, second = k_above @ trace, v_above @ normal
        cross = s * (v_above @ tangential)
        system = np.block([[first - c_e * second, -cross], [cross, first - c_b * second]])
        inner = _InnerWaves(self._boundary, waves, k_below, self.period)
        n, ports = self.points, len(waves.alpha) + len(inner.alpha)
        # columns: E, then B, of all ports; rows: the equations of E, then of B
        came = np.hstack([waves.incident.T, np.zeros((n, len(inner.alpha)))])
        within, across, aside = (
            np.hstack([np.zeros((n, len(waves.alpha))), part])
            for part in (inner.trace, inner.normal, inner.tangential)
        )
        left, back, turned = k_above @ within, v_above @ across, s * (v_above @ aside)
        right = np.block([[came - left + c_e * back, turned], [-turned, came - left + c_b * back]])
        densities = solve_linear(system, right, overwrite_a=True, overwrite_b=True)
        w, tau = densities[:n], densities[n:]
        none = np.zeros_like(within)
        (e, b), (e_across, b_across), (e_aside, b_aside) = (
            (layer @ w + np.hstack([part, none]), layer @ tau + np.hstack([none, part]))
            for layer, part in ((trace, within), (normal, across), (tangential, aside))
        )
        up = (
            waves.reflected(c_e * e_across + s * b_aside, e),
            waves.reflected(c_b * b_across - s * e_aside, b),
        )
        # (2, out, 2, in) to (in, 2, out, 2)
        fields = np.concatenate([up, (inner.transmitted(w), inner.transmitted(tau))], axis=1)
        fields = fields.reshape(2, ports, 2, ports).transpose(3, 2, 1, 0)
        roots = np.sqrt(np.concatenate([np.tile(waves.gamma, (2, 1)).T, inner.power(c_e, c_b)]))
        lit = roots > 0
        return np.asarray(fields * roots / np.where(lit, roots, np.inf)[:, :, None, None])

    def _perfect(self, waves: _Waves) -> Complex:
        """A perfect conductor: E vanishes on it, and so does the normal derivative of B."""
        incident = waves.incident.T
        single = self._matrix("single_layer", waves.k, waves.reference)
        double = self._matrix("neumann", waves.k, waves.reference)
        none = np.zeros_like(incident)
        e = waves.reflected(solve_linear(single, -incident), none)
        b = waves.reflected(none, solve_linear(double, incident))
        result = np.zeros((len(waves.alpha), 2, len(waves.alpha), 2), complex)
        for n, fields in enumerate((e, b)):
            result[:, n, :, n] = waves.flux * fields.T
        return result

    def _matrix(self, kind: str, k: complex, alpha: float, **options: Any) -> Any:
        """Return an operator of gratinglab by name, in a medium of wavenumber k."""
        return getattr(self._nystrom, f"{kind}_matrix")(
            self._boundary, k=k, alpha0=alpha, period=self.period, terms=self._terms,
            assembler=self._assembler, **options,
        )  # fmt: skip


class _Waves:
    """Plane waves of a station's channels on the boundary; channels are rows."""

    def __init__(self, boundary: Any, station: Station, period: float) -> None:
        self.k = np.pi * station.extent / period
        self.alpha = self.k * station.sines
        self.gamma = gamma = np.sqrt(self.k**2 - self.alpha**2)
        #: α of the channels within the material.
        self.inside = self.k * station.sines_of(station.inside)
        #: Bloch wavenumber of the kernels, which cancel least where it is small.
        self.reference = float(self.alpha[np.argmin(np.abs(self.alpha))])
        self.incident = np.exp(
            1j * (self.alpha[:, None] * boundary.x - gamma[:, None] * boundary.y)
        )
        outgoing = np.exp(-1j * (self.alpha[:, None] * boundary.x + gamma[:, None] * boundary.y))
        weighted = outgoing * boundary.quadrature
        direction = (self.alpha / gamma)[:, None] * boundary.nx + boundary.ny
        self._single = weighted / (2j * period * gamma[:, None])
        self._double = weighted * direction / (2 * period)
        #: Root of the ratio of cosines of the outgoing (column) and the incident (row) channel.
        self.flux = np.sqrt(gamma[None, :] / gamma[:, None])

    def reflected(self, normal: Complex, trace: Complex) -> Complex:
        """Amplitudes (channels, n) of fields with this normal derivative and trace, (points, n)."""
        return np.asarray(self._single @ normal + self._double @ trace)


class _InnerWaves:
    """Plane waves within the material, on the boundary; channels are columns.

    trace, normal, tangential : waves that come up from within, and their derivatives along the
        normal n and the tangent (n_y, −n_x).
    """

    def __init__(self, boundary: Any, waves: _Waves, k: complex, period: float) -> None:
        self.alpha = waves.inside
        square = k.real**2 - self.alpha**2
        self._lit = square > (LEAST_NORMAL * k.real) ** 2
        self._gamma = gamma = np.sqrt(np.where(self._lit, square, k.real**2))
        x, y, nx, ny = (v[:, None] for v in (boundary.x, boundary.y, boundary.nx, boundary.ny))
        self.trace = np.exp(1j * (self.alpha * x + gamma * y))
        self.normal = 1j * (self.alpha * nx + gamma * ny) * self.trace
        self.tangential = 1j * (self.alpha * ny - gamma * nx) * self.trace
        down = np.exp(-1j * (self.alpha * x - gamma * y)) * boundary.quadrature[:, None]
        self._down = (down / (2j * period * gamma)).T

    def transmitted(self, density: Complex) -> Complex:
        """Return the amplitudes (channels, n) of the single layers' waves in the material."""
        return np.asarray(self._down @ density)

    def power(self, c_e: complex, c_b: complex) -> Real:
        """Return the power of unit E and of unit B, (channels, 2); 0 where none propagates.

        Outside of the material the power is the normal part γ of the wave vector.
        """
        gamma = np.where(self._lit, self._gamma, 0.0)
        return np.stack([gamma * c_e.real, gamma * c_b.real], axis=-1)
