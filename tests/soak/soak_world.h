// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/solver_options.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

/// Worlds that are made, churned and destroyed, each from a seed of its own.
namespace cullet::test
{
/// What bodies and joints do at rest, each the mean of a world.
enum RestError
{
    Creep,   ///< way of a body in the last second, m
    Energy,  ///< of a body, J
    Depth,   ///< of the contact points, m
    Pivot    ///< distance of the pivots of a ball joint, m
};
using RestErrors = std::array<double, 4>;  ///< [RestError]

/// The rests of worlds with a model of Solver.
struct SoakRests
{
    std::uint64_t count = 0;
    RestErrors sum{}, most{};

    void add(const RestErrors& rest) { add({1, rest, rest}); }
    void add(const SoakRests& other)
    {
        count += other.count;
        for (std::size_t i = 0; i < sum.size(); ++i)
        {
            sum[i] += other.sum[i];
            most[i] = std::max(most[i], other.most[i]);
        }
    }
    double mean(std::size_t error) const { return count > 0 ? sum[error] / double(count) : 0; }
};

/// What the worlds of a thread have done so far.
struct SoakCounts
{
    std::uint64_t worlds = 0, steps = 0;
    std::uint64_t checkedSteps = 0;    ///< those with brute force beside
    std::uint64_t comparedBoxes = 0;   ///< pairs of boxes that brute force compared
    std::uint64_t pairs = 0;           ///< pairs in the caches of those steps
    std::uint64_t contacts = 0;        ///< points that were examined
    std::uint64_t hulls = 0;           ///< hull shapes made and destroyed
    std::uint64_t recordedFrames = 0;  ///< read back from recordings
    std::uint64_t twins = 0;           ///< worlds that ran a second time in other circumstances
    std::uint64_t solverSteps = 0;     ///< of the steps, those with cullet::Solver
    std::uint64_t longestLife = 0;     ///< steps for which a body has been in such a world
    std::uint64_t joints = 0, brokenJoints = 0;
    SoakRests rests[2];  ///< [SolverModel], those that were examined

    void add(const SoakCounts& other)
    {
        worlds += other.worlds;
        steps += other.steps;
        checkedSteps += other.checkedSteps;
        comparedBoxes += other.comparedBoxes;
        pairs += other.pairs;
        contacts += other.contacts;
        hulls += other.hulls;
        recordedFrames += other.recordedFrames;
        twins += other.twins;
        solverSteps += other.solverSteps;
        longestLife = std::max(longestLife, other.longestLife);
        joints += other.joints;
        brokenJoints += other.brokenJoints;
        for (std::size_t model = 0; model < 2; ++model)
            rests[model].add(other.rests[model]);
    }
};

/// Faults that the soak makes on purpose, to show that it finds them.
enum class SoakMistake
{
    None,
    Leak,      ///< 100 bytes in each step
    LostPair,  ///< brute force sees one pair more in the 40th checked step of a world
    Creep,     ///< bodies at rest are moved half as far again as one rest may creep
    Drift      ///< they are moved half as far again as the mean of many rests may
};

/// How a world is run; it changes nothing that can be seen.
struct SoakCircumstances
{
    std::uint32_t seed = 0;  ///< chooses backends and numbers of threads
    SoakMistake mistake = SoakMistake::None;
    bool isLargest = false;  ///< as many bodies as any world has, and cullet::Dispatcher; changes the world
};

class SoakFault : public std::runtime_error
{
public:
    SoakFault(int step, const std::string& what)
        : std::runtime_error("step " + std::to_string(step) + ": " + what)
    {
    }
};

/// Boxes in a broad phase, without a world. Throws SoakFault.
void soakBoxes(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts);

/// Bodies in a world of Bullet's or in World, with one of the narrow phases. Throws SoakFault.
///
/// @return hash of all places and pairs, which the circumstances do not change
std::uint64_t soakBodies(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts);

/// Bodies and joints in a world with Solver, which fall and come to rest once. Throws SoakFault.
///
/// @return hash of all places, which the circumstances do not change
std::uint64_t soakSolver(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts);

/// One such world of 200 bodies, which fall and come to rest again and again: most of them live on after three of four rests,
/// and are thrown about anew. Throws SoakFault.
///
/// @param goesOn asked after a rest when the world is empty
void soakOneSolver(SolverModel model, std::uint32_t seed, const SoakCircumstances& circumstances,
                   SoakCounts& counts, const std::function<bool()>& goesOn);

/// What is wrong with the means of many rests with a model, if anything; of few rests nothing is.
std::string faultOfRests(SolverModel model, const SoakRests& rests);
}  // namespace cullet::test
