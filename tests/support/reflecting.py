"""Surfaces and materials whose albedo is known, or exceeds 1 without conservation."""

from __future__ import annotations

import numpy as np

import mitsuba_diffraction as md

ALUMINIUM = 0.96 + 6.69j  # at 550 nm (Rakić 1995)
MATERIALS = {
    "dielectric": ("small_slope", 1.5 + 0j),
    "aluminium": ("small_slope", ALUMINIUM),
    "perfect": ("kirchhoff", None),
}


def index_of(value):
    return lambda wavelengths: None if value is None else np.full(len(wavelengths), value)


def grating(depth: float = 0.2) -> md.HeightField:
    x = np.arange(32) * (1.6 / 32)
    return md.HeightField(
        np.tile(0.5 * depth * np.cos(2 * np.pi * x / 1.6), (8, 1)), 0.05, periodic=True
    )


def rough() -> md.HeightField:
    rng = np.random.default_rng(4)
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(96, 0.125), np.fft.fftfreq(96, 0.125)))
    spectrum = np.fft.fft2(rng.standard_normal((96, 96))) * np.exp(-((frequency / 0.9) ** 2))
    heights = np.fft.ifft2(spectrum).real
    return md.HeightField(0.08 * heights / heights.std(), 0.125)
