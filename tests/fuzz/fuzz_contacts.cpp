// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Contacts of two convex shapes: the same bits from any history, nearly the same for swapped and moved pairs, and as far
// from the exact answer as rounding allows.

#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/contacts/contact_bench.h"
#include "cullet/tests/fuzz/contacts/contact_check.h"
#include "cullet/tests/fuzz/contacts/contact_shares.h"
#include "cullet/tests/fuzz/contacts/spec_choice.h"
#include "cullet/tests/fuzz/fuzz_target.h"

#include <cmath>
#include <memory>
#include <optional>
#include <string>

namespace cullet::test
{
const char* const kFuzzTargetName = "contacts";

namespace
{
/// What an input may change about a pair.
struct Scene
{
    ConvexSpec specs[2];
    btTransform places[2] = {btTransform(btQuaternion::getIdentity(), btVector3(0, 2, 0)),
                             btTransform::getIdentity()};
    double threshold = 0.25;
    int patchPoints = 4;
    int power = 3;  ///< of two, for the scaled pair
};

/// All queries of one pose.
class SceneCheck
{
public:
    /// @param used algorithms that have seen other poses of the pair
    SceneCheck(const Scene& scene, const PosedPair& pair, PairAlgorithms& used)
        : m_scene(scene),
          m_pair(pair),
          m_used(used),
          m_bench(ContactBenches::get().ours(scene.patchPoints)),
          m_threshold(double(btScalar(scene.threshold)))
    {
    }

    std::string run()
    {
        const std::uint64_t before = notConvergedTotal();
        ask();
        m_isConverged = notConvergedTotal() == before;
        ++ContactShares::get().checks;
        checkHistory();
        if (isBullets())
            checkAgainstBullet();
        else
            checkPolytopes();
        return m_fault.text();
    }

private:
    void ask()
    {
        PairAlgorithms fresh(m_bench, m_pair);
        m_closest = fresh.closest(m_pair, m_threshold);
        m_patch = PairAlgorithms(m_bench, m_pair).patch(m_pair, m_threshold);
        m_step = PairAlgorithms(m_bench, m_pair).step(m_pair);
    }

    void requireSame(const Contacts& contacts, const Contacts& expected, const char* what)
    {
        m_fault.require(areSame(contacts, expected), what, ": ", textOf(contacts), ", instead of ",
                        textOf(expected));
    }

    void checkHistory()
    {
        requireSame(m_used.closest(m_pair, m_threshold), m_closest, "closest point after other poses");
        requireSame(m_used.patch(m_pair, m_threshold), m_patch, "patch after other poses");
        requireSame(m_used.step(m_pair), m_step, "step after other poses");
        requireSame(contactPairTest(m_bench, m_pair, m_threshold), m_closest, "contactPairTest()");
    }

    bool isBullets() const
    {
        const ConvexSpec &a = m_scene.specs[0], &b = m_scene.specs[1];
        const bool isSphereTriangle = (a.kind == SpecKind::Sphere && b.kind == SpecKind::Triangle) ||
                                      (b.kind == SpecKind::Sphere && a.kind == SpecKind::Triangle);
        return !a.isPolytope() || !b.isPolytope() || (a.isRound() && b.isRound()) || isSphereTriangle;
    }

    /// Bullet's own algorithm answers where it has something to answer.
    void checkAgainstBullet()
    {
        ++ContactShares::get().bullets;
        PairAlgorithms stock(ContactBenches::get().stock(), m_pair);
        const Contacts closest = stock.closest(m_pair, m_threshold);
        const double size = double(radiusOf(*m_pair.a) + radiusOf(*m_pair.b));
        if (!m_closest.empty())
            return requireSame(m_closest, closest, "Bullet's pair");
        m_fault.require(closest.empty() || closest[0].distance > m_threshold - 0.01 * size,
                        "nothing is found, and Bullet finds a distance of ",
                        closest.empty() ? 0 : closest[0].distance);
    }

    static btScalar radiusOf(const btConvexShape& shape)
    {
        btVector3 centre;
        btScalar radius;
        shape.getBoundingSphere(centre, radius);
        return centre.length() + radius;
    }

    double breakingThreshold() const
    {
        return double(std::min(m_pair.a->getContactBreakingThreshold(gContactBreakingThreshold),
                               m_pair.b->getContactBreakingThreshold(gContactBreakingThreshold)));
    }

    void checkPolytopes()
    {
        const PolytopePair truth(m_pair);
        countPose(truth);
        if (!m_isConverged)
            return;
        ContactCheck check(truth, m_fault);
        const long double step = truth.margins() + breakingThreshold(),
                          reach = step + truth.margins() + m_threshold;
        check.check(m_closest, {"closest point", reach, 1});
        // See kClipTolerance: a twentieth along either side of a corner.
        const long double beside = m_scene.patchPoints > 1 ? 0.1L * breakingThreshold() : 0.0L;
        check.check(m_patch, {"patch", reach, m_scene.patchPoints, false, 0, beside});
        check.check(m_step, {"step", step, m_scene.patchPoints, true, breakingThreshold(), beside});
        const PosedPair swapped = m_pair.swapped();
        const Contacts mirrored = checkClosest(swapped, m_threshold, {"swapped", reach, 1});
        if (m_isConverged)
            check.checkMirrored(m_closest, mirrored);
        checkMoved(reach);
        checkPrepared();
        checkScaled(reach, truth.gap() - truth.bounds().touching);
    }

    void checkMoved(long double reach)
    {
        const btTransform motion(
            btQuaternion(btVector3(btScalar(0.6), 0, btScalar(0.8)), btScalar(m_scene.power) / 3),
            btVector3(3, btScalar(m_scene.power), -7));
        checkClosest(m_pair.movedBy(motion), m_threshold, {"moved", reach, 1});
    }

    /// Checks the closest points of another pair, unless Bullet's detector has answered.
    Contacts checkClosest(const PosedPair& pair, double threshold, const ContactQuery& query)
    {
        const std::uint64_t before = notConvergedTotal();
        const Contacts contacts = PairAlgorithms(m_bench, pair).closest(pair, threshold);
        m_isConverged = notConvergedTotal() == before;
        if (m_isConverged)
            ContactCheck(PolytopePair(pair), m_fault).check(contacts, query);
        return contacts;
    }

    std::uint64_t notConvergedTotal() const { return m_bench.registration->stats().notConvergedTotal; }

    /// A power of two changes no bit of a distance, unless axes become so long or short that they are scaled before they
    /// are tested (see HullPair::isTestable()), or the core of a triangle has a column that does not scale like a
    /// length (see poseTriangle()).
    void checkScaled(long double reach, long double gap)
    {
        const double factor = std::ldexp(1.0, m_scene.power);
        const auto a = m_scene.specs[0].make(factor), b = m_scene.specs[1].make(factor);
        PosedPair scaled = m_pair.withShapes(*a, *b);
        scaled.atA.setOrigin(scaled.atA.getOrigin() * btScalar(factor));
        scaled.atB.setOrigin(scaled.atB.getOrigin() * btScalar(factor));
        const double threshold = m_threshold * factor;
        const Contacts closest = checkClosest(scaled, threshold, {"scaled", reach * factor, 1});
        const auto hasOtherColumns = [](const ConvexSpec& spec) { return spec.kind == SpecKind::Triangle; };
        const bool isExact = gap > 0 && !m_closest.empty() && std::abs(m_scene.power) <= 8;
        if (!isExact || hasOtherColumns(m_scene.specs[0]) || hasOtherColumns(m_scene.specs[1]))
            return;
        requireSame(closest, scaledBy(m_closest, factor), "scaled closest point");
        requireSame(PairAlgorithms(m_bench, scaled).patch(scaled, threshold), scaledBy(m_patch, factor),
                    "scaled patch");
    }

    static Contacts scaledBy(const Contacts& contacts, double factor)
    {
        Contacts scaled = contacts;
        for (Reported& contact : scaled)
        {
            contact.onB *= btScalar(factor);
            contact.distance *= factor;
        }
        return scaled;
    }

    void checkPrepared()
    {
        prepareHulls(true);
        requireSame(PairAlgorithms(m_bench, m_pair).closest(m_pair, m_threshold), m_closest,
                    "prepared closest point");
        requireSame(PairAlgorithms(m_bench, m_pair).patch(m_pair, m_threshold), m_patch, "prepared patch");
        prepareHulls(false);
        requireSame(PairAlgorithms(m_bench, m_pair).patch(m_pair, m_threshold), m_patch,
                    "patch after invalidate()");
    }

    void prepareHulls(bool isPrepared)
    {
        for (const btConvexShape* shape : {m_pair.a, m_pair.b})
        {
            if (shape->getShapeType() != CONVEX_HULL_SHAPE_PROXYTYPE)
                continue;
            const auto& hull = static_cast<const btConvexHullShape&>(*shape);
            if (isPrepared)
                prepare(hull);
            else
                invalidate(hull);
        }
    }

    void countPose(const PolytopePair& truth)
    {
        ContactShares& shares = ContactShares::get();
        const long double gap = truth.gap(), size = truth.size();
        shares.unconverged += m_isConverged ? 0 : 1;
        for (const ConvexSpec& spec : m_scene.specs)
            shares.flat +=
                spec.kind == SpecKind::Triangle || (spec.kind == SpecKind::Hull && spec.points.size() < 4);
        if (m_closest.empty())
            ++shares.apart;
        else if (std::abs(gap) < 1e-4L * size)
            ++shares.touching;
        else
            ++(gap > 0 ? shares.near : gap > -0.05L * size ? shares.shallow : shares.deep);
    }

    const Scene& m_scene;
    const PosedPair m_pair;
    PairAlgorithms& m_used;
    ConvexBench& m_bench;
    const double m_threshold;
    bool m_isConverged = true;
    Contacts m_closest, m_patch, m_step;
    ContactFault m_fault;
};

/// Changes a scene as an input says, and checks it after each change.
class Session
{
public:
    Session() { rebuild(); }

    std::string run(Choices& choices)
    {
        for (; !choices.isEmpty(); choices.nextOperation())
        {
            change(choices);
            const PosedPair pair = posed();
            if (!m_used)
                m_used.emplace(ContactBenches::get().ours(m_scene.patchPoints), pair);
            const std::string fault = SceneCheck(m_scene, pair, *m_used).run();
            if (!fault.empty())
                return fault + text();
        }
        return "";
    }

private:
    /// For messages.
    std::string text() const
    {
        std::ostringstream text;
        text.precision(17);
        for (std::size_t i = 0; i < 2; ++i)
        {
            text << (i == 0 ? "\nA: " : "\nB: ") << m_scene.specs[i].text() << "\n   at";
            for (int row = 0; row < 3; ++row)
                text << ' ' << arrayOf(m_scene.places[i].getBasis()[row]);
            text << ' ' << arrayOf(m_scene.places[i].getOrigin());
        }
        text << "\nthreshold " << m_scene.threshold << ", power " << m_scene.power << ", patch points "
             << m_scene.patchPoints;
        return text.str();
    }

    static std::array<double, 3> arrayOf(const btVector3& v)
    {
        return {double(v.x()), double(v.y()), double(v.z())};
    }

    PosedPair posed() const
    {
        return {m_shapes[0].get(), m_shapes[1].get(), m_scene.places[0], m_scene.places[1]};
    }

    /// Algorithms keep the breaking threshold of the shapes that they were made for.
    void rebuild()
    {
        m_used.reset();
        for (std::size_t i = 0; i < 2; ++i)
            m_shapes[i] = m_scene.specs[i].make(1);
    }

    void change(Choices& choices)
    {
        const std::uint32_t kind = choices.below(16);
        const std::size_t which = choices.below(2);
        ConvexSpec& spec = m_scene.specs[which];
        if (kind < 4)
            chooseShape(choices, spec);
        else if (kind == 4)
            chooseMargin(choices, spec);
        else if (kind == 5)
            chooseScaling(choices, spec);
        else if (kind == 6)
            chooseQuery(choices);
        if (kind < 7)
            rebuild();
        if (kind == 7 || kind == 8)
            m_scene.places[which].setBasis(chooseTurn(choices));
        else if (kind == 9)
            moveBoth(choices);
        else if (kind == 10)
            nudge(choices, m_scene.places[which]);
        if (kind != 9 && kind != 10)
            place(choices);
    }

    void chooseQuery(Choices& choices)
    {
        const double thresholds[] = {0.25, 0, 1e-3, 4, 0.0625, 100};
        m_scene.threshold = choices.of(thresholds);
        m_scene.patchPoints = 4 - static_cast<int>(choices.below(4));
        m_scene.power = static_cast<int>(choices.below(41)) - 20;
    }

    void moveBoth(Choices& choices)
    {
        btVector3 shift;
        for (int i = 0; i < 3; ++i)
            shift[i] = btScalar(choices.coordinate());
        // In float, a coordinate of 1e4 hides a gap of 1e-3.
        if (shift.length() > 4096)
            shift = shift.normalized() * 4096;
        for (btTransform& at : m_scene.places)
            at.setOrigin(at.getOrigin() + shift);
        recentre();
    }

    void recentre()
    {
        const btVector3 origin = m_scene.places[1].getOrigin();
        if (origin.length() < 8192)
            return;
        for (btTransform& at : m_scene.places)
            at.setOrigin(at.getOrigin() - origin);
    }

    static void nudge(Choices& choices, btTransform& at)
    {
        const double step = std::ldexp(1.0, -static_cast<int>(choices.below(28)));
        btVector3 motion;
        for (int i = 0; i < 3; ++i)
            motion[i] = btScalar((double(choices.below(9)) - 4) * step);
        at.setOrigin(at.getOrigin() + motion);
    }

    /// Moves A so that it has a chosen gap to B along a direction.
    void place(Choices& choices)
    {
        btVector3 direction;
        const bool isLattice = choices.chance(128);
        for (int i = 0; i < 3; ++i)
            direction[i] = isLattice ? btScalar(choices.below(3)) - 1 : btScalar(choices.byte()) - 127;
        if (direction.length2() == 0)
            direction[1] = 1;
        direction.normalize();
        const PosedPair pair = posed();
        const btScalar lowest = direction.dot(supportOf(*pair.a, pair.atA, -direction));
        const btScalar highest = direction.dot(supportOf(*pair.b, pair.atB, direction));
        const btScalar size = radiusOf(*pair.a) + radiusOf(*pair.b);
        const btScalar gap = btScalar(chooseGap(choices, size, pair));
        btVector3 beside;
        for (int i = 0; i < 3; ++i)
            beside[i] = (btScalar(choices.below(17)) - 8) / 16 * size;
        beside -= beside.dot(direction) * direction;
        const bool isBeside = choices.chance(128);
        btTransform& at = m_scene.places[0];
        at.setOrigin(at.getOrigin() + (gap - (lowest - highest)) * direction);
        if (isBeside)
            at.setOrigin(pair.atB.getOrigin() + beside +
                         direction.dot(at.getOrigin() - pair.atB.getOrigin()) * direction);
    }

    static double chooseGap(Choices& choices, double size, const PosedPair& pair)
    {
        const double margins = double(pair.a->getMargin() + pair.b->getMargin());
        const double rest = double(1 + choices.below(64)) / 64;
        const double tiny[] = {0, 1e-8, -1e-8, 1e-6, -1e-6, 1e-4, -1e-4, 1e-3};
        switch (choices.below(8))
        {
            case 0:
                return -margins * rest;
            case 1:
                return -margins + choices.of(tiny) * size;
            case 2:
                return choices.of(tiny) * size;
            case 3:
                return rest * size;
            case 4:
                return -margins - 0.05 * rest * size;
            case 5:
                return 0.05 * rest * size;
            default:
                return -margins - rest * size;
        }
    }

    static btVector3 supportOf(const btConvexShape& shape, const btTransform& at, const btVector3& direction)
    {
        return at(shape.localGetSupportingVertex(direction * at.getBasis()));
    }

    static btScalar radiusOf(const btConvexShape& shape)
    {
        btVector3 centre;
        btScalar radius;
        shape.getBoundingSphere(centre, radius);
        return radius;
    }

    Scene m_scene;
    std::unique_ptr<btConvexShape> m_shapes[2];
    std::optional<PairAlgorithms> m_used;
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    Choices choices(data, size);
    return Session().run(choices);
}
}  // namespace cullet::test
