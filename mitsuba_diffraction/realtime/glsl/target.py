"""What is drawn into where there is no window, or besides it."""

from __future__ import annotations

from typing import Any

from ...errors import DiffractionError


class Target:
    """A picture in single precision, with depth.

    Parameters
    ----------
    context : of moderngl.
    width, height : pixels.

    Attributes
    ----------
    frame : the framebuffer.

    Raises
    ------
    DiffractionError
        If the driver has no textures so large.
    """

    def __init__(self, context: Any, width: int, height: int) -> None:
        largest = context.info["GL_MAX_TEXTURE_SIZE"]
        if max(width, height) > largest:
            raise DiffractionError(
                f"a picture of {width} × {height} samples is too large for the driver, which "
                f"takes {largest}; lower the supersampling or the size"
            )
        self.colour = context.texture((width, height), 4, dtype="f4")
        self.depth = context.depth_renderbuffer((width, height))
        self.frame = context.framebuffer([self.colour], self.depth)

    def release(self) -> None:
        """Free it."""
        for thing in (self.frame, self.colour, self.depth):
            thing.release()
