# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Scenes that several tests use. Each random test prints its seed by its name."""

import numpy
import pytest

import cullet


def random_boxes(random, count, dtype=numpy.float32):
    low = random.uniform(0, 12, (count, 3))
    return numpy.concatenate([low, low + random.uniform(0.1, 2, (count, 3))], axis=1).astype(dtype)


def random_hulls(random, count):
    return [cullet.Hull(random.normal(size=(random.integers(4, 40), 3))) for _ in range(count)]


def random_poses(random, count, spread=3.0):
    """Positions and quaternions."""
    return numpy.concatenate([random.uniform(-spread, spread, (count, 3)), random.normal(size=(count, 4))], axis=1)


def matrices_of(poses):
    """Homogeneous matrices, by the textbook's formula."""
    matrices = numpy.zeros((len(poses), 4, 4))
    for matrix, (px, py, pz, *q) in zip(matrices, poses):
        x, y, z, w = q / numpy.linalg.norm(q)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:, 3] = [px, py, pz, 1]
    return matrices


def placed(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def pairs_by_comparing_all(ids, boxes):
    """Sorted pairs of closed boxes; empty ones have none."""
    low, high = boxes[:, :3], boxes[:, 3:]
    overlap = numpy.all(low[:, None] <= high[None], axis=2)
    solid = numpy.all(low <= high, axis=1)
    overlap = overlap & overlap.T & solid[:, None] & solid[None]
    first, second = numpy.nonzero(numpy.triu(overlap, 1))
    return numpy.stack([numpy.asarray(ids)[first], numpy.asarray(ids)[second]], axis=1)


@pytest.fixture(params=[1, 2, 3])
def random(request):
    return numpy.random.default_rng(request.param)


CUBE = numpy.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
