"""Features of surfaces that the shaders draw."""

from __future__ import annotations

from ...plugin.description import Consumer, Feature

#: Features that the shaders draw.
GLSL = Consumer(
    "the realtime renderer",
    frozenset(Feature) - {
        Feature.TRANSMISSION, Feature.FILM, Feature.STACK, Feature.PLACED,
        Feature.VARYING_HEIGHT, Feature.CROSSED, Feature.VARYING_FILM,
    },
    "leave it out, or render the scene with Mitsuba",
    {Feature.CROSSED: "render the scene with Mitsuba"},
)  # fmt: skip
