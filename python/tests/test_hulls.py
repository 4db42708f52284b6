# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

import gc
import threading

import numpy
import pytest
from conftest import CUBE, matrices_of, placed, random_hulls, random_poses
from scipy.optimize import linprog, minimize
from scipy.spatial import ConvexHull

import cullet
from cullet import State

QUERIES = [cullet.hull_overlap, cullet.hull_distance, cullet.hull_penetration, cullet.hull_contact]


def have_common_point(a, b):
    """By linear programming: weights of the points of both hulls that give one point."""
    count = len(a) + len(b)
    equal = numpy.zeros((5, count))
    equal[:3, : len(a)], equal[:3, len(a) :] = a.T, -b.T
    equal[3, : len(a)] = equal[4, len(a) :] = 1
    return linprog(numpy.zeros(count), A_eq=equal, b_eq=[0, 0, 0, 1, 1], bounds=(0, None)).status == 0


def depth_of(a, b):
    """Of the faces of the Minkowski difference, by SciPy's hull of all differences: the closest to the origin."""
    return -ConvexHull((a[:, None] - b[None]).reshape(-1, 3)).equations[:, 3].max()


def distance_of(a, b):
    """By quadratic programming over the weights of the points of both hulls."""
    matrix = numpy.concatenate([a, -b])
    sums = [
        {"type": "eq", "fun": lambda w: w[: len(a)].sum() - 1, "jac": lambda w: numpy.r_[numpy.ones(len(a)), numpy.zeros(len(b))]},
        {"type": "eq", "fun": lambda w: w[len(a) :].sum() - 1, "jac": lambda w: numpy.r_[numpy.zeros(len(a)), numpy.ones(len(b))]},
    ]
    start = numpy.r_[numpy.full(len(a), 1 / len(a)), numpy.full(len(b), 1 / len(b))]
    found = minimize(
        lambda w: (w @ matrix) @ (w @ matrix),
        start,
        jac=lambda w: 2 * matrix @ (w @ matrix),
        bounds=[(0, None)] * len(start),
        constraints=sums,
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return numpy.sqrt(found.fun)


@pytest.fixture
def scene(random):
    """Hulls, poses as quaternions and matrices, and the points in the world, of a and b."""
    hulls = random_hulls(random, 40), random_hulls(random, 40)
    poses = random_poses(random, 40, 1.6), random_poses(random, 40, 1.6)
    world = [[placed(h.vertices, m) for h, m in zip(side, matrices_of(p))] for side, p in zip(hulls, poses)]
    return hulls, poses, world


def test_contacts_equal_linear_programming_quadratic_programming_and_qhull(scene):
    (a, b), (poses_a, poses_b), (world_a, world_b) = scene
    results = cullet.hull_contact(a, b, poses_a, poses_b)
    overlapping = [have_common_point(p, q) for p, q in zip(world_a, world_b)]
    assert 5 < sum(overlapping) < 35
    for i, (p, q) in enumerate(zip(world_a, world_b)):
        if overlapping[i]:
            assert results.states[i] == State.OVERLAPPING
            assert results.distances[i] == pytest.approx(-depth_of(p, q), abs=1e-6)
        else:
            assert results.states[i] == State.NEAR
            # SciPy's answer is an upper bound, and the axis proves a lower one.
            bound = distance_of(p, q)
            assert bound - 1e-4 <= results.distances[i] <= bound + 1e-9
            gap = (p @ results.axes[i]).min() - (q @ results.axes[i]).max()
            assert gap == pytest.approx(results.distances[i], abs=1e-9)
        assert results.points_a[i] - results.points_b[i] == pytest.approx(results.distances[i] * results.axes[i], abs=1e-9)
        assert numpy.linalg.norm(results.axes[i]) == pytest.approx(1)


def test_queries_agree_with_each_other(scene):
    (a, b), (poses_a, poses_b), (world_a, world_b) = scene
    contact = cullet.hull_contact(a, b, poses_a, poses_b)
    overlap = cullet.hull_overlap(a, b, poses_a, poses_b)
    distance = cullet.hull_distance(a, b, poses_a, poses_b)
    depth = cullet.hull_penetration(a, b, poses_a, poses_b)
    assert numpy.array_equal(contact.overlapping, overlap.overlapping)
    for i in range(40):
        if overlap.overlapping[i]:
            assert distance.distances[i] == 0 and not overlap.axes[i].any()
            assert depth.distances[i] == pytest.approx(contact.distances[i], abs=1e-9)
        else:
            assert overlap.states[i] == depth.states[i] == State.SEPARATED
            assert distance.distances[i] == contact.distances[i] and depth.distances[i] == 0
            assert (world_a[i] @ overlap.axes[i]).min() > (world_b[i] @ overlap.axes[i]).max()


def test_cubes_have_known_distances_and_depths():
    cube = cullet.Hull(CUBE)
    poses = [[x, 0.25, 0, 0, 0, 0, 1] for x in (5.0, 2.5, 1.5)]
    results = cullet.hull_contact(cube, cube, poses, None, max_distance=1)
    assert results.states.tolist() == [State.SEPARATED, State.NEAR, State.OVERLAPPING]
    assert results.distances == pytest.approx([0, 0.5, -0.5], abs=1e-12)
    assert results.axes == pytest.approx(numpy.tile([1.0, 0, 0], (3, 1)), abs=1e-12)
    assert results.points_a[1:, 0] == pytest.approx([1.5, 0.5]) and results.points_b[1:, 0] == pytest.approx([1, 1])
    assert not results.points_a[0].any()


@pytest.mark.parametrize("query", QUERIES)
def test_quaternions_matrices_and_layouts_are_the_same_poses(scene, query):
    (a, b), (poses_a, poses_b), _ = scene
    expected = query(a, b, poses_a, poses_b)
    matrices = matrices_of(poses_a)
    wide = numpy.zeros((40, 9))
    wide[:, 1:8] = poses_a
    longer = poses_a.copy()
    longer[:, 3:] *= 2
    by_columns = matrices.transpose(0, 2, 1).copy().transpose(0, 2, 1)
    for same in (wide[:, 1:8], numpy.asfortranarray(poses_a), longer, matrices, by_columns):
        results = query(a, b, same, poses_b)
        assert numpy.array_equal(results.states, expected.states)
        if query is not cullet.hull_overlap:
            assert results.distances == pytest.approx(expected.distances, abs=1e-9)
    single = query(a, b, poses_a.astype(numpy.float32), poses_b.astype(numpy.float32))
    assert (single.states == expected.states).sum() >= 38


@pytest.mark.parametrize("query", QUERIES)
def test_results_are_the_same_bits_for_any_threads_and_order(random, query):
    hulls = random_hulls(random, 30)
    poses = random_poses(random, 30, 2)
    pairs = random.integers(0, 30, (5000, 2))
    expected = query(hulls, hulls, poses, poses, pairs=pairs, threads=1)
    assert 500 < expected.overlapping.sum() < 4500
    for threads, order in ((4, slice(None)), (0, slice(None, None, -1))):
        again = query(hulls, hulls, poses, poses, pairs=pairs[order], threads=threads)
        for before, after in zip(expected, again):
            assert before[order].tobytes() == after.tobytes()


@pytest.mark.parametrize("dtype", [numpy.int32, numpy.int64, numpy.uint32, numpy.uint64])
def test_pairs_of_any_whole_numbers_name_rows(random, dtype):
    hulls, poses = random_hulls(random, 8), random_poses(random, 8, 1)
    pairs = numpy.array([[0, 1], [7, 3], [2, 2]], dtype)
    results = cullet.hull_distance(hulls, hulls, poses, poses, pairs=pairs)
    for row, (i, j) in enumerate(pairs.tolist()):
        alone = cullet.hull_distance(hulls[i], hulls[j], poses[i], poses[j])
        assert all(numpy.array_equal(whole[row], one[0]) for whole, one in zip(results, alone))


def test_pairs_of_a_box_set_are_rows_of_bodies(random):
    hulls, poses = random_hulls(random, 50), random_poses(random, 50, 4)
    world = [placed(h.vertices, m) for h, m in zip(hulls, matrices_of(poses))]
    boxes = numpy.array([numpy.r_[p.min(axis=0), p.max(axis=0)] for p in world])
    everything = numpy.argwhere(numpy.triu(numpy.ones((50, 50), bool), 1))
    all_hits = everything[cullet.hull_overlap(hulls, hulls, poses, poses, pairs=everything).overlapping]
    pairs = cullet.overlapping_pairs(boxes)
    hits = pairs[cullet.hull_overlap(hulls, hulls, poses, poses, pairs=pairs).overlapping]
    assert 0 < len(hits) < len(pairs) < len(everything)
    assert numpy.array_equal(hits, all_hits)


def test_one_body_stands_for_all(random):
    hulls, poses = random_hulls(random, 5), random_poses(random, 5)
    for one, many in (
        (cullet.hull_distance(hulls[0], hulls, None, poses), cullet.hull_distance(hulls[:1] * 5, hulls, None, poses)),
        (cullet.hull_distance(hulls, hulls[1], poses), cullet.hull_distance(hulls, hulls[1:2] * 5, poses)),
        (cullet.hull_distance(hulls[2], hulls[1], poses), cullet.hull_distance(hulls[2:3] * 5, hulls[1:2] * 5, poses)),
        (cullet.hull_distance(hulls, hulls, poses[0]), cullet.hull_distance(hulls, hulls, poses[[0] * 5])),
    ):
        assert len(one.states) == 5
        assert all(numpy.array_equal(x, y) for x, y in zip(one, many))


def test_points_segments_and_triangles_are_hulls():
    flat = numpy.array([[3.0, 0, 0], [3, 1, 0], [3, 0, 1]], numpy.float32)
    hulls = [cullet.Hull(flat[:count]) for count in (1, 2, 3)]
    assert [hull.vertex_count for hull in hulls] == [1, 2, 3]
    assert cullet.hull_distance(hulls, cullet.Hull(CUBE)).distances.tolist() == [2, 2, 2]


def test_pair_beyond_double_precision_has_a_state_and_others_their_answers():
    cube = cullet.Hull(CUBE)
    poses = numpy.tile(numpy.eye(4), (2, 1, 1))
    poses[0, :3, :3] *= 1e100
    poses[0, :3, 3] = 1e300
    poses[1, 0, 3] = 3
    results = cullet.hull_contact(cube, cube, poses)
    assert results.states.tolist() == [State.NOT_CONVERGED, State.NEAR]
    assert results.distances.tolist() == [0, 1] and not results.overlapping.any()


def test_arrays_live_longer_than_hulls(random):
    hulls = random_hulls(random, 20)
    vertices = hulls[3].vertices
    results = cullet.hull_contact(hulls, hulls[0], random_poses(random, 20))
    before = vertices.copy(), results.points_a.copy()
    del hulls
    gc.collect()
    random_hulls(random, 20)
    assert numpy.array_equal(vertices, before[0]) and numpy.array_equal(results.points_a, before[1])


def test_hulls_live_during_a_query_that_has_the_only_references(random):
    class Vanishing(list):
        """Forgets what it hands out."""

        def __iter__(self):
            while self:
                yield self.pop(0)

    poses = random_poses(random, 200)
    hulls = random_hulls(random, 200)
    expected = cullet.hull_contact(hulls, hulls[0], poses)
    vanishing = Vanishing([cullet.Hull(hull.vertices) for hull in hulls])
    results = cullet.hull_contact(vanishing, hulls[0], poses)
    assert not vanishing
    assert results.distances == pytest.approx(expected.distances, abs=1e-9)


def test_threads_query_the_same_hulls(random):
    hulls, poses = random_hulls(random, 40), random_poses(random, 40)
    pairs = random.integers(0, 40, (2000, 2))
    expected = cullet.hull_contact(hulls, hulls, poses, poses, pairs=pairs, threads=1)
    found = [None] * 4

    def work(part):
        found[part] = cullet.hull_contact(hulls, hulls, poses, poses, pairs=pairs, threads=1 + part)

    threads = [threading.Thread(target=work, args=(part,)) for part in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for results in found:
        assert all(numpy.array_equal(x, y) for x, y in zip(results, expected))


CUBE_HULL = cullet.Hull(CUBE)
UPSIDE_DOWN = numpy.diag([1.0, 1, 1, 2])
FLAT = numpy.diag([1.0, 1, 0, 1])
FAR = numpy.array([numpy.inf, 0, 0, 0, 0, 0, 1])


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda: cullet.Hull(CUBE[:, :2]), ValueError, r"points: shape \(n,3\) expected, not \(8,2\)"),
        (lambda: cullet.Hull(CUBE[:0]), ValueError, "1 to 2"),
        (lambda: cullet.Hull(CUBE * numpy.nan), ValueError, "not finite"),
        (lambda: cullet.Hull(CUBE * 1e61), ValueError, "1e60"),
        (lambda: cullet.Hull(CUBE.astype(int)), ValueError, "float32 or float64"),
        (lambda: cullet.hull_overlap(CUBE, CUBE_HULL), TypeError, "a: a Hull"),
        (lambda: cullet.hull_overlap(CUBE_HULL, [None]), TypeError, "b: a Hull"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, numpy.zeros((2, 6))), ValueError, "poses_a: shape"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, None, numpy.zeros((2, 2, 7))), ValueError, "poses_b: shape"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, numpy.zeros(7)), ValueError, "quaternion is zero"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, numpy.full(7, numpy.nan)), ValueError, "quaternion"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, FAR), ValueError, "pose is not finite"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, UPSIDE_DOWN), ValueError, "last row"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, FLAT), ValueError, "inverted"),
        (lambda: cullet.hull_overlap([CUBE_HULL] * 3, CUBE_HULL, numpy.zeros((2, 7)) + 1), ValueError, "as many as hulls"),
        (lambda: cullet.hull_overlap([CUBE_HULL] * 3, [CUBE_HULL] * 2), ValueError, "as many bodies"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, pairs=[[0, 1]]), ValueError, "a body that is not there"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, pairs=[[0, -1]]), ValueError, "out of range"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, pairs=[0, 0]), ValueError, r"shape \(n,2\)"),
        (lambda: cullet.hull_distance(CUBE_HULL, CUBE_HULL, max_distance=-1), ValueError, "max_distance"),
        (lambda: cullet.hull_contact(CUBE_HULL, CUBE_HULL, max_distance=numpy.nan), ValueError, "max_distance"),
        (lambda: cullet.hull_overlap(CUBE_HULL, CUBE_HULL, threads=5000), ValueError, "threads"),
    ],
)
def test_wrong_input_raises(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_no_bodies_and_no_pairs_give_empty_arrays():
    assert cullet.hull_contact([], []).points_a.shape == (0, 3)
    results = cullet.hull_overlap(CUBE_HULL, CUBE_HULL, pairs=numpy.empty((0, 2), int))
    assert results.states.shape == (0,) and results.axes.shape == (0, 3)
