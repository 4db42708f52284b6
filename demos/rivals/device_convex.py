#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Times the convex kernels of MuJoCo Warp and Newton on pairs of hulls, and compares their answers with cullet's.

usage: device_convex.py FILE... [--rivals mujoco,newton,newton-climb] [--device cuda:0] [--frames 30] [--csv OUT]
       needs `pip install mujoco-warp newton scipy`; a file comes from `cullet_convex_file` (demos/bench/narrow/convex_file.h)

Timed is a CUDA graph, by the device's events, with poses, hulls and pairs in device memory and the L2 cache flushed before
each run. "booleans" call the package's search for overlap alone, one thread a pair, in a kernel of this script; "contacts"
call its own narrow phase as its pipeline does, with a margin of 0. Iterations and tolerances are the packages' defaults.

Each pair is moved so that its first body is at the origin: nothing of the depth is lost in the float positions.

Columns: `overlapping` pairs, of which `missed` were not found, and `invented` ones; `points` of a pair that has a contact;
errors of the deepest contact against cullet's proved depth, in units of the size of a pair, and how many exceed 1e-4.
"""
import argparse
import csv
import os
import struct
import sys
import time

import numpy as np
import warp as wp

POSE = np.dtype([("position", "<f4", 3), ("hull", "<u4"), ("rotation", "<f4", 4)])
# Of a pair, at least. A depth of cullet's is proved to 1e-4 of it.
SIZE = 2.0
FLUSHED_BYTES = 256 << 20


def turned(rotation, vectors):
    """Vectors turned by unit quaternions x, y, z, w."""
    axis, real = rotation[:, :3], rotation[:, 3:]
    twice = 2.0 * np.cross(axis, vectors)
    return vectors + real * twice + np.cross(axis, twice)


def product(a, b):
    """Of quaternions x, y, z, w."""
    return np.concatenate((a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3]),
                           a[:, 3:] * b[:, 3:] - np.sum(a[:, :3] * b[:, :3], axis=1, keepdims=True)), axis=1)


class Pairs:
    """A file of cullet_convex_file: bodies 2 k and 2 k + 1 are pair k."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        mark, version, hulls, points, self.count = struct.unpack_from("<4sIIII", data)
        if mark != b"CXPR" or version != 1:
            sys.exit(f"device_convex.py: {path} is no file of pairs of version 1")
        at = 20
        starts = np.frombuffer(data, "<u4", hulls + 1, at)
        at += starts.nbytes
        corners = np.frombuffer(data, "<f4", 3 * points, at).reshape(-1, 3)
        at += corners.nbytes
        poses = np.frombuffer(data, POSE, 2 * self.count, at)
        self.depths = np.frombuffer(data, "<f4", self.count, at + poses.nbytes)
        self.hulls = [corners[first:end] for first, end in zip(starts[:-1], starts[1:])]
        self.hull = poses["hull"].astype(np.int32)
        rotations = poses["rotation"].astype(np.float64)
        self.rotations = rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
        self.positions = poses["position"].astype(np.float64)
        self.positions -= np.repeat(self.positions[::2], 2, axis=0)

    def overlaps(self):
        return self.depths > 0


class Subject:
    """A query of a rival: run() puts its work on the device's stream."""

    def __init__(self, name, query, note, run, answers):
        self.name, self.query, self.note, self.run, self.answers = name, query, note, run, answers


def deepest(pair, depth, count):
    """Contacts and the depth of the deepest one, of each pair."""
    depths = np.full(count, -np.inf)
    np.maximum.at(depths, pair, depth)
    return np.bincount(pair, minlength=count), depths


def candidates(count):
    """The list of pairs, in device memory."""
    return wp.array(np.arange(2 * count, dtype=np.int32).reshape(-1, 2), dtype=wp.vec2i)


def mujoco_model(pairs):
    """A model with a body for each hull; its compiler finds faces and neighbours."""
    import mujoco

    meshes = "".join(f'<mesh name="h{i}" vertex="{" ".join(f"{x:.9g}" for x in hull.ravel())}"/>'
                     for i, hull in enumerate(pairs.hulls))
    bodies = "".join(f'<body><freejoint/><geom type="mesh" mesh="h{i}"/></body>' for i in range(len(pairs.hulls)))
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><asset>{meshes}</asset><worldbody>{bodies}</worldbody></mujoco>")


def mujoco_poses(model, pairs):
    """Positions and matrices of the bodies' meshes, whose axes MuJoCo has put into their centres."""
    rotations = product(pairs.rotations, model.mesh_quat[pairs.hull][:, [1, 2, 3, 0]])
    positions = pairs.positions + turned(pairs.rotations, model.mesh_pos[pairs.hull])
    positions -= np.repeat(positions[::2], 2, axis=0)
    columns = [turned(rotations, np.broadcast_to(axis, positions.shape)) for axis in np.eye(3)]
    return positions, np.stack(columns, axis=2)


def spread(model, bodies):
    """Gives the model a geom for each body: rows of all arrays of geoms that the narrow phase reads."""
    for name in ("type", "condim", "priority", "dataid", "solmix", "solref", "solimp", "size", "friction", "margin", "gap",
                 "adhesion"):
        array = getattr(model, "geom_" + name)
        rows = np.take(array.numpy(), bodies, axis=0 if array.ndim == 1 else 1)
        setattr(model, "geom_" + name, wp.array(rows, dtype=array.dtype))


def mujoco_overlap():
    from mujoco_warp._src.collision_core import geom_collision_pair_from_types
    from mujoco_warp._src.collision_gjk import gjk_phase
    from mujoco_warp._src.types import GeomType

    mesh = int(GeomType.MESH)

    @wp.kernel(module="unique", enable_backward=False)
    def overlap(geom_dataid: wp.array2d[int], geom_size: wp.array2d[wp.vec3], vertadr: wp.array[int],
                vertnum: wp.array[int], graphadr: wp.array[int], vert: wp.array[wp.vec3], graph: wp.array[int],
                polynum: wp.array[int], polyadr: wp.array[int], polynormal: wp.array[wp.vec3],
                polyvertadr: wp.array[int], polyvertnum: wp.array[int], polyvert: wp.array[int],
                polymapadr: wp.array[int], polymapnum: wp.array[int], polymap: wp.array[int],
                positions: wp.array2d[wp.vec3], matrices: wp.array2d[wp.mat33], pairs: wp.array[wp.vec2i],
                tolerance: float, iterations: int, found: wp.array[wp.uint8]):
        row = wp.tid()
        a, b = geom_collision_pair_from_types(
            geom_dataid, geom_size, vertadr, vertnum, graphadr, vert, graph, polynum, polyadr, polynormal, polyvertadr,
            polyvertnum, polyvert, polymapadr, polymapnum, polymap, positions, matrices, mesh, mesh, pairs[row], 0)
        # A cutoff of 0 ends the search at the first axis that separates.
        is_hit, _distance, _count, _x1, _x2, _result, _a, _b = gjk_phase(
            tolerance, 0.0, iterations, a, b, mesh, mesh, a.pos, b.pos)
        found[row] = wp.uint8(is_hit)

    return overlap


MESH_TABLES = ("vertadr", "vertnum", "graphadr", "vert", "graph", "polynum", "polyadr", "polynormal", "polyvertadr",
               "polyvertnum", "polyvert", "polymapadr", "polymapnum", "polymap")


def mujoco_subjects(pairs):
    """Booleans in blocks of several sizes, then contacts with patches and of one point."""
    import mujoco_warp
    from mujoco_warp._src import collision_convex, collision_core
    from mujoco_warp._src.types import DisableBit, GeomType, OverflowType

    source = mujoco_model(pairs)
    positions, matrices = mujoco_poses(source, pairs)
    overlapping = int(pairs.overlaps().sum())
    # Room for candidates and for the points of contacts, then for polytopes, of a few too many pairs.
    room, polytopes = pairs.count + 4 * overlapping, overlapping + pairs.count // 50 + 64
    model = mujoco_warp.put_model(source)
    data = mujoco_warp.make_data(source, naconmax=room, naccdmax=polytopes, njmax=64)
    spread(model, pairs.hull)
    data.geom_xpos = wp.array(positions[None], dtype=wp.vec3)
    data.geom_xmat = wp.array(matrices[None], dtype=wp.mat33)
    data.ncollision.fill_(pairs.count)
    context = collision_core.create_collision_context(room)
    context.collision_pair = candidates(pairs.count)
    context.collision_pairid.fill_(-1)
    context.collision_worldid.zero_()
    found = wp.zeros(pairs.count, dtype=wp.uint8)
    overlap = mujoco_overlap()
    inputs = [model.geom_dataid, model.geom_size, *(getattr(model, "mesh_" + name) for name in MESH_TABLES),
              data.geom_xpos, data.geom_xmat, context.collision_pair, float(model.opt.ccd_tolerance.numpy()[0]),
              int(model.opt.ccd_iterations), found]

    def boolean(threads):
        return lambda: wp.launch(overlap, dim=pairs.count, inputs=inputs, block_dim=threads)

    def contacts(disabled):
        def run():
            model.opt.disableflags = disabled
            data.nacon.zero_()
            collision_convex.convex_narrowphase(model, data, context, [(GeomType.MESH, GeomType.MESH)])
        return run

    def answers():
        count = int(data.nacon.numpy()[0])
        if count > room or (data.overflow.numpy() & int(OverflowType.CCD)).any():
            sys.exit("device_convex.py: MuJoCo Warp has dropped contacts")
        return deepest(data.contact.geom.numpy()[:count, 0] // 2, -data.contact.dist.numpy()[:count], pairs.count)

    for threads in (64, 256):
        yield Subject("mujoco-warp", "booleans", f"gjk_phase, blocks of {threads}; climbs", boolean(threads), found.numpy)
    yield Subject("mujoco-warp", "contacts", "convex_narrowphase with multiccd; climbs", contacts(0), answers)
    yield Subject("mujoco-warp", "contacts", "convex_narrowphase, one point a pair; climbs",
                  contacts(int(DisableBit.MULTICCD)), answers)


def newton_model(pairs, climbs):
    """A model with a shape for each hull."""
    import newton
    from newton._src.sim import builder as build
    from scipy.spatial import ConvexHull

    # Newton scans all vertices of hulls with fewer than 256.
    build._CONVEX_SUPPORT_MIN_VERTICES = 1 if climbs else 256
    builder = newton.ModelBuilder()
    for hull in pairs.hulls:
        surface = ConvexHull(hull.astype(np.float64))
        inward = np.einsum("ij,ij->i", np.cross(hull[surface.simplices[:, 1]] - hull[surface.simplices[:, 0]],
                                                hull[surface.simplices[:, 2]] - hull[surface.simplices[:, 0]]),
                           surface.equations[:, :3]) < 0
        triangles = np.where(inward[:, None], surface.simplices[:, ::-1], surface.simplices).astype(np.int32)
        mesh = newton.Mesh(hull, triangles.ravel(), compute_inertia=False)
        builder.add_shape_convex_hull(-1, mesh=mesh)
    return builder.finalize()


def newton_shapes(model, pairs):
    """The arguments of a narrow phase that describe shapes: rows of the model's, and the poses."""
    bodies = 2 * pairs.count

    def rows(array):
        return wp.array(array.numpy()[pairs.hull], dtype=array.dtype)

    transforms = np.concatenate((pairs.positions, pairs.rotations), axis=1).astype(np.float32)
    return {
        "shape_types": rows(model.shape_type),
        "shape_data": wp.array(np.tile([1, 1, 1, 0], (bodies, 1)), dtype=wp.vec4),
        "shape_transform": wp.array(transforms, dtype=wp.transform),
        "shape_source": rows(model.shape_source_ptr),
        "shape_support_data": rows(model._shape_support_data),
        "support_lut": model._convex_support_lut,
        "support_vertex_offsets": model._convex_support_vertex_offsets,
        "support_neighbors": model._convex_support_neighbors,
        "shape_gap": wp.zeros(bodies, dtype=float),
        "shape_collision_radius": rows(model.shape_collision_radius),
        "shape_collision_aabb_lower": rows(model.shape_collision_aabb_lower),
        "shape_collision_aabb_upper": rows(model.shape_collision_aabb_upper),
    }


def newton_overlap(climbs, search):
    """A kernel of a thread a pair: overlap by the portal of MPR, or by GJK with a cutoff."""
    from newton._src.geometry import mpr, narrow_phase, simplex_solver, support_function

    support = support_function.support_map_lean_accelerated if climbs else support_function.support_map_lean
    provider_type = (support_function.AcceleratedSupportMapDataProvider if climbs
                     else support_function.SupportMapDataProvider)
    functions = mpr.create_support_map_function(support, use_precomputed_center=True)
    portal = mpr.create_solve_mpr(support, _support_funcs=functions).portal_core
    closest = simplex_solver.create_solve_closest_distance(support, _support_funcs=functions).core
    prepare = narrow_phase.create_prepare_convex_pair(False)
    by_portal = search == "mpr"

    @wp.kernel(module="unique", enable_backward=False)
    def overlap(pairs: wp.array[wp.vec2i], types: wp.array[int], data: wp.array[wp.vec4],
                transforms: wp.array[wp.transform], sources: wp.array[wp.uint64], support_data: wp.array[wp.vec4i],
                lut: wp.array[int], offsets: wp.array[int], neighbours: wp.array[int], gaps: wp.array[float],
                radii: wp.array[float], lower: wp.array[wp.vec3], upper: wp.array[wp.vec3], found: wp.array[wp.uint8]):
        row = wp.tid()
        _valid, query = prepare(pairs[row], types, data, transforms, sources, gaps, radii, lower, upper, lower, upper)
        provider = provider_type()
        provider.shape_support_data = support_data
        provider.support_neighbors = neighbours
        if wp.static(climbs):
            provider.support_lut = lut
            provider.support_vertex_offsets = offsets
        if wp.static(by_portal):
            is_hit, _a, _b, _normal, _depth, _seed, _is_valid = portal(
                query.geom_a, query.geom_b, query.relative_orientation_b, query.relative_position_b, 0.0, provider,
                wp.vec3(0.0))
            found[row] = wp.uint8(is_hit)
        else:
            is_apart, _a, _b, _normal, _distance = closest(
                query.geom_a, query.geom_b, query.relative_orientation_b, query.relative_position_b, 0.0, provider, 30,
                1.0e-4, 1.0e-6)
            found[row] = wp.uint8(not is_apart)

    return overlap


def newton_phase(pairs, climbs):
    """The narrow phase that Newton's pipeline makes for a world of so many hulls."""
    import newton

    return newton.geometry.NarrowPhase(
        max_candidate_pairs=pairs.count, reduce_contacts=False, has_meshes=False, use_lean_gjk_mpr=True,
        convex_support_acceleration=climbs, split_gjk_mpr=True, sparse_gjk_pairs=True, verify_buffers=False,
        contact_max=5 * pairs.count)


def newton_subjects(pairs, climbs):
    """Booleans by both searches, then contacts."""
    model = newton_model(pairs, climbs)
    shapes = newton_shapes(model, pairs)
    phase = newton_phase(pairs, climbs)
    bodies, room = 2 * pairs.count, 5 * pairs.count
    found = wp.zeros(pairs.count, dtype=wp.uint8)
    outputs = {
        "contact_pair": wp.zeros(room, dtype=wp.vec2i),
        "contact_position": wp.zeros(room, dtype=wp.vec3),
        "contact_normal": wp.zeros(room, dtype=wp.vec3),
        "contact_penetration": wp.zeros(room, dtype=float),
        "contact_count": wp.zeros(1, dtype=int),
    }
    others = {
        "candidate_pair": candidates(pairs.count),
        "candidate_pair_count": wp.array([pairs.count], dtype=int),
        "shape_sdf_index": wp.full(bodies, -1, dtype=int),
        "shape_flags": wp.array(model.shape_flags.numpy()[pairs.hull], dtype=int),
        "shape_voxel_resolution": wp.zeros(bodies, dtype=wp.vec3i),
    }

    def contacts():
        outputs["contact_count"].zero_()
        phase.launch(**shapes, **others, **outputs)

    def answers():
        count = int(outputs["contact_count"].numpy()[0])
        if count > room:
            sys.exit("device_convex.py: Newton has dropped contacts")
        return deepest(outputs["contact_pair"].numpy()[:count, 0] // 2, -outputs["contact_penetration"].numpy()[:count],
                       pairs.count)

    def boolean(search):
        overlap = newton_overlap(climbs, search)
        inputs = [others["candidate_pair"], *shapes.values(), found]
        return lambda: wp.launch(overlap, dim=pairs.count, inputs=inputs, block_dim=128)

    support = "climbs" if climbs else "scans all vertices"
    yield Subject("newton", "booleans", f"portal of MPR; {support}", boolean("mpr"), found.numpy)
    yield Subject("newton", "booleans", f"GJK with cutoff; {support}", boolean("gjk"), found.numpy)
    yield Subject("newton", "contacts", f"NarrowPhase, split MPR and GJK; {support}", contacts, answers)


RIVALS = {
    "mujoco": mujoco_subjects,
    "newton": lambda pairs: newton_subjects(pairs, False),
    "newton-climb": lambda pairs: newton_subjects(pairs, True),
}


def recorded(run):
    """A function that runs the work as a graph on a GPU, and as it is on a CPU."""
    if not wp.get_device().is_cuda:
        return run
    with wp.ScopedCapture(force_module_load=False) as capture:
        run()
    return lambda: wp.capture_launch(capture.graph)


def timed(run):
    """Milliseconds by the device's events, or of a CPU's time."""
    if not wp.get_device().is_cuda:
        start = time.process_time()
        run()
        return 1e3 * (time.process_time() - start)
    begin, end = (wp.Event(enable_timing=True) for _ in range(2))
    wp.record_event(begin)
    run()
    wp.record_event(end)
    wp.synchronize_device()
    return wp.get_event_elapsed_time(begin, end)


def milliseconds(run, frames):
    """Of each frame, the first three left out."""
    again = recorded(run)
    flushed = wp.zeros(FLUSHED_BYTES if wp.get_device().is_cuda else 1, dtype=wp.uint8)
    times = []
    for frame in range(frames + 3):
        flushed.fill_(frame)
        wp.synchronize_device()
        times.append(timed(again))
    return times[3:]


def quality(subject, pairs):
    """How the answers differ from cullet's: columns of the CSV file."""
    planted = pairs.overlaps()
    if subject.query == "booleans":
        hit = subject.answers() != 0
        columns = {"points": "", "error_median": "", "error_p99": "", "error_max": "", "errors_over_1e4": ""}
    else:
        points, depths = subject.answers()
        hit = points > 0
        both = hit & planted
        error = np.abs(depths[both] - pairs.depths[both]) / SIZE
        columns = {"points": points[hit].mean() if hit.any() else 0.0}
        for name, value in (("median", 50), ("p99", 99), ("max", 100)):
            columns["error_" + name] = np.percentile(error, value) if len(error) else ""
        columns["errors_over_1e4"] = int(np.count_nonzero(error > 1e-4))
    return {"overlapping": int(planted.sum()), "missed": int(np.count_nonzero(planted & ~hit)),
            "invented": int(np.count_nonzero(hit & ~planted)), **columns}


def measure(subject, pairs, frames):
    start = time.perf_counter()
    subject.run()
    wp.synchronize_device()
    first_s = time.perf_counter() - start
    times = milliseconds(subject.run, frames)
    row = {"benchmark": "rivals.convex", "method": subject.name, "query": subject.query, "pairs": pairs.count,
           "vertices": len(pairs.hulls[0]), "gpu_ms": np.median(times), "p90_ms": np.percentile(times, 90),
           "min_ms": min(times), "clock": "events" if wp.get_device().is_cuda else "cpu",
           **quality(subject, pairs), "note": subject.note, "gpu": wp.get_device().name}
    row = {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()}
    print(" ".join(f"{key} {value}" for key, value in row.items()), f"first run {first_s:.1f} s", flush=True)
    return row


def rows(arguments):
    for path in arguments.files:
        pairs = Pairs(path)
        for rival in arguments.rivals.split(","):
            with wp.ScopedDevice(arguments.device):
                for subject in RIVALS[rival](pairs):
                    yield measure(subject, pairs, arguments.frames)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--rivals", default=",".join(RIVALS))
    parser.add_argument("--device", default="cuda:0")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--csv")
    arguments = parser.parse_args()
    with open(arguments.csv or os.devnull, "w", newline="") as file:
        # Row by row, so that those before a rival's failure are kept.
        for row in rows(arguments):
            if file.tell() == 0:
                csv.writer(file).writerow(row)
            csv.writer(file).writerow(row.values())
            file.flush()


if __name__ == "__main__":
    main()
