"""Integrator that limits the light of single samples, against bright dots of rare paths."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError
from .surfaces import appended

#: Name of the integrator.
CLAMPED = "clamped_samples"


def put_clamp(state: Any, limit: float) -> None:
    """Nest the integrators of a scene in one that limits samples.

    state : `mi.parser.ParserState`, its references resolved.
    limit : largest radiance of a sample, in units of white; the colour is kept.
    """
    mi.register_integrator(CLAMPED, _integrator())
    for number in range(len(state.nodes)):
        if state.nodes[number].type != mi.ObjectType.Integrator:
            continue
        props = mi.Properties(CLAMPED)
        props["limit"] = limit
        props["nested"] = appended(state, mi.ObjectType.Integrator, state.nodes[number].props)
        state.nodes[number].props = props


def _integrator() -> type[Any]:
    """Return the class of the integrator in the variant that is set."""

    class ClampedSamples(mi.SamplingIntegrator):
        """Integrator whose samples are another's, scaled down to a largest radiance."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.limit = float(props["limit"])
            self.nested = props["nested"]
            if not isinstance(self.nested, mi.SamplingIntegrator):
                raise DiffractionError(
                    f"clamping limits samples of paths from the camera; {self.nested.class_name()} "
                    "traces light from lamps: leave clamping out"
                )

        def sample(
            self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True
        ) -> Any:
            spectrum, valid, others = self.nested.sample(scene, sampler, ray, medium, active)
            largest = dr.max(mi.unpolarized_spectrum(spectrum))
            scale = self.limit / dr.maximum(largest, self.limit)
            return spectrum * scale, valid, others

        def aov_names(self) -> Any:
            return self.nested.aov_names()

        def to_string(self) -> str:
            return f"ClampedSamples[limit = {self.limit:g}, nested = {self.nested}]"

    return ClampedSamples
