#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""Which grasps of a part in a bin leave room for the gripper? Thousands of candidates at once.

A gripper of three hulls stands at each candidate pose, among the hulls of a bin. A BoxSet finds the few pairs that may be near,
one call of hull_contact() measures them. Lengths are metres. Ends with 1 if the boxes have lost a pair.
"""

import sys

import numpy

import cullet

CLEARANCE = 0.005
CANDIDATES = 4000


def box_hull(size, centre=(0, 0, 0)):
    corners = numpy.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return cullet.Hull(corners * size + centre)


def make_bin(random):
    """A floor, and parts that lie on it."""
    hulls = [box_hull((1.0, 1.0, 0.02), (0, 0, -0.01))]
    poses = [[0, 0, 0, 0, 0, 0, 1]]
    for _ in range(60):
        hulls.append(cullet.Hull(random.uniform(-0.03, 0.03, (20, 3))))
        poses.append([*random.uniform(-0.4, 0.4, 2), 0.03, *random.normal(size=4)])
    return hulls, numpy.array(poses)


def make_candidates(random, target):
    """The gripper points down, turned about z and tilted a little, its tips around the part."""
    turn, tilt = random.uniform(0, 2 * numpy.pi, CANDIDATES), random.normal(0, 0.2, CANDIDATES)
    poses = numpy.zeros((CANDIDATES, 7))
    poses[:, :3] = target + random.normal(0, 0.02, (CANDIDATES, 3))
    # About z, after a tilt about x.
    poses[:, 3:] = numpy.stack(
        [
            numpy.cos(turn / 2) * numpy.sin(tilt / 2),
            numpy.sin(turn / 2) * numpy.sin(tilt / 2),
            numpy.sin(turn / 2) * numpy.cos(tilt / 2),
            numpy.cos(turn / 2) * numpy.cos(tilt / 2),
        ],
        axis=1,
    )
    return poses


def bounds_of(hulls, poses, margin):
    """Boxes around spheres around hulls: cheap, and large enough."""
    centres = numpy.array([hull.vertices.mean(axis=0) for hull in hulls])
    radii = numpy.array([numpy.linalg.norm(hull.vertices - c, axis=1).max() for hull, c in zip(hulls, centres)])
    q = poses[:, 3:6] / numpy.linalg.norm(poses[:, 3:], axis=1)[:, None]
    w = poses[:, 6:] / numpy.linalg.norm(poses[:, 3:], axis=1)[:, None]
    across = 2 * numpy.cross(q, centres)
    world = poses[:, :3] + centres + w * across + numpy.cross(q, across)
    reach = radii[:, None] + margin
    return numpy.concatenate([world - reach, world + reach], axis=1)


def near_pairs(scene, boxes):
    """Rows of bodies and of the scene whose boxes overlap. The gripper's boxes go from candidate to candidate."""
    boxset = cullet.BoxSet(threads=1)
    statics = boxset.add(scene)
    moving = boxset.add(boxes[0])
    # Parts do not pair with each other, nor do the gripper's hulls.
    boxset.set_filters(statics, numpy.full(len(statics), 1), numpy.full(len(statics), 2))
    boxset.set_filters(moving, numpy.full(len(moving), 2), numpy.full(len(moving), 1))
    found = []
    for candidate, places in enumerate(boxes):
        boxset.move(moving, places)
        boxset.update()
        pairs = boxset.pairs().astype(numpy.int64)
        found.append(numpy.stack([pairs[:, 1] - moving[0] + candidate * len(moving), pairs[:, 0]], axis=1))
    return numpy.concatenate(found)


def main():
    random = numpy.random.default_rng(1)
    scene, scene_poses = make_bin(random)
    gripper = [
        box_hull((0.10, 0.03, 0.04), (0, 0, 0.10)),
        box_hull((0.01, 0.02, 0.10), (-0.045, 0, 0.05)),
        box_hull((0.01, 0.02, 0.10), (0.045, 0, 0.05)),
    ]
    candidates = make_candidates(random, scene_poses[1, :3])
    # Body 3 i + k is hull k of the gripper at candidate i.
    hulls, poses = gripper * CANDIDATES, numpy.repeat(candidates, len(gripper), axis=0)
    boxes = bounds_of(hulls, poses, 0.0).reshape(CANDIDATES, len(gripper), 6)
    near = near_pairs(bounds_of(scene, scene_poses, CLEARANCE), boxes)

    contact = cullet.hull_contact(hulls, scene, poses, scene_poses, pairs=near, max_distance=CLEARANCE)
    too_near = contact.states != cullet.State.SEPARATED
    has_room = numpy.ones(CANDIDATES, bool)
    has_room[near[too_near, 0] // len(gripper)] = False
    asked, possible = len(near), len(hulls) * len(scene)
    print(f"{possible} pairs of hulls, {asked} with boxes that overlap, {too_near.sum()} nearer than {1000 * CLEARANCE:g} mm")
    deepest = -1000 * contact.distances.min()
    print(f"{has_room.sum()} of {CANDIDATES} grasps have room; the deepest of the others is {deepest:.1f} mm inside")

    everything = numpy.stack(numpy.meshgrid(range(300), range(len(scene)), indexing="ij"), axis=-1).reshape(-1, 2)
    exact = cullet.hull_contact(hulls, scene, poses, scene_poses, pairs=everything, max_distance=CLEARANCE)
    lost = numpy.ones(100, bool)
    lost[everything[exact.states != cullet.State.SEPARATED, 0] // len(gripper)] = False
    return 0 if numpy.array_equal(lost, has_room[:100]) and 0 < has_room.sum() < CANDIDATES else 1


if __name__ == "__main__":
    sys.exit(main())
