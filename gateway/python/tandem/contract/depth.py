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
"""By what pixels are joined to a surface. Neighbours are of about the same depth, except of an object."""


@dataclass(frozen=True, kw_only=True)
class DepthReply(Reply):
    """The reply to `query_depth`."""

    robot: str
    """The robot whose camera measured."""

    frame: PoseFrame | None = None
    """The frame of the points, where the call named another than that of the pelvis; left out otherwise."""

    surfaces: tuple[Surface, ...] = ()
    """The surfaces that were found: at a pixel the patch of its colour and, where that is more, the whole thing;
    of a colour up to three, the nearest first and what is of the room last; of an object one; of all one for
    each that is seen. Left out where none was asked for.
    """

    fit: RegionFit | None = None
    """Plane, edges and corners of the region; left out where `fit` was not asked for."""

    columns: tuple[str, ...] = ()
    """Columns of `points`: "u", "v", "x_m", "y_m", "z_m". Left out of a short reply without points."""

    points: tuple[tuple[float | None, float | None, float | None, float | None, float | None], ...] = ()
    """One row per pixel asked for, in the same order; of a region row by row. Millimetres; null where nothing is
    seen, or the camera has no depth. Left out with surfaces or a fit.
    """


@dataclass(frozen=True, kw_only=True)
class EdgeFit(Reply):
    """A straight edge at which the plane ends within the region."""

    from_m: tuple[float, float, float]
    """One end of what is seen of it, in metres in the frame of the reply."""

    to_m: tuple[float, float, float]
    """The other end."""

    rms_m: float
    """Root mean square of how far its points are off it, in metres."""

    points: int
    """Number of points that it was fitted to."""


@dataclass(frozen=True, kw_only=True)
class PlaneFit(Reply):
    """The largest plane in a region of a picture."""

    point_m: tuple[float, float, float]
    """The middle of its points, in metres in the frame of the reply."""

    normal: tuple[float, float, float]
    """Unit vector at right angles to it, towards the camera, in that frame."""

    rms_m: float
    """Root mean square of how far its points are off it, in metres."""

    pixels: int
    """Number of the region's pixels that see it."""

    share: float
    """Their share of those that see anything."""


@dataclass(frozen=True, kw_only=True)
class RegionFit(Reply):
    """Result of `fit` in a region."""

    plane: PlaneFit
    """The largest plane."""

    edges: tuple[EdgeFit, ...]
    """Its straight edges, the longest first, up to four. An edge may be where something hides the plane."""

    corners_m: tuple[tuple[float, float, float], ...]
    """Corners, where two of them meet, in metres in the frame of the reply."""


@dataclass(frozen=True, kw_only=True)
class Surface(Reply):
    """A surface as the camera sees it: only what is in view, and of a thing only its near side."""

    object: str | None = None
    """The object, where the call asked for all; left out otherwise."""

    joined_by: JoinedBy
    """By what its pixels are joined."""

    pixels: int
    """Number of its pixels."""

    from_: tuple[int, int]
    """Its top left and bottom right in the picture, as [u, v]."""

    to: tuple[int, int]
    """See `from`."""

    rgb: tuple[int, int, int]
    """Its mean colour, [red, green, blue] from 0 to 255."""

    centroid_m: tuple[float, float, float]
    """The middle of its area, in metres in the frame of the reply."""

    middle_m: tuple[float, float, float]
    """The middle of its box along the axes of that frame: of a thing that is seen whole, its own."""

    extent_m: tuple[float, float, float]
    """Size of that box along each axis, in metres."""

    corners_m: tuple[tuple[float, float, float], ...] = ()
    """The four points of its outline that span the most of it in the picture, in the order of its outline: of a
    rectangle its corners. Left out of a short reply where there is an axis, and of all objects.
    """

    axis: UprightAxis | None = None
    """Its axis, where it is upright and round; left out otherwise."""

    cut_off: bool
    """True if it goes on beyond the image."""


@dataclass(frozen=True, kw_only=True)
class UprightAxis(Reply):
    """The axis of a thing that is upright and round, as a bottle."""

    bottom_m: tuple[float, float, float]
    """Its lower end as far as that is seen, [x, y, z] in metres in the frame of the reply."""

    top_m: tuple[float, float, float]
    """Its upper end."""

    radius_m: float
    """The radius of most of it, in metres."""
