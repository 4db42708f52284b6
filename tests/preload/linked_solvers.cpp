// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The program of plain_solvers.cpp with a cullet::Solver: the reference for the preloaded library. The arguments are the
// model, and the number of towers.

#include "cullet/plugin/solver.h"
#include "cullet/tests/preload/solver_scene.h"

#include <cstdlib>
#include <string>

int main(int, char** arguments)
{
    cullet::SolverOptions options;
    if (arguments[1] == std::string("soft"))
        options.model = cullet::SolverModel::Soft;
    cullet::Solver solver(options);
    cullet::test::SolverWorldParts parts;
    btDiscreteDynamicsWorld world(&parts.dispatcher, &parts.broadphase, &solver, &parts.configuration);
    cullet::test::runScene(world, std::atoi(arguments[2]));
}
