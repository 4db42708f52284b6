// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/narrow_subject.h"

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
