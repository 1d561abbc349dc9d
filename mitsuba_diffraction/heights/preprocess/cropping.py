"""Cropping to a central region: less than was measured."""

from __future__ import annotations

from ...errors import DiffractionError
from ..field import HeightField

Size = tuple[float, float]


def middle(shape: tuple[int, int], pixel_size: Size, size: Size, name: str) -> tuple[slice, slice]:
    """Rows and columns of the middle of a patch.

    Parameters
    ----------
    shape : (ny, nx).
    pixel_size : (dx, dy), µm.
    size : (width, height) that is wanted, µm, met to half a pixel.
    name : what to call the patch in errors.

    Raises
    ------
    DiffractionError
        If that is more than there is, or less than two pixels.
    """
    slices = []
    for count, pixel, length in zip(shape, pixel_size[::-1], size[::-1], strict=True):
        kept = round(length / pixel)
        if not 2 <= kept <= count:
            (ny, nx), (dx, dy) = shape, pixel_size
            raise DiffractionError(
                f"{name}: crop to {size[0]:g} x {size[1]:g} µm is "
                f"{'larger than the patch' if kept > count else 'less than two pixels'}: it is "
                f"{nx * dx:.4g} x {ny * dy:.4g} µm with pixels of {dx:.4g} x {dy:.4g} µm"
            )
        start = (count - kept) // 2
        slices.append(slice(start, start + kept))
    return slices[0], slices[1]


def crop_line(before: tuple[int, int], after: tuple[int, int], pixel_size: Size) -> str:
    """What to say of a crop between shapes (ny, nx)."""
    (dx, dy), (ny, nx) = pixel_size, after
    return (
        f"cropped to the middle {nx * dx:.4g} x {ny * dy:.4g} µm of "
        f"{before[1] * dx:.4g} x {before[0] * dy:.4g} µm ({nx} x {ny} of "
        f"{before[1]} x {before[0]} pixels)"
    )


def crop(field: HeightField, size: Size) -> HeightField:
    """The central region of `size` = (width, height) in µm; its edges need not meet any more.

    Raises
    ------
    DiffractionError
        If that is more than there is, or less than two pixels.
    """
    rows, columns = middle(field.shape, field.pixel_size, size, field.name)
    heights = field.heights[rows, columns]
    if heights.shape == field.shape:
        return field
    line = crop_line(field.shape, (heights.shape[0], heights.shape[1]), field.pixel_size)
    return field.changed(heights, line, cut_out=True)
