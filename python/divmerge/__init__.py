"""LiDAR instance clustering by divide and merge."""

from enum import IntEnum

from . import _divmerge
from ._divmerge import (
    Error,
    Frame,
    Frames,
    Result,
    Taxonomy,
    __version__,
    cluster,
    cluster_image,
    frames,
    topics,
)

Reason = IntEnum("Reason", _divmerge.REASONS)
