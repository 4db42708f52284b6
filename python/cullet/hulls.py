# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Queries of many pairs of convex hulls.

All of them take bodies a and b, that is hulls with poses:

a, b: a Hull, or a sequence of n of them.
poses_a, poses_b: None, for the frame of the hulls' points; an array of shape (n, 7), x, y, z and a quaternion x, y, z, w of
    any length but 0; or of matrices, shape (n, 4, 4), whose last row is 0, 0, 0, 1 and whose upper left 3 x 3 can be
    inverted, mirrored and scaled ones included. (7,) and (4, 4) are one pose. One hull stands for many poses, one pose for
    many hulls.
pairs: an array of shape (k, 2) of whole numbers, row of a and row of b. None: body i of a with body i of b, where a single
    body stands for all.
threads: at most; 0: as many as the machine has.

A result depends on the two hulls and poses alone, to the last bit, not on threads, nor on the pairs beside it. Axes point from
b to a.
"""

import enum
import math
from typing import Any, NamedTuple, Sequence, Union

import numpy
from numpy.typing import NDArray

from cullet import _native
from cullet._arrays import indices, numbers

Reals = NDArray[numpy.float64]


class State(enum.IntEnum):
    """What is known of a pair."""

    SEPARATED = 0  #: the distance is larger than the requested maximum
    NEAR = 1  #: 0 < distance <= the requested maximum
    OVERLAPPING = 2  #: the hulls have a point in common, or touch
    NOT_CONVERGED = 3  #: no answer: the hulls are degenerate beyond double precision


class Hull(_native.Hull):
    """Convex hull of points: a solid, a polygon, a segment or a point, depending on what they span. It never changes.

    points: shape (n, 3), n from 1 to 2^24; finite and up to 1e60.
    Cost: about 2 ms for 1,000 points.
    """

    def __init__(self, points: Any) -> None:
        super().__init__(numbers(points))

    def __repr__(self) -> str:
        return f"<cullet.Hull of {self.vertex_count} vertices>"


class OverlapResults(NamedTuple):
    """Answers of hull_overlap(), row by row."""

    states: NDArray[numpy.int32]  #: (k,) SEPARATED, OVERLAPPING or NOT_CONVERGED
    axes: Reals  #: (k, 3) a separating axis of any length; zero if hulls overlap

    @property
    def overlapping(self) -> NDArray[numpy.bool_]:
        """(k,) whether the hulls overlap. A pair without an answer is False here."""
        overlapping: NDArray[numpy.bool_] = self.states == State.OVERLAPPING
        return overlapping


class HullResults(NamedTuple):
    """Answers of the other queries, row by row. What a state does not define is zero."""

    states: NDArray[numpy.int32]  #: (k,) of State
    distances: Reals  #: (k,) of hulls that are NEAR; of OVERLAPPING ones 0, or minus the depth
    axes: Reals  #: (k, 3) unit vectors
    points_a: Reals  #: (k, 3) closest or deepest points of a in the world; points_a - points_b = distance * axis
    points_b: Reals  #: (k, 3) of b

    @property
    def overlapping(self) -> NDArray[numpy.bool_]:
        """(k,) whether the hulls overlap. A pair without an answer is False here."""
        overlapping: NDArray[numpy.bool_] = self.states == State.OVERLAPPING
        return overlapping


Hulls = Union[Hull, Sequence[Hull]]

_OVERLAP, _DISTANCE, _PENETRATION, _CONTACT = range(4)


def _tuple_of(hulls: Hulls) -> Any:
    # A tuple of its own keeps the hulls alive while another thread changes the caller's list.
    return (hulls,) if isinstance(hulls, Hull) else tuple(hulls)


def _query(
    query: int, a: Hulls, b: Hulls, poses_a: Any, poses_b: Any, pairs: Any, max_distance: float, threads: int
) -> Any:
    return _native.query_hulls(
        query,
        _tuple_of(a),
        None if poses_a is None else numbers(poses_a),
        _tuple_of(b),
        None if poses_b is None else numbers(poses_b),
        None if pairs is None else indices(pairs),
        max_distance,
        threads,
    )


def _measured(query: int, *arguments: Any) -> HullResults:
    states, reals = _query(query, *arguments)
    count = len(states)
    axes, points_a, points_b = reals[: 9 * count].reshape(3, count, 3)
    return HullResults(states, reals[9 * count :], axes, points_a, points_b)


def hull_overlap(
    a: Hulls, b: Hulls, poses_a: Any = None, poses_b: Any = None, *, pairs: Any = None, threads: int = 0
) -> OverlapResults:
    """Test whether hulls have a point in common, by ISA-GJK. The cheapest query: below a microsecond for most pairs."""
    states, axes = _query(_OVERLAP, a, b, poses_a, poses_b, pairs, 0.0, threads)
    return OverlapResults(states, axes.reshape(len(states), 3))


def hull_distance(
    a: Hulls,
    b: Hulls,
    poses_a: Any = None,
    poses_b: Any = None,
    *,
    pairs: Any = None,
    max_distance: float = math.inf,
    threads: int = 0,
) -> HullResults:
    """Compute distances and closest points, by GJK.

    max_distance: >= 0. Hulls farther apart are SEPARATED, as soon as that is certain, with an axis but without distance and
        points.
    Overlapping hulls have distance 0, and neither axis nor points: see hull_penetration() and hull_contact().
    """
    return _measured(_DISTANCE, a, b, poses_a, poses_b, pairs, max_distance, threads)


def hull_penetration(
    a: Hulls, b: Hulls, poses_a: Any = None, poses_b: Any = None, *, pairs: Any = None, threads: int = 0
) -> HullResults:
    """Compute the depths of hulls that overlap, by the expanding polytope algorithm.

    a moved by -distance * axis only touches b. Hulls that do not overlap are SEPARATED, with distance, axis and points zero.
    Cost: about ten times that of a distance, where hulls overlap.
    """
    return _measured(_PENETRATION, a, b, poses_a, poses_b, pairs, 0.0, threads)


def hull_contact(
    a: Hulls,
    b: Hulls,
    poses_a: Any = None,
    poses_b: Any = None,
    *,
    pairs: Any = None,
    max_distance: float = math.inf,
    threads: int = 0,
) -> HullResults:
    """Compute a signed distance: hull_distance() of hulls that are apart, hull_penetration() of those that overlap.

    One point of each hull, the closest or the deepest; not a patch of several points.
    """
    return _measured(_CONTACT, a, b, poses_a, poses_b, pairs, max_distance, threads)
