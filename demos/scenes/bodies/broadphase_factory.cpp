// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/broadphase_factory.h"

#include "cullet/demos/bench/named_backends.h"
#include "cullet/plugin/broadphase.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>

#include <algorithm>
#include <stdexcept>
#include <thread>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
NamedBroadphase nameCullet(const BroadphaseRequest& request, std::unique_ptr<Broadphase> broadphase)
{
    NamedBroadphase result;
    result.name = request.name;
    result.cullet = broadphase.get();
    result.broadphase = std::move(broadphase);
    const unsigned int cores = std::thread::hardware_concurrency();
    result.threads = request.threads > 0 ? request.threads : static_cast<int>(cores);
    return result;
}

NamedBroadphase makeCullet(const BroadphaseRequest& request, BackendChoice choice)
{
    BroadphaseOptions options;
    options.backend = choice;
    options.threads = request.threads;
    return nameCullet(request, std::make_unique<Broadphase>(options));
}

/// "cuda" requires a device: without one, timings of the fallback would have the wrong name.
NamedBroadphase makeCuda(const BroadphaseRequest& request)
{
    std::string why;
    if (!makeCudaPsapBackend({}, &why))
        throw std::runtime_error("backend cuda: " + why);
    return makeCullet(request, BackendChoice::Cuda);
}

NamedBroadphase makeDbvt(const BroadphaseRequest& request, bool deferred)
{
    auto broadphase = std::make_unique<btDbvtBroadphase>();
    broadphase->m_deferedcollide = deferred;
    NamedBroadphase result;
    result.name = request.name;
    result.broadphase = std::move(broadphase);
    return result;
}

NamedBroadphase makeAxisSweep(const BroadphaseRequest& request)
{
    const ExactBox& bounds = request.worldBounds;
    const btVector3 low(btScalar(bounds.min[0]), btScalar(bounds.min[1]), btScalar(bounds.min[2]));
    const btVector3 high(btScalar(bounds.max[0]), btScalar(bounds.max[1]), btScalar(bounds.max[2]));
    NamedBroadphase result;
    result.name = request.name;
    // Without its second tree, which serves ray casts.
    result.broadphase = std::make_unique<bt32BitAxisSweep3>(low, high, request.mostProxies, nullptr, true);
    return result;
}
}  // namespace

const std::vector<BroadphaseInfo>& broadphaseNames()
{
    static const std::vector<BroadphaseInfo> names = []
    {
        std::vector<BroadphaseInfo> all = {
            {"auto", "cullet: CUDA when a device answers, else the grid"},
            {"cuda", "cullet on an NVIDIA GPU"},
            {"grid", "cullet: the hierarchical grid on the CPU"},
            {"brute", "cullet: every box against every other"},
            {"dbvt", "Bullet's btDbvtBroadphase as shipped"},
            {"dbvt-deferred", "btDbvtBroadphase with m_deferedcollide"},
            {"dbvt-m0", "btDbvtBroadphase with gDbvtMargin = 0"},
            {"axissweep", "Bullet's bt32BitAxisSweep3 without ray accelerator"},
        };
        for (const NamedBackend& backend : namedBackends())
        {
            const auto isNamed = [&](const BroadphaseInfo& info)
            { return std::string(info.name) == backend.name; };
            if (std::none_of(all.begin(), all.end(), isNamed))
                all.push_back({backend.name, backend.summary});
        }
        return all;
    }();
    return names;
}

NamedBroadphase makeNamedBroadphase(const BroadphaseRequest& request)
{
    NamedBroadphase result;
    if (request.name == "auto")
        result = makeCullet(request, BackendChoice::Auto);
    else if (request.name == "cuda")
        result = makeCuda(request);
    else if (request.name == "grid")
        result = makeCullet(request, BackendChoice::Grid);
    else if (request.name == "brute")
        result = makeCullet(request, BackendChoice::Brute);
    else if (request.name == "dbvt" || request.name == "dbvt-deferred" || request.name == "dbvt-m0")
        result = makeDbvt(request, request.name == "dbvt-deferred");
    else if (request.name == "axissweep")
        result = makeAxisSweep(request);
    else if (std::unique_ptr<Backend> backend = makeBackend(request.name, request.threads))
        // A backend for benchmarks only.
        result = nameCullet(request, std::make_unique<Broadphase>(std::move(backend)));
    else
    {
        std::string known;
        for (const BroadphaseInfo& info : broadphaseNames())
            known += std::string(known.empty() ? "" : ", ") + info.name;
        throw std::invalid_argument("unknown backend '" + request.name + "'; known: " + known);
    }
    result.margin = request.name == "dbvt-m0" ? btScalar(0) : gDbvtMargin;
    return result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
