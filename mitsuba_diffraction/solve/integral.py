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
"""

from __future__ import annotations

import importlib.metadata
import warnings
from typing import Any

import numpy as np
from scipy.linalg import solve as solve_linear

from ..errors import DiffractionError
from .profiles import Profile
from .stations import Complex, Station

#: Order of the mesh graded towards corners, which gratinglab recommends (Kress 1990).
GRADING = 4


class IntegralSolver:
    """Boundary integral method for one profile; the mesh is kept for all stations.

    Parameters
    ----------
    profile : one period of the grooves.
    points : nodes on the boundary.

    Raises
    ------
    DiffractionError
        If gratinglab is not installed.
    """

    def __init__(self, profile: Profile, points: int) -> None:
        try:
            from gratinglab import profiles
            from gratinglab.problem import Problem
            from gratinglab.solvers.integral._boundary import physical_boundary
            from gratinglab.solvers.integral._nystrom import OperatorAssembler
        except ImportError as error:
            raise DiffractionError(
                "gratinglab is not installed; install the extra: pip install '.[solve]'"
            ) from error
        self.points, self.period = points, profile.period
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
            above = self._operators(waves.k, waves.reference)
            pairs = zip(station.wavelengths, station.indices, station.along, strict=True)
            return np.stack([self._finite(waves, above, *pair) for pair in pairs])

    def _operators(self, k: complex, alpha: float) -> tuple[Complex, Complex]:
        """Single layer V and ½ + K (corners subtracted) of the medium above."""
        from gratinglab.solvers.integral import _nystrom

        options = self._options(k, alpha)
        double = _nystrom.double_layer_matrix(self._boundary, subtract_corners=True, **options)
        return (
            _nystrom.single_layer_matrix(self._boundary, **options),
            double + 0.5 * np.eye(self.points),
        )

    def _finite(
        self,
        waves: _Waves,
        above: tuple[Complex, Complex],
        wavelength: float,
        index: complex,
        along: float,
    ) -> Complex:
        from gratinglab.solvers.integral import _nystrom

        v_above, k_above = above
        root = np.sqrt(complex(index) ** 2 - along**2)
        k_below = 2 * np.pi / wavelength * (root if root.imag >= 0 else -root)
        ratio = (waves.k / k_below) ** 2
        c_e, c_b, s = index**2 * ratio, ratio, along * (1 - ratio)
        options = self._options(k_below, waves.reference)
        trace = _nystrom.single_layer_matrix(self._boundary, **options)
        normal = _nystrom.adjoint_layer_matrix(self._boundary, **options)
        normal[np.diag_indices(self.points)] -= 0.5
        if self._boundary.graded:
            tangential = (
                _nystrom.tangential_derivative_matrix(self._boundary, alpha0=waves.reference)
                @ trace
            )
        else:
            tangential = _nystrom.tangential_layer_matrix(self._boundary, **options)
        first, second = k_above @ trace, v_above @ normal
        cross = s * (v_above @ tangential)
        system = np.block([[first - c_e * second, -cross], [cross, first - c_b * second]])
        n, channels = self.points, len(waves.alpha)
        right = np.zeros((2 * n, 2 * channels), complex)
        right[:n, :channels] = right[n:, channels:] = waves.incident.T
        densities = solve_linear(system, right, overwrite_a=True, overwrite_b=True)
        w, tau = densities[:n], densities[n:]
        e_normal = c_e * (normal @ w) + s * (tangential @ tau)
        b_normal = c_b * (normal @ tau) - s * (tangential @ w)
        e = waves.reflected(e_normal, trace @ w)
        b = waves.reflected(b_normal, trace @ tau)
        # (out, 2, channels in) to (in, 2, out, 2)
        fields = np.stack([e, b]).reshape(2, channels, 2, channels)
        return waves.flux[:, None, :, None] * fields.transpose(3, 2, 1, 0)

    def _perfect(self, waves: _Waves) -> Complex:
        """A perfect conductor: E vanishes on it, and so does the normal derivative of B."""
        from gratinglab.solvers.integral import _nystrom

        options = self._options(waves.k, waves.reference)
        incident = waves.incident.T
        single = _nystrom.single_layer_matrix(self._boundary, **options)
        double = _nystrom.neumann_matrix(self._boundary, **options)
        none = np.zeros_like(incident)
        e = waves.reflected(solve_linear(single, -incident), none)
        b = waves.reflected(none, solve_linear(double, incident))
        result = np.zeros((len(waves.alpha), 2, len(waves.alpha), 2), complex)
        for n, fields in enumerate((e, b)):
            result[:, n, :, n] = waves.flux * fields.T
        return result

    def _options(self, k: complex, alpha: float) -> dict[str, Any]:
        return {
            "k": k,
            "alpha0": alpha,
            "period": self.period,
            "terms": self._terms,
            "assembler": self._assembler,
        }


class _Waves:
    """Plane waves of a station's channels on the boundary; channels are rows."""

    def __init__(self, boundary: Any, station: Station, period: float) -> None:
        self.k = np.pi * station.extent / period
        self.alpha = self.k * station.sines
        gamma = np.sqrt(self.k**2 - self.alpha**2)
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
