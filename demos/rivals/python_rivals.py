#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Times the broad phases of Newton and Warp on a recording of boxes (docs/recording-format.md), and compares their pairs.

usage: python_rivals.py RECORDING [--frames N] [--device cpu|cuda:0] [--csv FILE]
       needs `pip install newton warp-lang numpy`; a recording comes from e.g.
       demos/run record --scene W1 --bodies 16000 --frames 10 --out w1.cbx

Timed is what a user pays in a frame: the boxes from an array of numpy to the device, the search, and the pairs back in an
array of numpy. The pairs of the last frame are compared with those of a sort and sweep in numpy.
"""
import argparse
import csv
import struct
import sys
import time
import zlib

import numpy as np

HEAD_BYTES = 48
END_OF_FRAME = 6


def events(data):
    """The events of the blocks as bytes, one block after the other."""
    at = HEAD_BYTES
    while at < len(data):
        mark, _, length, checksum = struct.unpack_from("<4sIII", data, at)
        packed = data[at + 16:at + 16 + length]
        if mark != b"CBLK" or zlib.crc32(data[at:at + 12] + packed) != checksum:
            sys.exit("python_rivals.py: the recording is damaged")
        yield zlib.decompress(packed)
        at += 16 + length


def frames(path):
    """Boxes [count, 6] of each frame, for recordings in which no body goes."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89CBX\r\n\x1a\n" or data[8] != 1 or data[16] != 4:
        sys.exit("python_rivals.py: not a recording of version 1 with float boxes")
    bits = np.zeros((struct.unpack_from("<I", data, 36)[0], 6), np.uint32)
    last = 0xFFFFFFFF
    for block in events(data):
        at = 0
        while at < len(block):
            kind = block[at]
            at += 1
            if kind == END_OF_FRAME:
                last = 0xFFFFFFFF
                yield bits.view(np.float32).copy()
                continue
            if kind not in (1, 3, 4):
                sys.exit("python_rivals.py: the recording has more than boxes that come and move")
            last = (last + 1 + struct.unpack_from("<I", block, at)[0]) & 0xFFFFFFFF
            at += 12 if kind == 1 else 4
            if kind != 4:
                bits[last] ^= np.frombuffer(block, np.uint32, 6, at)
                at += 24


def split_mix(state):
    """The mixer of demos/scenes/splitmix64.h."""
    with np.errstate(over="ignore"):
        value = state + np.uint64(0x9E3779B97F4A7C15)
        value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return value ^ (value >> np.uint64(31))


def digest(pairs):
    """Count, and the hash of `bench broad`."""
    low, high = pairs.min(axis=1).astype(np.uint64), pairs.max(axis=1).astype(np.uint64)
    with np.errstate(over="ignore"):
        return len(pairs), int(np.sum(split_mix(low << np.uint64(32) | high), dtype=np.uint64))


def exact_pairs(boxes):
    """Sort along x, then compare each box with its 1st, 2nd, ... successor while any overlaps on x."""
    order = np.argsort(boxes[:, 0], kind="stable")
    low, high = boxes[order, :3], boxes[order, 3:]
    found = []
    for step in range(1, len(boxes)):
        near = low[step:, 0] <= high[:-step, 0]
        if not near.any():
            break
        hit = np.flatnonzero(near & np.all((low[step:] <= high[:-step]) & (low[:-step] <= high[step:]), axis=1))
        found.append(np.stack((order[hit], order[hit + step]), axis=1))
    return np.concatenate(found) if found else np.zeros((0, 2), np.int64)


def makers(count, device):
    """Name and function from boxes to pairs, of each broad phase."""
    import newton
    import warp as wp

    room = 16 * count
    lower, upper = (wp.zeros(count, dtype=wp.vec3, device=device) for _ in range(2))
    pairs, total = wp.zeros(room, dtype=wp.vec2i, device=device), wp.zeros(1, dtype=wp.int32, device=device)
    groups, world = (wp.array(np.full(count, value, np.int32), device=device) for value in (1, 0))

    def hand_over(boxes):
        lower.assign(np.ascontiguousarray(boxes[:, :3]))
        upper.assign(np.ascontiguousarray(boxes[:, 3:]))
        total.zero_()

    def take():
        return pairs.numpy()[:total.numpy()[0]]

    def by_newton(search):
        def find(boxes):
            hand_over(boxes)
            search.launch(lower, upper, None, groups, world, count, pairs, total, device=device)
            return take()
        return find

    @wp.kernel
    def query(tree: wp.uint64, lows: wp.array(dtype=wp.vec3), highs: wp.array(dtype=wp.vec3),
              out: wp.array(dtype=wp.vec2i), counter: wp.array(dtype=wp.int32)):
        row = wp.tid()
        hits = wp.bvh_query_aabb(tree, lows[row], highs[row])
        other = int(0)
        while wp.bvh_query_next(hits, other):
            if row < other:
                place = wp.atomic_add(counter, 0, 1)
                if place < out.shape[0]:
                    out[place] = wp.vec2i(row, other)

    def by_bvh(boxes):
        hand_over(boxes)
        tree = wp.Bvh(lower, upper)
        wp.launch(query, dim=count, inputs=[tree.id, lower, upper, pairs, total], device=device)
        return take()

    worlds = np.zeros(count, np.int32)
    yield "newton-sap", by_newton(newton.geometry.BroadPhaseSAP(worlds, device=device))
    if count <= 5000:
        yield "newton-allpairs", by_newton(newton.geometry.BroadPhaseAllPairs(worlds, device=device))
    yield "warp-bvh", by_bvh


def measure(boxes, device):
    """A row per broad phase; the first frame compiles and does not count."""
    clock = time.process_time if device == "cpu" else time.perf_counter
    expected = digest(exact_pairs(boxes[-1]))
    for name, find in makers(len(boxes[0]), device):
        times = []
        for frame in boxes:
            start = clock()
            found = find(frame)
            times.append(1e3 * (clock() - start))
        count, fingerprint = digest(found)
        median = float(np.median(times[1:]))
        wrong = (count, fingerprint) != expected
        print(f"{name:16} {len(boxes[0]):8} bodies {count:9} pairs  median {median:10.3f} ms{'  WRONG PAIRS' if wrong else ''}")
        yield {"benchmark": "broad.update", "backend": name, "device": device, "bodies": len(boxes[0]), "pairs": count,
               "median_ms": median, "p90_ms": float(np.percentile(times[1:], 90)), "min_ms": min(times[1:]),
               "hash": f"{fingerprint:016x}", "frames": len(times) - 1, "wrong_checks": int(wrong)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording")
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--csv")
    arguments = parser.parse_args()
    boxes = []
    for frame in frames(arguments.recording):
        boxes.append(frame)
        if len(boxes) == arguments.frames:
            break
    if len(boxes) < 2:
        sys.exit("python_rivals.py: at least two frames are needed")
    rows = list(measure(boxes, arguments.device))
    if arguments.csv:
        with open(arguments.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
