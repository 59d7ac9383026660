"""Replies to query_depth.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from .commands import PoseFrame
from .reading import Reply

JoinedBy: TypeAlias = Literal[
    "color",
    "shape",
    "object",
]
"""Criterion that joins pixels to a surface. Neighbours have about the same depth, except for `object`."""


@dataclass(frozen=True, kw_only=True)
class DepthReply(Reply):
    """The reply to `query_depth`."""

    robot: str
    """The robot whose camera measured."""

    frame: PoseFrame | None = None
    """Frame of the points, if the call named another than the pelvis; left out otherwise."""

    surfaces: tuple[Surface, ...] = ()
    """The surfaces found: at a pixel, the patch of its colour and, if larger, the whole object; for a colour up to
    three, the nearest first and parts of the room last; for an object one; for "all" one for each visible
    object. Left out where none was requested.
    """

    fit: RegionFit | None = None
    """Plane, edges and corners of the region; left out unless `fit` was requested."""

    columns: tuple[str, ...] = ()
    """Columns of `points`: "u", "v", "x_m", "y_m", "z_m". Left out of a short reply without points."""

    points: tuple[tuple[float | None, float | None, float | None, float | None, float | None], ...] = ()
    """One row per requested pixel, in order; a region's row by row. Rounded to 1 mm; null where nothing is seen,
    or the camera has no depth. Left out with surfaces or a fit.
    """


@dataclass(frozen=True, kw_only=True)
class EdgeFit(Reply):
    """A straight edge at which the plane ends within the region."""

    from_m: tuple[float, float, float]
    """One end of its visible part, in metres in the frame of the reply."""

    to_m: tuple[float, float, float]
    """The other end."""

    rms_m: float
    """Root mean square distance of its points, in metres."""

    points: int
    """Number of points that it was fitted to."""


@dataclass(frozen=True, kw_only=True)
class PlaneFit(Reply):
    """The largest plane in a region of a picture."""

    point_m: tuple[float, float, float]
    """The middle of its points, in metres in the frame of the reply."""

    normal: tuple[float, float, float]
    """Unit normal towards the camera, in that frame."""

    rms_m: float
    """Root mean square distance of its points, in metres."""

    pixels: int
    """Number of the region's pixels that see it."""

    share: float
    """Their share of the pixels with depth."""


@dataclass(frozen=True, kw_only=True)
class RegionFit(Reply):
    """Result of `fit` in a region."""

    plane: PlaneFit
    """The largest plane."""

    edges: tuple[EdgeFit, ...]
    """Its straight edges, the longest first, up to four. An edge may be due to occlusion."""

    corners_m: tuple[tuple[float, float, float], ...]
    """Corners at which two edges meet, in metres in the frame of the reply."""


@dataclass(frozen=True, kw_only=True)
class Surface(Reply):
    """The visible part of a surface; of an object only its near side."""

    object: str | None = None
    """The object, if the call named "all"; left out otherwise."""

    joined_by: JoinedBy
    """Criterion for its pixels."""

    pixels: int
    """Number of its pixels."""

    from_: tuple[int, int]
    """Top left of its bounding box, as [u, v]."""

    to: tuple[int, int]
    """Bottom right."""

    rgb: tuple[int, int, int]
    """Its mean colour, [red, green, blue] from 0 to 255."""

    centroid_m: tuple[float, float, float]
    """The middle of its area, in metres in the frame of the reply."""

    middle_m: tuple[float, float, float]
    """Middle of its box along that frame's axes: the object's own if it is fully visible."""

    extent_m: tuple[float, float, float]
    """Size of that box along each axis, in metres."""

    corners_m: tuple[tuple[float, float, float], ...] = ()
    """The four points of its outline that span the largest area in the picture, in the order of the outline: a
    rectangle's corners. Left out of a short reply with an axis, and for "all".
    """

    axis: UprightAxis | None = None
    """Its axis, where it is upright and round; left out otherwise."""

    cut_off: bool
    """True if it extends beyond the image."""


@dataclass(frozen=True, kw_only=True)
class UprightAxis(Reply):
    """Axis of an upright round object, such as a bottle."""

    bottom_m: tuple[float, float, float]
    """Its lower visible end, [x, y, z] in metres in the frame of the reply."""

    top_m: tuple[float, float, float]
    """Its upper end."""

    radius_m: float
    """The radius of most of it, in metres."""
