"""LiDAR instance clustering by divide and merge (Zhao, Zhang, Huang, arXiv 2109.08224).

    import divmerge
    result = divmerge.cluster(points, classes)
    print(result.instance, result.instances)

Metres, radians and nanoseconds, x, y and z in the sensor's own frame. https://arxiv.org/abs/2109.08224 has the method,
``divmerge.cluster`` the parameters.
"""

from enum import IntEnum

from ._divmerge import (
    Error,
    Frame,
    Frames,
    Result,
    Taxonomy,
    __version__,
    annotate,
    annotate_slice,
    cluster,
    cluster_image,
    compare,
    evaluate,
    explain,
    failures,
    figure,
    frames,
    join,
    parameters,
    plan,
    simulate,
    topics,
    triage,
)

__all__ = [
    "Error",
    "Frame",
    "Frames",
    "Reason",
    "Result",
    "Taxonomy",
    "__version__",
    "annotate",
    "annotate_slice",
    "cluster",
    "cluster_image",
    "compare",
    "evaluate",
    "explain",
    "failures",
    "figure",
    "frames",
    "join",
    "parameters",
    "plan",
    "simulate",
    "topics",
    "triage",
]


class Reason(IntEnum):
    """Why a point has no instance: the numbers of ``Result.reason`` and of the field ``reason`` in annotated clouds."""

    NONE = 0
    """It has an instance."""
    NO_RETURN = 1
    """The beam came back with nothing: NaN, infinite, or at the origin."""
    NOT_AN_OBJECT = 2
    """Its class is no thing, or the taxonomy does not know it."""
    GROUND = 3
    """Ground, by geometry."""
    SHADOWED = 4
    """Hidden behind another point of its pixel, and no pixel of its class nearby to take a label from."""
    UNREACHED = 5
    """An object pixel that no seed reached."""
    TOO_SMALL = 6
    """Its instance had fewer pixels than the minimum."""
    CROPPED = 7
    """The point was left out by its place: too near, too far, outside or inside a block."""
    SCATTERED = 8
    """Of a group of fewer than five pixels, where there are no classes."""
