"""The Mitsuba BSDF plugin `diffraction_mix`: several surfaces in one, by weights.

Back and belly of a snake, worn scales and fresh ones.

The surfaces
------------
NAME : BSDF ∂
    Two surfaces or more, each with a name.
weight_NAME : float or texture ∂ [the rest of 1]
    Number from 0 on, raw texture or mesh attribute of one channel. Not all may be 0 at a point;
    mesh attributes make it black.
depth : float or texture ∂
    Instead, for `diffraction_orders` of one profile at several depths: µm, between theirs.

The model is f = Σ w f / Σ w. Where a weight is 0 its surface is not evaluated.

XML and the same in Python:

    <bsdf type="diffraction_mix">
        <bsdf type="diffraction" name="back"> ... </bsdf>
        <bsdf type="diffraction" name="belly"> ... </bsdf>
        <texture type="bitmap" name="weight_back">
            <string name="filename" value="back.png"/>
            <boolean name="raw" value="true"/>
        </texture>
    </bsdf>
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

from .base import ALL_COMPONENTS, PluginBSDF, ask
from .description import Mix
from .types import (
    BSDF,
    Callback,
    Context,
    Float,
    Interaction,
    Mask,
    Properties,
    Sample,
    Spectrum,
    Vector2f,
    Vector3f,
)
from .weights import weights_of

#: Function that asks a surface, in a context for it, for values and densities where a mask is true.
Ask = Callable[[BSDF, Context, Mask], Sequence[Any]]


class DiffractionMix(PluginBSDF):
    """Several BSDFs, blended by weights that vary over the surface."""

    title = "DiffractionMix"

    def __init__(self, props: Properties) -> None:
        super().__init__(props)
        objects = props.objects()
        self.bsdfs = {name: bsdf for name, bsdf in objects if isinstance(bsdf, mi.BSDF)}
        self._held = list(self.bsdfs.values())  # where `dr.freeze` finds them
        self.weights = weights_of(props, self.bsdfs)
        self.parameters = [*self.weights.varied]
        self.ready()
        for surface in self._held:
            if hasattr(surface, "mix"):
                surface.mix = weakref.ref(self)  # a cycle would keep both

    def components(self) -> list[int]:
        """See `PluginBSDF.components`."""
        return [bsdf.flags(n) for bsdf in self._held for n in range(bsdf.component_count())]

    # ------------------------------------------------------------------ Mitsuba's interface

    def answers(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
    ) -> Sequence[Any]:
        """See `PluginBSDF.answers`."""
        weights = self.weights.at(si, _wide(active, si, wo.z))
        asked: Ask = lambda bsdf, context, on: ask(bsdf, context, si, wo, on, kinds)  # noqa: E731
        return self._sum(ctx, weights, asked, kinds)

    def sample(
        self,
        ctx: Context,
        si: Interaction,
        sample1: Float,
        sample2: Vector2f,
        active: Mask = True,
    ) -> tuple[Sample, Spectrum]:
        """Draw a direction from a surface; return it with f cosθo of all over their density.

        Lobes of one direction are that surface's alone.
        """
        sample1, sample2 = mi.Float(sample1), mi.Point2f(sample2)
        weights = self.weights.at(si, _wide(active, si, sample1, sample2.x))
        shares = self._shares(ctx, weights)
        result, value = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
        chosen, weight, share = mi.UInt32(ALL_COMPONENTS), mi.Float(0.0), mi.Float(0.0)
        lower = mi.Float(0.0)
        for n, bsdf, context, first in self._asked(ctx):
            here = (shares[n] > 0.0) & (sample1 >= lower) & (sample1 < lower + shares[n])
            left = (sample1 - lower) * dr.rcp(dr.select(here, shares[n], 1.0))
            lower = lower + shares[n]
            draw = functools.partial(_drawn, bsdf, context, si, left, sample2)
            drawn, of_drawn = _where(here, draw, (result, value))
            result, value = dr.select(here, drawn, result), dr.select(here, of_drawn, value)
            result.sampled_component += dr.select(here, mi.UInt32(first), 0)
            chosen = dr.select(here, mi.UInt32(n), chosen)
            weight = dr.select(here, weights[n], weight)
            share = dr.select(here, shares[n], share)
        smooth = ~mi.has_flag(result.sampled_type, mi.BSDFFlags.Delta) & (result.pdf > 0.0)
        others, density = self._sum(
            ctx,
            weights,
            lambda bsdf, context, on: bsdf.eval_pdf(context, si, result.wo, on),
            "vd",
            lambda n: smooth & (chosen != n),
        )
        total = value * (weight * result.pdf) + others
        result.pdf = dr.fma(share, result.pdf, density)
        lit = result.pdf > 0.0
        return result, dr.select(lit, total * dr.rcp(dr.select(lit, result.pdf, 1.0)), 0.0)

    def eval_diffuse_reflectance(self, si: Interaction, active: Mask = True) -> Spectrum:
        """Return the weighted reflectances of the surfaces, for denoisers."""
        weights = self.weights.at(si, _wide(active, si))
        asked: Ask = lambda bsdf, context, on: [bsdf.eval_diffuse_reflectance(si, on)]  # noqa: E731
        return self._sum(mi.BSDFContext(), weights, asked, "v")[0]

    def traverse(self, callback: Callback) -> None:
        """Expose surfaces and weights."""
        for name, bsdf in self.bsdfs.items():
            callback.put(name, bsdf, mi.ParamFlags.Differentiable)
        super().traverse(callback)

    @property
    def together(self) -> list[PluginBSDF]:
        """This BSDF and the surfaces in it, whose changes are refused together."""
        return [self, *(bsdf for bsdf in self._held if hasattr(bsdf, "mix"))]

    def refusals(self) -> Iterator[str | None]:
        """See `PluginBSDF.refusals`."""
        yield self.weights.refusal()

    def describe(self) -> Mix:
        """Return the description of the surfaces and weights (`description.describe`)."""
        weights = self.weights
        return Mix(self.bsdfs, weights.textures, lambda si: weights.at(si, mi.Mask(True)))

    def shown(self) -> dict[str, Any]:
        """See `PluginBSDF.shown`."""
        return {**self.bsdfs, **self.weights.shown}

    # ------------------------------------------------------------------ the weights

    def _shares(self, ctx: Context, weights: list[Float]) -> list[Float]:
        """Return shares of the samples: the weights; for a component of one surface, all."""
        if ctx.component == ALL_COMPONENTS:
            return weights
        return [dr.select(weight > 0.0, mi.Float(1.0), 0.0) for weight in weights]

    def _asked(self, ctx: Context) -> Iterator[tuple[int, BSDF, Context, int]]:
        """Yield number, surface, context for that surface, and its first component."""
        first = 0
        for n, bsdf in enumerate(self._held):
            if ctx.component == ALL_COMPONENTS:
                yield n, bsdf, ctx, first
            elif first <= ctx.component < first + bsdf.component_count():
                context = mi.BSDFContext(ctx.mode, ctx.type_mask, ctx.component - first)
                yield n, bsdf, context, first
            first += bsdf.component_count()

    def _sum(
        self,
        ctx: Context,
        weights: list[Float],
        asked: Ask,
        kinds: str,
        where: Callable[[int], Mask] = lambda n: True,
    ) -> list[Any]:
        """Sum the surfaces' answers, "v"alues and "d"ensities, times their weights or shares."""
        factors = [weights if kind == "v" else self._shares(ctx, weights) for kind in kinds]
        nothing = [mi.Spectrum(0.0) if kind == "v" else mi.Float(0.0) for kind in kinds]
        totals = list(nothing)
        for n, bsdf, context, _ in self._asked(ctx):
            on = mi.Mask((weights[n] > 0.0) & where(n))
            answers = _where(on, functools.partial(asked, bsdf, context), nothing)
            totals = [
                total + dr.select(on, part * factor[n], 0.0)
                for total, part, factor in zip(totals, answers, factors, strict=True)
            ]
        return totals


def _wide(active: Mask, si: Interaction, *arrays: Float) -> Mask:
    """Return a mask as wide as the arrays of its branch; otherwise Dr.Jit ends the process."""
    for value in (si.wi.z, *arrays):
        active = mi.Mask(active) & dr.isfinite(value)
    return active


def _drawn(
    bsdf: BSDF, context: Context, si: Interaction, sample1: Float, sample2: Vector2f, on: Mask
) -> Sequence[Any]:
    return bsdf.sample(context, si, sample1, sample2, on)


def _where(on: Mask, ask: Callable[[Mask], Sequence[Any]], otherwise: Sequence[Any]) -> Any:
    """Return the answers where the mask is true; kernels skip a branch that no lane takes."""
    if not dr.is_jit_v(mi.Float):
        return ask(on) if on else otherwise

    def typed(answers: Sequence[Any]) -> tuple[Any, ...]:
        """Copy answers to the types that both branches must share."""
        return tuple(type(by)(answer) for by, answer in zip(otherwise, answers, strict=True))

    return dr.if_stmt((), on, lambda: typed(ask(on)), lambda: typed(otherwise))


mi.register_bsdf("diffraction_mix", DiffractionMix)
