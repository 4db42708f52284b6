// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_subject.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
const std::vector<NarrowSubjectInfo>& narrowSubjects()
{
    static const std::vector<NarrowSubjectInfo> subjects = {
        {"cullet", "ISA-GJK, GJK and EPA of this library", true, makeCulletNarrow},
        {"cullet-cw",
         "the same with Chung and Wang's steps instead of looking around the corner; boolean only", true,
         makeCulletReflectedNarrow},
        {"cullet-axis",
         "GJK from one support along the last axis or that between the centres; boolean, distance", true,
         makeCulletFromAxisNarrow},
        {"cullet-four", "GJK from four supports in fixed directions; boolean, distance", false,
         makeCulletFromFourNarrow},
        {"voronoi", "simplex only: regions of the newest point, as in the library", false, makeVoronoiSolver,
         true},
        {"voronoi-full", "simplex only: all regions", false, makeFullVoronoiSolver, true},
        {"johnson", "simplex only: Johnson's distance algorithm", false, makeJohnsonSolver, true},
        {"signed-volumes", "simplex only: signed volumes", false, makeSignedVolumesSolver, true},
        {"bullet", "btGjkPairDetector with btGjkEpaPenetrationDepthSolver", false, makeBulletNarrow},
#ifdef CULLET_BENCH_CCD
        {"ccd", "libccd: GJK (boolean), MPR (contacts); no distance", false, makeCcdNarrow},
#else
        {"ccd", "built without libccd (Debian: libccd-dev)", false, nullptr},
#endif
#ifdef CULLET_BENCH_FCL
        {"fcl", "FCL's own GJK and EPA on its Convex", false, makeFclNarrow},
#else
        {"fcl", "built without FCL (Debian: libfcl-dev)", false, nullptr},
#endif
#ifdef CULLET_BENCH_COAL
        {"coal", "Coal's GJK and EPA on its Convex", true, makeCoalNarrow},
#else
        {"coal", "built without Coal (pip install coal, then -DCOAL_ROOT=.../cmeel.prefix)", false, nullptr},
#endif
    };
    return subjects;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
