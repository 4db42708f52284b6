#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Times the Python package beside Coal and python-fcl, on one thread, and compares their answers.

usage: rivals.py [--pairs N] [--boxes N] [--rounds N] [--csv FILE]
       needs `pip install . coal python-fcl scipy`

Hulls: each library measures the same pairs of hulls in the same poses. Coal and python-fcl take a pair per call, with poses
that were made before; cullet takes arrays, poses included, in one call and, as `cullet-single`, in a call per pair. Nobody
remembers anything from pair to pair. Boxes: in each frame a fifth of the boxes moves, and the pairs come back to Python; of Coal
their number.

All take turns, round by round; times are CPU times of the process. Answers must agree, or the program ends with 1.
"""

import argparse
import csv
import pathlib
import subprocess
import sys
import time
import zlib

import coal
import fcl
import numpy
from scipy.spatial import ConvexHull

import cullet

#: Of a distance between hulls of radius 1: the default tolerance of Coal's and FCL's searches.
TOLERANCE = 1e-6


def triangles_of(points):
    """Vertices of the hull and its faces, counter-clockwise from outside."""
    vertices = points[ConvexHull(points).vertices]
    hull = ConvexHull(vertices)
    faces = hull.simplices.copy()
    for face, normal in zip(faces, hull.equations[:, :3]):
        a, b, c = vertices[face]
        if numpy.cross(b - a, c - a) @ normal < 0:
            face[1], face[2] = face[2], face[1]
    return vertices, faces


def coal_hull(vertices, faces):
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in vertices:
        points.append(vertex)
    for face in faces.tolist():
        triangles.append(coal.Triangle(*face))
    return coal.Convex(points, triangles)


def fcl_hull(vertices, faces):
    return fcl.Convex(vertices, len(faces), numpy.insert(faces, 0, 3, axis=1).ravel())


def rotations_of(poses):
    x, y, z, w = (poses[:, 3:] / numpy.linalg.norm(poses[:, 3:], axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return numpy.moveaxis(numpy.array(rows), 2, 0)


class HullScene:
    """Pairs of hulls of so many points on a unit sphere; of 8 points 30 % overlap, of 64 points 66 %."""

    def __init__(self, random, pairs, points):
        directions = random.normal(size=(40, points, 3))
        clouds = directions / numpy.linalg.norm(directions, axis=2)[:, :, None]
        shapes = [triangles_of(cloud) for cloud in clouds]
        choice = random.integers(0, 40, (2, pairs))
        poses = numpy.concatenate([random.uniform(-1.25, 1.25, (2, pairs, 3)), random.normal(size=(2, pairs, 4))], axis=2)
        self.poses = poses
        hulls = [cullet.Hull(vertices) for vertices, _ in shapes]
        self.cullet = [[hulls[i] for i in side] for side in choice]
        coals, fcls = [coal_hull(*s) for s in shapes], [fcl_hull(*s) for s in shapes]
        self.coal, self.fcl = [], []
        for side, places in zip(choice, poses):
            turns = rotations_of(places)
            self.coal.append([(coals[i], coal.Transform3s(turn, place[:3])) for i, turn, place in zip(side, turns, places)])
            self.fcl.append(
                [fcl.CollisionObject(fcls[i], fcl.Transform(turn, place[:3])) for i, turn, place in zip(side, turns, places)]
            )


def cullet_batch(query):
    return lambda scene: query(*scene.cullet, *scene.poses, threads=1)


def cullet_single(query):
    def run(scene):
        return numpy.array([query(a, b, p, q, threads=1).distances[0] for a, b, p, q in zip(*scene.cullet, *scene.poses)])

    return run


def cullet_single_overlap(scene):
    found = [cullet.hull_overlap(a, b, p, q, threads=1).states[0] for a, b, p, q in zip(*scene.cullet, *scene.poses)]
    return numpy.array(found) == cullet.State.OVERLAPPING


def coal_overlap(scene):
    request, result, found = coal.CollisionRequest(), coal.CollisionResult(), []
    request.enable_contact = False
    for (a, at), (b, bt) in zip(*scene.coal):
        result.clear()
        found.append(coal.collide(a, at, b, bt, request, result) > 0)
    return numpy.array(found)


def coal_distance(is_signed):
    def run(scene):
        request, found = coal.DistanceRequest(), []
        request.enable_signed_distance = is_signed
        result = coal.DistanceResult()
        for (a, at), (b, bt) in zip(*scene.coal):
            result.clear()
            found.append(coal.distance(a, at, b, bt, request, result))
        return numpy.array(found)

    return run


def fcl_overlap(scene):
    request = fcl.CollisionRequest()
    return numpy.array([fcl.collide(a, b, request, fcl.CollisionResult()) > 0 for a, b in zip(*scene.fcl)])


def fcl_distance(scene):
    request = fcl.DistanceRequest(enable_nearest_points=True)
    return numpy.array([fcl.distance(a, b, request, fcl.DistanceResult()) for a, b in zip(*scene.fcl)])


#: Query -> name -> function of a scene. python-fcl has no depth without contacts.
HULL_QUERIES = {
    "overlap": {
        "cullet": cullet_batch(cullet.hull_overlap),
        "cullet-single": cullet_single_overlap,
        "coal": coal_overlap,
        "fcl": fcl_overlap,
    },
    "distance": {
        "cullet": cullet_batch(cullet.hull_distance),
        "cullet-single": cullet_single(cullet.hull_distance),
        "coal": coal_distance(False),
        "fcl": fcl_distance,
    },
    "contact": {
        "cullet": cullet_batch(cullet.hull_contact),
        "cullet-single": cullet_single(cullet.hull_contact),
        "coal": coal_distance(True),
    },
}


def differences_of(query, answer, truth):
    """Of each pair, from cullet's signed distance: how wrong the answer is. Either answer is right where hulls touch."""
    if query == "overlap":
        overlaps = answer.overlapping if hasattr(answer, "overlapping") else answer
        return numpy.where(overlaps == (truth <= 0), 0, numpy.abs(truth))
    distances = answer.distances if hasattr(answer, "distances") else answer
    if query == "distance":
        return numpy.abs(numpy.maximum(distances, 0) - numpy.maximum(truth, 0))
    return numpy.abs(distances - truth)


class BoxScene:
    """Boxes of which a fifth moves in each frame, 6 neighbours each or so."""

    def __init__(self, random, count):
        self.size = numpy.float32(1)
        extent = (count * 8 / 6) ** (1 / 3)
        self.low = random.uniform(0, extent, (count, 3)).astype(numpy.float32)
        self.random = random

    def step(self):
        count = len(self.low)
        self.rows = self.random.choice(count, count // 5, replace=False)
        self.low[self.rows] += self.random.uniform(-0.3, 0.3, (count // 5, 3)).astype(numpy.float32)

    def boxes(self, rows=slice(None)):
        return numpy.concatenate([self.low[rows], self.low[rows] + self.size], axis=1)


class CulletBoxes:
    def __init__(self, scene):
        self.set = cullet.BoxSet(threads=1)
        self.ids = self.set.add(scene.boxes())
        self.set.update()

    def frame(self, scene):
        self.set.move(self.ids[scene.rows], scene.boxes(scene.rows))
        self.set.update()
        return self.set.pairs()


class ManagerBoxes:
    """A dynamic tree of Coal's or python-fcl's."""

    def __init__(self, scene):
        self.objects = [self.make(low.astype(float) + 0.5) for low in scene.low]
        self.manager = self.library.DynamicAABBTreeCollisionManager()
        for item in self.objects:
            self.manager.registerObject(item)
        self.manager.setup()

    def frame(self, scene):
        for row, centre in zip(scene.rows.tolist(), scene.low[scene.rows].astype(float) + 0.5):
            self.move(self.objects[row], centre)
        return self.pairs()


class CoalBoxes(ManagerBoxes):
    library = coal

    def __init__(self, scene):
        super().__init__(scene)
        self.rows = {item: row for row, item in enumerate(self.objects)}

    def make(self, centre):
        return coal.CollisionObject(coal.Box(1, 1, 1), numpy.eye(3), centre)

    def move(self, item, centre):
        item.setTranslation(centre)
        item.computeAABB()

    def pairs(self):
        """Of the callback only their number: its objects come back to Python without a name."""
        self.manager.update()
        collect = coal.CollisionCallBackCollect(1_000_000)
        collect.init()
        self.manager.collide(collect)
        return collect.numCollisionPairs()


class FclBoxes(ManagerBoxes):
    library = fcl

    def make(self, centre):
        return fcl.CollisionObject(fcl.Box(1, 1, 1), fcl.Transform(numpy.eye(3), centre))

    def move(self, item, centre):
        item.setTranslation(centre)
        self.manager.update(item)

    def pairs(self):
        found = []

        def collect(a, b, data):
            found.append((a, b))
            return False

        self.manager.collide(None, collect)
        return len(found)


def exact_pairs(boxes):
    """Sort along x, then compare each box with its 1st, 2nd, ... successor while any overlaps on x."""
    order = numpy.argsort(boxes[:, 0], kind="stable")
    low, high = boxes[order, :3], boxes[order, 3:]
    found = []
    for step in range(1, len(boxes)):
        near = low[step:, 0] <= high[:-step, 0]
        if not near.any():
            break
        hit = numpy.flatnonzero(near & numpy.all((low[step:] <= high[:-step]) & (low[:-step] <= high[step:]), axis=1))
        found.append(numpy.sort(numpy.stack((order[hit], order[hit + step]), axis=1), axis=1))
    pairs = numpy.concatenate(found)
    return pairs[numpy.lexsort((pairs[:, 1], pairs[:, 0]))]


def take_turns(runs, rounds, before_each=lambda: None):
    """Milliseconds of CPU of each run in each round, and their last answers; the first round is not counted."""
    times, answers = {name: [] for name in runs}, {}
    for _ in range(rounds + 1):
        before_each()
        for name, run in runs.items():
            start = time.process_time()
            answers[name] = run()
            times[name].append(1e3 * (time.process_time() - start))
    return {name: row[1:] for name, row in times.items()}, answers


def rows_of(times, **columns):
    for name, row in times.items():
        yield {
            **columns,
            "backend": name,
            "median_ms": float(numpy.median(row)),
            "p90_ms": float(numpy.percentile(row, 90)),
            "min_ms": min(row),
            "ratio_to_cullet": float(numpy.median(numpy.array(row) / numpy.array(times["cullet"]))),
        }


def measure_hulls(arguments):
    for points in (8, 64):
        scene = HullScene(numpy.random.default_rng(points), arguments.pairs, points)
        truth = cullet.hull_contact(*scene.cullet, *scene.poses, threads=1).distances
        assert 0.15 < (truth < 0).mean() < 0.85
        for query, runs in HULL_QUERIES.items():
            times, answers = take_turns({name: lambda run=run: run(scene) for name, run in runs.items()}, arguments.rounds)
            columns = {"benchmark": "python.hulls", "scene": f"{query}-{points}", "bodies": 40, "pairs": arguments.pairs}
            for row in rows_of(times, **columns):
                wrong = differences_of(query, answers[row["backend"]], truth)
                states = numpy.packbits(truth <= 0).tobytes()
                yield {
                    **row,
                    "hash": f"{zlib.crc32(states):08x}",
                    "max_difference": float(wrong.max()),
                    "wrong_checks": int((wrong > TOLERANCE).sum()),
                }


def measure_boxes(arguments):
    scene = BoxScene(numpy.random.default_rng(1), arguments.boxes)
    backends = {"cullet": CulletBoxes(scene), "coal": CoalBoxes(scene), "fcl": FclBoxes(scene)}
    times, answers = take_turns({n: lambda b=b: b.frame(scene) for n, b in backends.items()}, arguments.rounds, scene.step)
    pairs = exact_pairs(scene.boxes())
    columns = {"benchmark": "python.boxes", "scene": "fifth-moves", "bodies": arguments.boxes, "pairs": len(pairs)}
    for row in rows_of(times, **columns):
        answer = answers[row["backend"]]
        # Centres in double round boxes that touch one way or the other.
        wrong = not numpy.array_equal(answer, pairs) if row["backend"] == "cullet" else abs(answer - len(pairs)) > 2
        fingerprint = zlib.crc32(pairs.astype(numpy.uint32).tobytes())
        yield {**row, "hash": f"{fingerprint:08x}", "max_difference": 0, "wrong_checks": int(wrong)}


def machine():
    """The columns that are the same in every row."""
    lines = open("/proc/cpuinfo").read().splitlines()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")] or ["unknown"]
    folder = str(pathlib.Path(__file__).parent)
    describe = ["git", "-C", folder, "describe", "--always", "--dirty", "--abbrev=40"]
    commit = subprocess.run(describe, capture_output=True, text=True)
    versions = f"python {sys.version.split()[0]}, numpy {numpy.__version__}, coal {coal.__version__}, python-fcl {fcl.__version__}"
    return {
        "precision": "double",
        "threads": 1,
        "cpu": names[0],
        "gpu": "",
        "commit": commit.stdout.strip(),
        "machine": f"{names[0]}, {len(names)} cores, {versions}",
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=2000)
    parser.add_argument("--boxes", type=int, default=5000)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--csv")
    arguments = parser.parse_args()
    rows = []
    for row in [*measure_hulls(arguments), *measure_boxes(arguments)]:
        rows.append({**row, **machine()})
        each = 1e3 * row["median_ms"] / row["pairs"] if "hulls" in row["benchmark"] else row["median_ms"]
        unit = "us a pair" if "hulls" in row["benchmark"] else "ms a frame"
        print(
            f"{row['scene']:14} {row['backend']:14} {each:9.2f} {unit}, {row['ratio_to_cullet']:7.2f} times cullet, "
            f"differs by {row['max_difference']:.1e}{'  WRONG' if row['wrong_checks'] else ''}"
        )
    if arguments.csv:
        with open(arguments.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    return 1 if any(row["wrong_checks"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
