# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Pairs of boxes."""

from typing import Any, NamedTuple, Tuple, Union

import numpy
from numpy.typing import NDArray

from cullet import _native
from cullet._arrays import indices, numbers

#: An array of shape (n, 6), min x, y, z and max x, y, z of each box; or a tuple of two of shape (n, 3), min and max.
Boxes = Union[Any, Tuple[Any, Any]]

Pairs = NDArray[numpy.uint32]


class PairDelta(NamedTuple):
    """What an update has changed: ids, uint32, shape (k, 2), first < second in each row, rows sorted."""

    added: Pairs
    removed: Pairs


class BoxSetStats(NamedTuple):
    """Numbers of a BoxSet."""

    boxes: int
    pairs: int
    bytes: int
    backend: str


def _corners(boxes: Boxes) -> Tuple[Any, Any]:
    if not isinstance(boxes, tuple):
        return numbers(boxes), None
    if len(boxes) != 2:
        raise ValueError("boxes: a tuple of min and max expected")
    return numbers(boxes[0]), numbers(boxes[1])


class BoxSet:
    """Boxes with ids, and the pairs of them that overlap.

    Boxes are closed: boxes that touch overlap. A box with min > max or a NaN overlaps nothing until it is moved; infinite
    boxes are legal. float32 is read as it is; float64 is rounded outward to float32, so that no pair is lost and boxes that
    are apart by less than a float's spacing may pair. Nothing is copied but into the set.

    Ids start at 0, grow by 1 with every box and are never reused: without remove() they are the rows of the boxes that were
    added, which the pairs of hull queries take.

    backend: "grid", or "brute", which tests every pair.
    threads: of an update, at most; 0: as many as the machine has. The pairs do not depend on it.
    margin: length, >= 0. A pair enters when its boxes overlap, and leaves when the boxes, each grown by it, no longer do.

    Calls on one set from several threads run one after the other.
    """

    def __init__(self, *, backend: str = "grid", threads: int = 0, margin: float = 0.0) -> None:
        self._set = _native.BoxSet(backend, threads, margin)

    def __len__(self) -> int:
        return self.stats().boxes

    def add(self, boxes: Boxes) -> NDArray[numpy.uint32]:
        """Add n boxes and return their ids, shape (n,). At most 2^30 boxes. Cost: O(n)."""
        ids: NDArray[numpy.uint32] = self._set.add(*_corners(boxes))
        return ids

    def move(self, ids: Any, boxes: Boxes) -> None:
        """Give the boxes of n ids new places. Of an id that is given twice, the later box counts. Cost: O(n)."""
        self._set.move(indices(ids), *_corners(boxes))

    def set_filters(self, ids: Any, groups: Any, masks: Any) -> None:
        """Set filters, initially group 1 and mask -1; all arrays of shape (n,).

        Two boxes may pair when (a.group & b.mask) and (b.group & a.mask). Filters are evaluated when a pair is about to
        enter; a pair that is there stays until its boxes part. Cost: O(n).
        """
        self._set.set_filters(indices(ids), indices(groups), indices(masks))

    def remove(self, ids: Any) -> None:
        """Remove boxes; the next update removes their pairs. No id may be given twice. Cost: O(n log n)."""
        self._set.remove(indices(ids))

    def update(self) -> PairDelta:
        """Find the pairs of the boxes as they are now, and return what has changed since the last update.

        Cost: about linear in boxes that moved and in pairs that changed. After MemoryError the pairs are those of the
        previous update, and the next one reports all changes since then.
        """
        return PairDelta(*self._set.update())

    def pairs(self) -> Pairs:
        """All pairs of the last update: ids, uint32, shape (k, 2), first < second, sorted. A copy. Cost: O(k)."""
        pairs: Pairs = self._set.pairs()
        return pairs

    def stats(self) -> BoxSetStats:
        """Numbers of boxes, pairs after the last update, and bytes."""
        return BoxSetStats(*self._set.stats())


def overlapping_pairs(boxes: Boxes, *, threads: int = 0) -> Pairs:
    """Return the rows of all boxes that overlap: uint32, shape (k, 2), first < second, sorted.

    For boxes that move, a BoxSet is faster, since it remembers. Boxes and threads are as there.
    """
    boxset = BoxSet(threads=threads)
    boxset.add(boxes)
    return boxset.update().added
