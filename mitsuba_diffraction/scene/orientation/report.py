"""What is said of the direction of a patch on a mesh, and of what speaks against it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...plugin.textures import ORIENTATION
from .breaks import BREAK

MOST_TURNING = 0.05  # of the surface, on which the direction may turn too fast
LONG = 0.05  # of the mesh's size: breaks that are longer in all are seen
TURN = 30.0  # degrees between neighbours from which on a seam shows


@dataclass(frozen=True)
class TangentReport:
    """What `check_tangents` found; shares are of the surface area, 0 to 1."""

    triangles: int  # number of triangles with an area
    # has_uv, has_normals, has_orientation: whether the mesh carries them
    has_uv: bool
    has_normals: bool
    degenerate: float  # share whose texture coordinates span no area: no tangent there
    mirrored: float  # share where u × v runs the other way round: the patch is seen mirrored
    # share within which the direction turns by over 60 degrees, or which lies beside an edge across
    # which it turns by more than 30
    turning: float
    stretch: float  # median ratio of |dp/du| to |dp/dv| (1: no direction is stretched)
    # length of the lines along which the direction breaks, in the unit of the positions
    broken: float
    size: float  # of the mesh, its longest side along an axis
    has_orientation: bool = False

    @property
    def usable(self) -> bool:
        """True where a patch can follow nearly all of the surface."""
        return self.has_uv and self.degenerate < 0.01 and not self.turns_fast and not self.breaks

    @property
    def breaks(self) -> bool:
        """Whether the direction breaks along lines that are long enough to be seen."""
        return self.broken >= LONG * self.size and self.broken > 0

    @property
    def turns_fast(self) -> bool:
        """Whether the direction turns too fast for the triangles on much of the surface."""
        return self.turning >= MOST_TURNING

    def breaking(self) -> str:
        """How long the lines are along which the direction breaks, in words."""
        return (
            f"breaks (turns by over {BREAK:g} degrees) along lines of {self.broken:.3g} in all, "
            f"{self.broken / self.size:.2g} times the mesh's size of {self.size:.3g}"
        )

    def problems(self) -> list[str]:
        """One line for each thing that speaks against this mesh, with what to do."""
        if not self.has_uv:
            return [
                "no texture coordinates, so the patch has no direction: give the mesh one with "
                "'mitsuba-diffraction tangents', or unwrap it so that u runs the way the patch's x "
                "axis shall"
            ]
        lines = []
        if not self.has_normals:
            lines.append("no vertex normals: every triangle reflects like a flat mirror")
        if self.degenerate >= 0.01:
            lines.append(
                f"{self.degenerate:.0%} of the surface has texture coordinates without area, hence "
                "no tangent: unwrap those parts"
            )
        if self.breaks:
            lines.append(
                f"the patch's direction {self.breaking()}: colours will show seams; "
                + (
                    "make it with 'mitsuba-diffraction tangents' and another --along"
                    if self.has_orientation
                    else "unwrap along the body in one piece"
                )
            )
        if self.turns_fast:
            lines.append(
                f"the patch's direction turns by over {TURN:g} degrees between neighbours, or "
                f"{BREAK:g} within a triangle, on {self.turning:.0%} of the surface: "
                + (
                    "use a finer mesh, or another --along of 'mitsuba-diffraction tangents'"
                    if self.has_orientation
                    else "colours will show seams; unwrap along the body in one piece"
                )
            )
        if 0.01 < self.mirrored < 0.99:
            lines.append(
                f"{self.mirrored:.0%} of the surface shows the patch mirrored: flip those parts"
            )
        return lines

    def summary(self) -> dict[str, Any]:
        """Plain numbers and strings, for printing."""
        return {
            "triangles": self.triangles,
            "texture coordinates": self.has_uv,
            "normals": self.has_normals,
            "direction of the patch": (
                "none"
                if not self.has_uv
                else f"dp/du turned by {ORIENTATION}"
                if self.has_orientation
                else "dp/du"
            ),
            "shares of the surface area, 0 to 1": {
                "without tangent": self.degenerate,
                "mirrored": self.mirrored,
                "turning tangent": self.turning,
            },
            "lines along which the direction breaks": {
                "length": self.broken,
                "length / mesh size": self.broken / self.size if self.size > 0 else 0.0,
            },
            "stretch, median |dp/du| / |dp/dv|": self.stretch,
            "usable": self.usable,
            "problems": self.problems(),
        }
