#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""A roadmap for a planar arm among obstacles: all states of all edges are checked in one call.

States are joint angles. An edge is checked at steps along it; each state places the links, a BoxSet finds the pairs whose
boxes overlap, and one call of hull_overlap() tests those of all states. The shortest path is then measured with
hull_distance(). Ends with 1 if there is no path, or one that touches.
"""

import heapq
import sys

import numpy

import cullet

LINKS, LENGTH = 4, 0.5
STATES, NEIGHBOURS, STEPS = 500, 10, 12


def bar():
    """A link from the origin along x."""
    corners = [[x, y, z] for x in (0, LENGTH) for y in (-0.04, 0.04) for z in (-0.04, 0.04)]
    return cullet.Hull(corners)


def poses_of(angles):
    """Poses of the links of all states, (states * LINKS, 7)."""
    turn = numpy.cumsum(angles, axis=1)
    ends = LENGTH * numpy.cumsum(numpy.stack([numpy.cos(turn), numpy.sin(turn)], axis=2), axis=1)
    poses = numpy.zeros((*angles.shape, 7))
    poses[:, 1:, :2] = ends[:, :-1]
    poses[..., 5], poses[..., 6] = numpy.sin(turn / 2), numpy.cos(turn / 2)
    return poses.reshape(-1, 7)


class Checker:
    """Obstacles, and which states of the arm are free of them."""

    def __init__(self, random):
        self.link = bar()
        self.obstacles = [cullet.Hull(random.uniform(-0.2, 0.2, (12, 3))) for _ in range(25)]
        self.places = numpy.zeros((25, 7))
        self.places[:, 6] = 1
        angle = random.uniform(0, 2 * numpy.pi, 25)
        radius = random.uniform(0.9, 2.0, 25)
        self.places[:, 0], self.places[:, 1] = radius * numpy.cos(angle), radius * numpy.sin(angle)
        reach = numpy.array([numpy.abs(hull.vertices).max(axis=0) for hull in self.obstacles])
        self.boxset = cullet.BoxSet(threads=1)
        statics = self.boxset.add((self.places[:, :3] - reach, self.places[:, :3] + reach))
        self.links = self.boxset.add(numpy.zeros((LINKS, 6)))
        # Obstacles do not pair with each other, nor do links.
        self.boxset.set_filters(statics, [1] * len(statics), [2] * len(statics))
        self.boxset.set_filters(self.links, [2] * LINKS, [1] * LINKS)

    def near_pairs(self, poses):
        """Rows of links and obstacles whose boxes overlap, one update for each state."""
        axis = numpy.stack([1 - 2 * poses[:, 5] ** 2, 2 * poses[:, 5] * poses[:, 6]], axis=1)
        ends = numpy.zeros((len(poses), 3))
        ends[:, :2] = LENGTH * axis
        low, high = numpy.minimum(0, ends) - 0.06, numpy.maximum(0, ends) + 0.06
        boxes = numpy.concatenate([poses[:, :3] + low, poses[:, :3] + high], axis=1).reshape(-1, LINKS, 6)
        found = []
        for state, places in enumerate(boxes):
            self.boxset.move(self.links, places)
            self.boxset.update()
            pairs = self.boxset.pairs().astype(numpy.int64)
            found.append(numpy.stack([pairs[:, 1] - self.links[0] + state * LINKS, pairs[:, 0]], axis=1))
        return numpy.concatenate(found)

    def are_free(self, angles):
        poses = poses_of(angles)
        pairs = self.near_pairs(poses)
        hits = cullet.hull_overlap([self.link] * len(poses), self.obstacles, poses, self.places, pairs=pairs)
        free = numpy.ones(len(angles), bool)
        free[pairs[hits.states != cullet.State.SEPARATED, 0] // LINKS] = False
        return free

    def clearance(self, angles):
        """Smallest distance of each state."""
        poses = poses_of(angles)
        everything = numpy.argwhere(numpy.ones((len(poses), len(self.obstacles)), bool))
        found = cullet.hull_distance([self.link] * len(poses), self.obstacles, poses, self.places, pairs=everything)
        return found.distances.reshape(len(angles), -1).min(axis=1)


def roadmap(checker, random, start, goal):
    """States that are free, and the edges between near ones that are: rows and lengths."""
    sampled = random.uniform(-2.2, 2.2, (STATES, LINKS))
    states = numpy.concatenate([[start, goal], sampled[checker.are_free(sampled)]])
    distance = numpy.linalg.norm(states[:, None] - states[None], axis=2)
    nearest = numpy.argsort(distance, axis=1)[:, 1 : NEIGHBOURS + 1]
    edges = numpy.stack([numpy.repeat(numpy.arange(len(states)), NEIGHBOURS), nearest.ravel()], axis=1)
    along = numpy.linspace(0, 1, STEPS)[None, :, None]
    between = states[edges[:, 0], None] * (1 - along) + states[edges[:, 1], None] * along
    free = checker.are_free(between.reshape(-1, LINKS)).reshape(-1, STEPS).all(axis=1)
    print(f"{len(edges)} edges, {between.shape[0] * STEPS * LINKS} links placed, {free.sum()} edges are free")
    return states, edges[free], distance


def shortest_path(count, edges, distance):
    """Dijkstra's, from state 0 to state 1; None if there is none."""
    neighbours = [[] for _ in range(count)]
    for i, j in edges.tolist():
        neighbours[i].append(j)
        neighbours[j].append(i)
    queue, before = [(0.0, 0, -1)], {}
    while queue:
        length, state, last = heapq.heappop(queue)
        if state in before:
            continue
        before[state] = last
        if state == 1:
            path = [1]
            while before[path[-1]] >= 0:
                path.append(before[path[-1]])
            return path[::-1]
        for other in neighbours[state]:
            heapq.heappush(queue, (length + distance[state, other], other, state))
    return None


def main():
    random = numpy.random.default_rng(5)
    checker = Checker(random)
    ends = random.uniform(-2.2, 2.2, (200, LINKS))
    ends = ends[checker.are_free(ends)]
    # Far apart, so that the path goes around something.
    start, goal = ends[0], ends[numpy.argmax(numpy.linalg.norm(ends - ends[0], axis=1))]
    states, edges, distance = roadmap(checker, random, start, goal)
    path = shortest_path(len(states), edges, distance)
    if path is None:
        print("no path")
        return 1
    clearance = checker.clearance(states[path]).min()
    print(f"a path of {len(path)} states; they come as near as {100 * clearance:.1f} cm")
    return 0 if clearance > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
