#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Overlapping pairs of boxes from Python: NumPy arrays in, NumPy arrays out, no Bullet and nothing to compile.

Usage: pairs.py [path of libcullet.so]. Compares each step with the pairs that NumPy finds by comparing all boxes.
"""

import ctypes
import ctypes.util
import sys

try:
    import numpy
except ImportError:
    print("no NumPy for this Python (Debian: python3-numpy): the example is skipped")
    sys.exit(77)


class Pairs(ctypes.Structure):
    _fields_ = [("data", ctypes.POINTER(ctypes.c_uint32)), ("count", ctypes.c_uint64)]

    def array(self):
        """A copy, since the library uses its memory again in the next update."""
        if self.count == 0:
            return numpy.empty((0, 2), numpy.uint32)
        return numpy.ctypeslib.as_array(self.data, (self.count, 2)).copy()


class BoxSet:
    """Boxes as rows of a float32 array: min x, y, z, max x, y, z."""

    def __init__(self, path):
        self.library = ctypes.CDLL(path)
        self.library.cullet_last_error.restype = ctypes.c_char_p
        self.handle = ctypes.c_void_p()
        self.call("create", None, ctypes.byref(self.handle))

    def call(self, name, *arguments):
        status = getattr(self.library, "cullet_box_set_" + name)(*arguments)
        if status < 0:
            raise RuntimeError(self.library.cullet_last_error().decode())

    def add(self, boxes):
        ids = numpy.empty(len(boxes), numpy.uint32)
        self.call("add", self.handle, *self.pointer(boxes), len(boxes), ctypes.c_void_p(ids.ctypes.data))
        return ids

    def move(self, ids, boxes):
        self.call("move", self.handle, ctypes.c_void_p(ids.ctypes.data), *self.pointer(boxes), len(boxes))

    def update(self):
        """Pairs of ids that came, and those that went, both sorted."""
        added, removed = Pairs(), Pairs()
        self.call("update", self.handle, ctypes.byref(added), ctypes.byref(removed))
        return added.array(), removed.array()

    def pairs(self):
        pairs = Pairs()
        self.call("pairs", self.handle, ctypes.byref(pairs))
        return pairs.array()

    def close(self):
        self.library.cullet_box_set_destroy(self.handle)

    @staticmethod
    def pointer(boxes):
        assert boxes.dtype == numpy.float32 and boxes.shape[1:] == (6,) and boxes.strides[1] == 4
        return ctypes.c_void_p(boxes.ctypes.data), ctypes.c_size_t(boxes.strides[0])


def pairs_by_comparing_all(ids, boxes):
    low, high = boxes[:, None, :3], boxes[None, :, 3:]
    overlap = numpy.all(low <= high, axis=2)
    first, second = numpy.nonzero(numpy.triu(overlap & overlap.T, 1))
    return numpy.stack([ids[first], ids[second]], axis=1)


def main():
    random = numpy.random.default_rng(1)
    # Rows of eight floats, of which a box uses six: the caller chooses the strides.
    table = numpy.zeros((1000, 8), numpy.float32)
    boxes = table[:, :6]
    boxes[:, :3] = random.uniform(0, 20, (1000, 3))
    boxes[:, 3:] = boxes[:, :3] + random.uniform(0.1, 2, (1000, 3))
    path = sys.argv[1] if len(sys.argv) > 1 else ctypes.util.find_library("cullet")
    if path is None:
        sys.exit("libcullet is not where the linker looks: give the path of libcullet.so")
    boxset = BoxSet(path)
    ids = boxset.add(boxes)
    for step in range(10):
        added, removed = boxset.update()
        expected = pairs_by_comparing_all(ids, boxes)
        if not numpy.array_equal(boxset.pairs(), expected):
            sys.exit(f"step {step}: not the pairs that comparing all boxes gives")
        print(f"step {step}: {len(expected)} pairs, {len(added)} came, {len(removed)} went")
        boxes += numpy.tile(random.uniform(-0.3, 0.3, (1000, 3)).astype(numpy.float32), 2)
        boxset.move(ids, boxes)
    boxset.close()


if __name__ == "__main__":
    main()
