# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Overlapping pairs of boxes, and queries of convex hulls in batches. No Bullet, no GPU.

Arrays are those of NumPy or of any library with DLPack (PyTorch, JAX, ...) in the memory of the CPU, float32 or float64, with
any strides. Lengths have the unit of the caller's world. Every function may be called from any thread, and releases the GIL
while it works. Results are the same bits for any number of threads.

Errors: ValueError for wrong shapes, types and numbers, KeyError for an unknown id, MemoryError. A failing call changes
nothing.
"""

from cullet._native import version as __version__
from cullet.boxes import Boxes, BoxSet, BoxSetStats, PairDelta, overlapping_pairs
from cullet.hulls import (
    Hull,
    HullResults,
    OverlapResults,
    State,
    hull_contact,
    hull_distance,
    hull_overlap,
    hull_penetration,
)

__all__ = [
    "BoxSet",
    "BoxSetStats",
    "Boxes",
    "Hull",
    "HullResults",
    "OverlapResults",
    "PairDelta",
    "State",
    "__version__",
    "hull_contact",
    "hull_distance",
    "hull_overlap",
    "hull_penetration",
    "overlapping_pairs",
]
