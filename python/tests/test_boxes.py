# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

import ctypes
import gc
import threading

import numpy
import pytest
from conftest import pairs_by_comparing_all, random_boxes

import cullet


def as_set(pairs):
    return {tuple(pair) for pair in pairs.tolist()}


@pytest.mark.parametrize("backend", ["grid", "brute"])
@pytest.mark.parametrize("dtype", [numpy.float32, numpy.float64])
def test_pairs_and_deltas_equal_brute_force_while_boxes_move_come_and_go(random, backend, dtype):
    boxes = random_boxes(random, 800).astype(dtype)
    boxset = cullet.BoxSet(backend=backend, threads=2)
    ids = boxset.add(boxes)
    assert ids.tolist() == list(range(800))
    known, changes = set(), 0
    for step in range(10):
        delta = boxset.update()
        pairs = boxset.pairs()
        assert numpy.array_equal(pairs, pairs_by_comparing_all(ids, boxes)), step
        assert as_set(delta.added) == as_set(pairs) - known
        assert as_set(delta.removed) == known - as_set(pairs)
        changes += len(delta.added) * len(delta.removed) > 0
        known = as_set(pairs)
        # A third moves; in every other step some go, and others come.
        moved = random.random(len(ids)) < 0.3
        boxes[moved] += numpy.tile(random.uniform(-0.5, 0.5, (moved.sum(), 3)), 2).astype(numpy.float32)
        if dtype == numpy.float64:
            boxes = boxes.astype(numpy.float32).astype(dtype)
        boxset.move(ids[moved], boxes[moved])
        if step % 2:
            boxset.remove(ids[:20])
            fresh = random_boxes(random, 20).astype(dtype)
            ids = numpy.concatenate([ids[20:], boxset.add(fresh)])
            boxes = numpy.concatenate([boxes[20:], fresh])
    assert changes > 7 and len(known) > 200
    assert len(boxset) == 800 and boxset.stats().pairs == len(known)


def test_pairs_include_box_with_id_zero_in_every_mode():
    for count in (2, 100, 3000):
        boxes = numpy.zeros((count, 6), numpy.float32)
        boxes[:, 0] = boxes[:, 3] = 2 * numpy.arange(count)
        boxes[0, 3] = 2 * count
        boxes[:, 4:] = 1
        assert cullet.overlapping_pairs(boxes).tolist() == [[0, i] for i in range(1, count)]


def test_any_strides_and_layouts_give_the_same_pairs(random):
    boxes = random_boxes(random, 400)
    expected = pairs_by_comparing_all(numpy.arange(400), boxes)
    assert len(expected) > 100
    table = numpy.full((400, 9), numpy.nan, numpy.float32)
    table[:, 2:8] = boxes
    backward = numpy.ascontiguousarray(boxes[::-1])[::-1]
    read_only = boxes.copy()
    read_only.flags.writeable = False
    joined = numpy.stack([boxes[:, :3], boxes[:, 3:]])
    for view in (
        boxes,
        boxes.astype(numpy.float64),
        table[:, 2:8],
        numpy.asfortranarray(boxes),
        backward,
        read_only,
        (boxes[:, :3], boxes[:, 3:]),
        (joined[0].astype(numpy.float64), joined[1]),
        boxes.tolist(),
    ):
        assert numpy.array_equal(cullet.overlapping_pairs(view), expected)


def test_any_dlpack_producer_is_read(random):
    class Producer:
        """An array that is only known by DLPack, as PyTorch's and JAX's."""

        def __init__(self, array):
            self.array = array

        def __dlpack__(self, **options):
            return self.array.__dlpack__(**options)

        def __dlpack_device__(self):
            return self.array.__dlpack_device__()

    boxes = random_boxes(random, 200)
    boxset = cullet.BoxSet()
    ids = boxset.add(Producer(boxes))
    boxset.move(Producer(ids), Producer(boxes))
    assert numpy.array_equal(boxset.update().added, cullet.overlapping_pairs(boxes))


class Tensor(ctypes.Structure):
    """DLManagedTensor of DLPack."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("device_type", ctypes.c_int32),
        ("device_id", ctypes.c_int32),
        ("ndim", ctypes.c_int32),
        ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8),
        ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("byte_offset", ctypes.c_uint64),
        ("context", ctypes.c_void_p),
        ("deleter", ctypes.c_void_p),
    ]


class DeviceArray:
    """Says that 2 x 6 floats lie on a device: whoever reads them reads address 8."""

    def __init__(self, device_type):
        self.shape = (ctypes.c_int64 * 2)(2, 6)
        self.tensor = Tensor(8, device_type, 0, 2, 2, 32, 1, self.shape, None, 0, None, None)

    def __dlpack__(self, **options):
        new = ctypes.pythonapi.PyCapsule_New
        new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
        return new(ctypes.addressof(self.tensor), b"dltensor", None)

    def __dlpack_device__(self):
        return self.tensor.device_type, 0


@pytest.mark.parametrize("device_type", [2, 4, 10], ids=["cuda", "opencl", "rocm"])
def test_arrays_on_a_device_are_refused_unread(device_type):
    boxset = cullet.BoxSet()
    with pytest.raises(ValueError, match="boxes: the array is on a device"):
        boxset.add(DeviceArray(device_type))
    with pytest.raises(ValueError, match="poses_a: the array is on a device"):
        hull = cullet.Hull([[0, 0, 0]])
        cullet.hull_overlap(hull, hull, DeviceArray(device_type))
    assert len(boxset) == 0


def test_doubles_are_rounded_outward_and_inverted_ones_stay_empty():
    third = 1.0 / 3.0
    touching = numpy.array([[0, 0, 0, third, 1, 1], [third, 0, 0, 1, 1, 1]])
    assert len(cullet.overlapping_pairs(touching)) == 1
    # As floats the box would be one point, not an inverted box.
    inverted = numpy.array([[0, 0, 0, 1, 1, 1], [0.5 + 1e-12, 0, 0, 0.5, 1, 1]])
    assert numpy.float32(inverted[1, 0]) == numpy.float32(0.5)
    assert len(cullet.overlapping_pairs(inverted)) == 0


def test_boxes_without_volume_nan_and_infinite_boxes():
    inf, nan = numpy.inf, numpy.nan
    boxes = numpy.array(
        [[0, 0, 0, 1, 1, 1], [1, 1, 1, 1, 1, 1], [nan, 0, 0, 1, 1, 1], [1, 0, 0, 0, 1, 1], [-inf, -inf, -inf, inf, inf, inf]],
        numpy.float32,
    )
    assert cullet.overlapping_pairs(boxes).tolist() == [[0, 1], [0, 4], [1, 4]]


def test_margin_keeps_pairs_and_filters_refuse_them():
    boxes = numpy.array([[0, 0, 0, 1, 1, 1], [1, 0, 0, 2, 1, 1]], numpy.float32)
    boxset = cullet.BoxSet(margin=0.25)
    ids = boxset.add(boxes)
    assert boxset.update().added.tolist() == [[0, 1]]
    for gap, count in ((0.5, 1), (0.625, 0), (0.5, 0)):
        boxset.move(ids[1:], numpy.array([[1 + gap, 0, 0, 2, 1, 1]], numpy.float32))
        boxset.update()
        assert len(boxset.pairs()) == count, gap
    boxset.set_filters(ids, [1, 2], [1, 1])
    boxset.move(ids, boxes)
    assert len(boxset.update().added) == 0
    boxset.set_filters(ids[:1], [1], [-1])
    assert len(boxset.update().added) == 1


def test_arrays_live_longer_than_the_set_and_keep_their_values(random):
    boxes = random_boxes(random, 500)
    boxset = cullet.BoxSet()
    boxset.add(boxes)
    added, pairs = boxset.update().added, boxset.pairs()
    before = added.copy()
    boxset.move(numpy.arange(500), boxes + 100 * numpy.arange(500, dtype=numpy.float32)[:, None])
    assert len(boxset.update().removed) == len(before)
    del boxset
    gc.collect()
    cullet.overlapping_pairs(random_boxes(random, 500))
    assert numpy.array_equal(added, before) and numpy.array_equal(pairs, before)
    added[0] = 7  # the caller's own memory


def test_threads_share_a_set(random):
    """Each thread moves its own boxes and updates; whoever is last leaves the set as it should be."""
    boxes = random_boxes(random, 800)
    boxset = cullet.BoxSet(threads=1)
    ids = boxset.add(boxes)
    shifts = random.uniform(-3, 3, (4, 200, 3)).astype(numpy.float32)

    def work(part):
        mine = slice(200 * part, 200 * (part + 1))
        for step in range(25):
            boxset.move(ids[mine], boxes[mine] + numpy.tile(shifts[part] * (step % 5), 2))
            boxset.update()

    threads = [threading.Thread(target=work, args=(part,)) for part in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    boxset.update()
    last = boxes + numpy.tile(shifts.reshape(800, 3) * 4, 2)
    assert numpy.array_equal(boxset.pairs(), pairs_by_comparing_all(ids, last))


def test_other_threads_run_during_an_update(random):
    """With the GIL held, the other thread would not count before the update is over."""
    boxes = random_boxes(random, 200_000)
    boxes[:, :3] *= 8
    boxes[:, 3:] = boxes[:, :3] + 1
    boxset = cullet.BoxSet(threads=1)
    boxset.add(boxes)
    counts, is_over = [], threading.Event()

    def count():
        number = 0
        while not is_over.is_set():
            number += 1
            counts.append(number)
            is_over.wait(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = len(counts)
    boxset.update()
    during = len(counts) - before
    is_over.set()
    thread.join()
    assert during >= 5


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda s, b: s.add(b[:, :5]), ValueError, r"boxes: shape \(n,6\) expected, not \(4,5\)"),
        (lambda s, b: s.add(b[0]), ValueError, r"not \(6,\)"),
        (lambda s, b: s.add((b[:, :3], b[:3, 3:])), ValueError, "as many rows"),
        (lambda s, b: s.add((b[:, :3],)), ValueError, "tuple of min and max"),
        (lambda s, b: s.add(b.astype(numpy.float16)), ValueError, "float32 or float64"),
        (lambda s, b: s.add(b.astype(numpy.int64)), ValueError, "float32 or float64"),
        (lambda s, b: s.move([0, 1], b), ValueError, "as many as boxes"),
        (lambda s, b: s.move([0, 1, 2, 9], b), KeyError, "no box with id 9"),
        (lambda s, b: s.move(numpy.array([0.5, 1, 2, 3]), b), ValueError, "whole numbers"),
        (lambda s, b: s.move([0, 1, 2, -1], b), ValueError, "-1 is out of range"),
        (lambda s, b: s.move([0, 1, 2, 2**32], b), ValueError, "out of range"),
        (lambda s, b: s.remove([1, 1]), KeyError, "twice"),
        (lambda s, b: s.remove([[1]]), ValueError, r"shape \(n,\)"),
        (lambda s, b: s.set_filters([0, 1], [1], [1, 1]), ValueError, "as many as ids"),
        (lambda s, b: s.set_filters([0], [1], [2**40]), ValueError, "out of range"),
        (lambda s, b: cullet.BoxSet(backend="octree"), ValueError, "grid"),
        (lambda s, b: cullet.BoxSet(threads=-1), ValueError, "threads"),
        (lambda s, b: cullet.BoxSet(margin=-1), ValueError, "margin"),
        (lambda s, b: cullet.BoxSet(margin=numpy.nan), ValueError, "margin"),
        (lambda s, b: cullet.BoxSet(margin=numpy.inf), ValueError, "margin"),
    ],
)
def test_wrong_input_raises_and_changes_nothing(call, error, words):
    boxes = numpy.tile(numpy.array([[0, 0, 0, 1, 1, 1]], numpy.float32), (4, 1))
    boxset = cullet.BoxSet()
    boxset.add(boxes)
    boxset.update()
    with pytest.raises(error, match=words):
        call(boxset, boxes)
    assert len(boxset) == 4
    assert [len(array) for array in boxset.update()] == [0, 0]


def test_empty_arrays_are_no_boxes():
    boxset = cullet.BoxSet()
    none = numpy.empty((0, 6), numpy.float32)
    ids = boxset.add(none)
    assert ids.shape == (0,) and ids.dtype == numpy.uint32
    boxset.move(ids, none)
    boxset.remove(ids)
    assert boxset.update().added.shape == (0, 2)
    assert cullet.overlapping_pairs(none).shape == (0, 2)
