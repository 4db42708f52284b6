# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Cubes that fall onto a floor and each other in a simulation of Siconos with its Bullet collision manager."""

import hashlib
import os
import tempfile

import h5py
import siconos.kernel as kernel
import siconos.numerics as numerics
from siconos.io.mechanics_run import MechanicsHdf5Runner
from siconos.mechanics.collision.bullet import SiconosBulletOptions
from siconos.mechanics.collision.tools import Contactor


def describe(path):
    corners = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    with MechanicsHdf5Runner(io_filename=path) as scene:
        scene.add_convex_shape("Cube", corners)
        scene.add_primitive_shape("Floor", "Box", (100, 100, 0.5))
        scene.add_Newton_impact_friction_nsl("contact", mu=0.3)
        for i in range(36):
            scene.add_object(
                "cube%d" % i, [Contactor("Cube")], mass=1, velocity=[0] * 6,
                translation=[3.0 * (i % 6), 3.0 * (i // 6 % 3), 1.3 + 2.4 * (i // 18)])
        scene.add_object("floor", [Contactor("Floor")], translation=[0, 0, -0.25])


def run(path):
    solver = kernel.solver_options_create(numerics.SICONOS_FRICTION_3D_NSGS)
    solver.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = 1000
    solver.dparam[numerics.SICONOS_DPARAM_TOL] = 1e-8
    bullet = SiconosBulletOptions()
    bullet.worldScale = 1.0
    bullet.contactBreakingThreshold = 0.04
    bullet.perturbationIterations = 0
    bullet.minimumPointsPerturbationThreshold = 0
    with MechanicsHdf5Runner(mode="r+", io_filename=path) as scene:
        scene.run(t0=0, T=1.5, h=0.005, theta=0.50001, Newton_max_iter=1, solver_options=solver,
                  bullet_options=bullet, verbose=False, output_frequency=None)


def report(path):
    with h5py.File(path, "r") as file:
        rows = file["data"]["dynamic"][:]
        contacts = len(file["data"]["cf"])
    last = rows[rows[:, 0] == rows[-1, 0]]
    print("contacts", contacts)
    print("hash", hashlib.sha256(last.tobytes()).hexdigest()[:16])
    for row in last:
        print("at %.9f %.9f %.9f" % tuple(row[2:5]))


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    describe("cubes.hdf5")
    run("cubes.hdf5")
    report("cubes.hdf5")
