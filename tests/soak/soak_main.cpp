// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_soak: worlds from seeds, one after the other on several threads, with brute force beside, and an eye on memory.
#include "cullet/base/sanitizer.h"
#include "cullet/generated/commit.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/tests/soak/soak_memory.h"
#include "cullet/tests/soak/soak_world.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <malloc.h>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr const char* kUsage =
    "usage: cullet_soak [--minutes N] [--threads K] [--seed S]\n"
    "       cullet_soak --world SEED     one world again, as a failure prints it\n"
    "  --solver bullet|soft              one world of 200 bodies with this model of cullet::Solver, for all "
    "the time,\n"
    "                                    in each thread\n"
    "  --mistake leak|lost-pair|creep|drift\n"
    "                                    makes this mistake on purpose: the soak must fail\n";

struct Options
{
    double minutes = 1;
    unsigned threads = 1;
    std::uint32_t seed = 1;
    std::optional<std::uint32_t> world;
    std::optional<SolverModel> solver;
    SoakMistake mistake = SoakMistake::None;
};

[[noreturn]] void refuse()
{
    std::fputs(kUsage, stderr);
    std::exit(2);
}

SoakMistake mistakeOf(const std::string& name)
{
    if (name == "leak")
        return SoakMistake::Leak;
    if (name == "lost-pair")
        return SoakMistake::LostPair;
    if (name == "creep")
        return SoakMistake::Creep;
    if (name == "drift")
        return SoakMistake::Drift;
    refuse();
}

SolverModel modelOf(const std::string& name)
{
    if (name == "bullet")
        return SolverModel::Bullet;
    if (name == "soft")
        return SolverModel::Soft;
    refuse();
}

Options read(int count, char** arguments)
{
    Options options;
    for (int i = 1; i < count; i += 2)
    {
        const std::string name = arguments[i];
        if (i + 1 == count)
            refuse();
        const char* const value = arguments[i + 1];
        const auto number = static_cast<std::uint32_t>(std::strtoul(value, nullptr, 10));
        if (name == "--minutes")
            options.minutes = std::strtod(value, nullptr);
        else if (name == "--threads")
            options.threads = number;
        else if (name == "--seed")
            options.seed = number;
        else if (name == "--world")
            options.world = number;
        else if (name == "--solver")
            options.solver = modelOf(value);
        else if (name == "--mistake")
            options.mistake = mistakeOf(value);
        else
            refuse();
    }
    if (!(options.minutes > 0) || options.threads == 0)
        refuse();
    return options;
}

/// Spreads consecutive numbers (MurmurHash3's finaliser).
std::uint32_t seedOf(std::uint32_t seed, std::uint32_t world)
{
    std::uint32_t bits = seed * 0x9e3779b9u + world;
    bits = (bits ^ bits >> 16) * 0x85ebca6bu;
    bits = (bits ^ bits >> 13) * 0xc2b2ae35u;
    return bits ^ bits >> 16;
}

/// One world of the kind that its seed says; each eighth one of bodies runs twice, and half of those with Solver.
void soakWorld(std::uint32_t seed, SoakMistake mistake, SoakCounts& counts)
{
    const SoakCircumstances first{1, mistake, false};
    if (seed % 2 == 0)
    {
        soakBoxes(seed, first, counts);
        return;
    }
    const bool hasSolver = seed % 8 == 3;
    const auto soak = hasSolver ? soakSolver : soakBodies;
    const std::uint64_t hash = soak(seed, first, counts);
    if (seed % 16 != (hasSolver ? 3 : 1))
        return;
    if (soak(seed, {2, mistake, false}, counts) != hash)
        throw SoakFault(0, "the world differs with other backends and threads");
    ++counts.twins;
}

/// Runs a world; returns what is wrong, if anything.
std::string faultOf(std::uint32_t seed, SoakMistake mistake, SoakCounts& counts)
{
    try
    {
        soakWorld(seed, mistake, counts);
        return "";
    }
    catch (const std::exception& fault)
    {
        return "world " + std::to_string(seed) + ", " + fault.what() + "\nagain: cullet_soak --world " +
               std::to_string(seed);
    }
}

/// Threads that run one world after the other, and stand still when memory is measured.
class Soak
{
public:
    explicit Soak(const Options& options) : m_options(options) {}

    /// @return whether all went well
    bool run()
    {
        m_start = Clock::now();
        std::vector<std::thread> threads;
        m_running = m_options.threads;
        for (unsigned i = 0; i < m_options.threads; ++i)
            threads.emplace_back([this] { work(); });
        watch();
        m_isOver = true;
        for (std::thread& thread : threads)
            thread.join();
        summarise();
        return m_fault.empty();
    }

private:
    using Clock = std::chrono::steady_clock;

    double minutes() const { return std::chrono::duration<double>(Clock::now() - m_start).count() / 60; }

    void work()
    {
        // A registration keeps the memory of its largest world.
        SoakCounts warmUp;
        soakBodies(m_options.seed, {1, SoakMistake::None, true}, warmUp);
        while (!m_isOver)
        {
            SoakCounts counts;
            const std::uint32_t seed = seedOf(m_options.seed, m_next++);
            if (m_options.solver)
                handOver(soakOne(*m_options.solver, seed, counts), counts);
            else
                handOver(faultOf(seed, m_options.mistake, counts), counts);
        }
        const std::lock_guard<std::mutex> lock(m_mutex);
        --m_running;
        m_changed.notify_all();
    }

    /// @return what is wrong, if anything
    std::string soakOne(SolverModel model, std::uint32_t seed, SoakCounts& counts)
    {
        const auto goesOn = [&]
        {
            handOver("", counts);
            return !m_isOver;
        };
        try
        {
            soakOneSolver(model, seed, {seed, m_options.mistake, false}, counts, goesOn);
            return "";
        }
        catch (const std::exception& fault)
        {
            return std::string("the world with cullet::Solver, ") + fault.what();
        }
    }

    /// Adds counts to those of all threads, and stands still while memory is measured.
    void handOver(const std::string& fault, SoakCounts& counts)
    {
        std::unique_lock<std::mutex> lock(m_mutex);
        m_counts.add(counts);
        counts = {};
        if (!fault.empty() && m_fault.empty())
            m_fault = fault;
        for (const SolverModel model : {SolverModel::Bullet, SolverModel::Soft})
        {
            if (m_fault.empty())
                m_fault = faultOfRests(model, m_counts.rests[int(model)]);
        }
        m_isOver = m_isOver || !m_fault.empty();
        --m_running;
        m_changed.notify_all();
        m_changed.wait(lock, [this] { return !m_isMeasuring; });
        ++m_running;
    }

    void watch()
    {
        const double interval = std::max(0.2 / 60, m_options.minutes / 2000);
        double nextLine = 1;
        while (!m_isOver && (minutes() < m_options.minutes || m_live.count() < kFewestSamples))
        {
            std::this_thread::sleep_for(std::chrono::duration<double>(interval * 60));
            measure();
            if (minutes() < nextLine)
                continue;
            nextLine += 1;
            printProgress();
        }
        const std::lock_guard<std::mutex> lock(m_mutex);
        if (m_fault.empty())
            m_fault = memoryFault();
    }

    void measure()
    {
        std::unique_lock<std::mutex> lock(m_mutex);
        m_isMeasuring = true;
        m_changed.wait(lock, [this] { return m_running == 0; });
        trimHullCache();
        malloc_trim(0);
        const double live = static_cast<double>(liveBytes()), steps = static_cast<double>(m_counts.steps);
        if (steps > m_stepsBefore)
            m_growths.push_back((live - m_liveBefore) / (steps - m_stepsBefore));
        m_liveBefore = live;
        m_stepsBefore = steps;
        m_live.add(minutes(), live);
        m_resident.add(minutes(), residence().now);
        m_isMeasuring = false;
        m_changed.notify_all();
    }

    /// The first part of the run fills caches and pools.
    static constexpr double kWarmUp = 0.3;
    /// For a line; a short run on a busy machine takes longer for them.
    static constexpr std::size_t kFewestSamples = 20;
    /// A leak grows between most samples; what a larger world than any before leaves behind, between few.
    static constexpr double kMostMedianGrowth = 4, kMostLiveGrowth = 2 * 1024 * 1024;
    static constexpr double kMostResidentGrowth = 16 * 1024 * 1024;

    double medianGrowth() const
    {
        std::vector<double> growths = m_growths;
        if (growths.empty())
            return 0;
        std::nth_element(growths.begin(), growths.begin() + static_cast<std::ptrdiff_t>(growths.size() / 2),
                         growths.end());
        return growths[growths.size() / 2];
    }

    std::string memoryFault() const
    {
#ifdef CULLET_IS_SANITIZED
        return "";  // a sanitizer keeps what is freed, and looks for leaks itself
#endif
        if (medianGrowth() > kMostMedianGrowth)
            return "memory that is in use grows by " + std::to_string(medianGrowth()) + " bytes a step";
        if (m_live.growth(kWarmUp) > kMostLiveGrowth * m_options.threads)
            return "memory that is in use grows by " + std::to_string(m_live.growth(kWarmUp)) +
                   " bytes after the first part of the run";
        if (m_resident.growth(kWarmUp) > kMostResidentGrowth)
            return "resident memory grows by " + std::to_string(m_resident.growth(kWarmUp)) +
                   " bytes after the first part of the run";
        return "";
    }

    void printProgress()
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        std::printf("%.0f min: %llu worlds, %llu steps, %llu box pairs compared, %.1f MB resident\n",
                    minutes(), static_cast<unsigned long long>(m_counts.worlds),
                    static_cast<unsigned long long>(m_counts.steps),
                    static_cast<unsigned long long>(m_counts.comparedBoxes), residence().now / 1e6);
        std::fflush(stdout);
    }

    static void printRests(const char* model, const SoakRests& rests)
    {
        std::printf("%-24s %llu rests\n", model, static_cast<unsigned long long>(rests.count));
        const auto line = [](const char* name, const RestErrors& errors)
        {
            std::printf("%-24s way %.5f m, energy %.5f J, overlap %.5f m, joints %.5f m\n", name,
                        errors[Creep], errors[Energy], errors[Depth], errors[Pivot]);
        };
        line("... in the mean",
             {rests.mean(Creep), rests.mean(Energy), rests.mean(Depth), rests.mean(Pivot)});
        line("... the worst", rests.most);
    }

    void summarise()
    {
        const auto line = [](const char* name, std::uint64_t count)
        { std::printf("%-24s %llu\n", name, static_cast<unsigned long long>(count)); };
        std::printf("%-24s %s\n", "result", m_fault.empty() ? "no fault" : "FAULT");
        std::printf("%-24s %s\n", "commit", CULLET_COMMIT);
        std::printf("%-24s %d bytes\n", "scalar", static_cast<int>(sizeof(btScalar)));
        line("seed", m_options.seed);
        line("threads", m_options.threads);
        std::printf("%-24s %.2f\n", "minutes", minutes());
        line("worlds", m_counts.worlds);
        line("worlds run twice", m_counts.twins);
        line("steps", m_counts.steps);
        line("steps with brute force", m_counts.checkedSteps);
        line("box pairs compared", m_counts.comparedBoxes);
        line("pairs found", m_counts.pairs);
        line("contact points", m_counts.contacts);
        line("hulls made", m_counts.hulls);
        line("recorded frames", m_counts.recordedFrames);
        line("steps with Solver", m_counts.solverSteps);
        line("joints made", m_counts.joints);
        line("joints broken", m_counts.brokenJoints);
        line("longest life, steps", m_counts.longestLife);
        printRests("SolverModel::Bullet", m_counts.rests[int(SolverModel::Bullet)]);
        printRests("SolverModel::Soft", m_counts.rests[int(SolverModel::Soft)]);
        line("memory samples", m_live.count());
        std::printf("%-24s %.1f MB\n", "most resident", residence().most / 1e6);
        std::printf("%-24s %.0f bytes after warm-up, %.0f a minute\n", "resident growth",
                    m_resident.growth(kWarmUp), m_resident.growth(kWarmUp) / (minutes() * (1 - kWarmUp)));
        std::printf("%-24s %.0f bytes after warm-up, %.0f a minute\n", "growth of memory in use",
                    m_live.growth(kWarmUp), m_live.growth(kWarmUp) / (minutes() * (1 - kWarmUp)));
        std::printf("%-24s %.3f bytes a step\n", "... the median", medianGrowth());
        if (!m_fault.empty())
            std::printf("FAULT: seed %u, %s\n", m_options.seed, m_fault.c_str());
    }

    const Options m_options;
    Clock::time_point m_start;
    std::atomic<std::uint32_t> m_next{0};
    std::atomic<bool> m_isOver{false};
    std::mutex m_mutex;
    std::condition_variable m_changed;
    bool m_isMeasuring = false;
    unsigned m_running = 0;  ///< threads in a world
    SoakCounts m_counts;
    std::string m_fault;
    Line m_live, m_resident;
    double m_liveBefore = 0, m_stepsBefore = 0;
    std::vector<double> m_growths;  ///< of memory in use between two samples, bytes a step
};

int runWorldAgain(std::uint32_t seed, SoakMistake mistake)
{
    SoakCounts counts;
    const std::string fault = faultOf(seed, mistake, counts);
    std::printf("%s\n", fault.empty() ? "no fault" : ("FAULT: " + fault).c_str());
    return fault.empty() ? 0 : 1;
}
}  // namespace
}  // namespace cullet::test

int main(int count, char** arguments)
{
    using namespace cullet::test;
    const Options options = read(count, arguments);
    if (options.world)
        return runWorldAgain(*options.world, options.mistake);
    return Soak(options).run() ? 0 : 1;
}
