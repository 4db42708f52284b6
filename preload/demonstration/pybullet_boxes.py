# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Boxes that fall onto a floor in PyBullet, which has Bullet linked into it statically."""

import hashlib
import struct

import pybullet

pybullet.connect(pybullet.DIRECT)
pybullet.setGravity(0, 0, -10)
floor = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[20, 20, 0.5])
pybullet.createMultiBody(0, floor, basePosition=[0, 0, -0.5])
box = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.25] * 3)
boxes = [pybullet.createMultiBody(1, box, basePosition=[0.9 * (i % 8), 0.9 * (i // 8 % 8), 0.4 + 0.7 * (i // 64)])
         for i in range(128)]
for _ in range(480):
    pybullet.stepSimulation()
places = [pybullet.getBasePositionAndOrientation(i)[0] for i in boxes]
print("hash", hashlib.sha256(b"".join(struct.pack("3d", *place) for place in places)).hexdigest()[:16])
for place in places:
    print("at %.9f %.9f %.9f" % place)
