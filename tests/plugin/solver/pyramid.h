// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/solver/solver_scene.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace cullet::test
{
/// How far the rows of a pyramid have sunk.
inline Measures pyramid(SolverScene& scene, int rows, int steps)
{
    scene.addFloor();
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    std::vector<std::pair<const btRigidBody*, int>> cubes;
    for (int row = 0; row < rows; ++row)
    {
        for (int i = 0; i < rows - row; ++i)
        {
            btRigidBody& body = scene.add(cube, 1, vec(1.05 * (i - 0.5 * (rows - row - 1)), 0.5 + row, 0));
            body.setActivationState(DISABLE_DEACTIVATION);
            cubes.emplace_back(&body, row);
        }
    }
    scene.step(steps);
    double most = 0, sum = 0;
    for (const auto& [body, row] : cubes)
    {
        const double sunk = 0.5 + row - heightOfBody(*body);
        most = std::max(most, sunk);
        sum += sunk / double(cubes.size());
    }
    return {notMore("most sunk", most, 0.03), notMore("mean sunk", sum, 0.01),
            notMore("energy of a body", scene.kineticEnergy() / double(cubes.size()), 0.01)};
}
}  // namespace cullet::test
