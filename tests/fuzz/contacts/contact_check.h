// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/contacts/contact_bench.h"
#include "cullet/tests/fuzz/contacts/convex_spec.h"
#include "cullet/tests/fuzz/contacts/signed_distance.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <string>

namespace cullet::test
{
/// How far answers may be from the exact ones, as gjk_types.h and epa.h document it. "Size": the radii of both cores and
/// the distance of their origins.
struct ContactBounds
{
    static constexpr bool kIsFloat = sizeof(btScalar) == sizeof(float);

    /// @param size   of cores and offset
    /// @param margin of both shapes
    /// @param far    the largest coordinate of an origin, by which points are rounded
    ContactBounds(long double size, long double margin, long double far)
        : rounding((kIsFloat ? 1e-6L : 1e-13L) * size + 2 * kEpsilon * (margin + size)),
          touching(4e-7L * size),
          depth((kIsFloat ? 2e-5L : 1e-9L) * size),
          place(4 * kEpsilon * (far + size + margin))
    {
    }

    /// Of a distance or a depth.
    long double of(long double gap) const
    {
        if (gap > touching)
            return rounding;
        return gap > -touching ? std::max(touching, depth) : depth + rounding;
    }

    static constexpr long double kEpsilon = std::numeric_limits<btScalar>::epsilon();

    long double rounding;  ///< of numbers
    long double touching;  ///< up to here it is undecided whether two cores overlap
    long double depth;     ///< by which a depth may be too large
    long double place;     ///< rounding of a point in the world
};

/// The exact answer for two polytopes.
class PolytopePair
{
public:
    PolytopePair(const PosedPair& pair)
        : m_from(pair.atA.getOrigin()),
          m_a(*pair.a, pair.atA, m_from),
          m_b(*pair.b, pair.atB, m_from),
          m_size(m_a.radius + m_b.radius + (pair.atB.getOrigin() - pair.atA.getOrigin()).length()),
          m_distance(m_a.points, m_b.points, m_size),
          m_bounds(m_size, margins(), farOf(pair))
    {
    }

    const ContactBounds& bounds() const { return m_bounds; }
    /// Of the cores.
    long double gap() const { return m_distance.gap(); }
    long double margins() const { return m_a.margin + m_b.margin; }
    long double size() const { return m_size; }
    const PolytopeCore& a() const { return m_a; }
    const PolytopeCore& b() const { return m_b; }

    long double gapAlong(const btVector3& normal) const
    {
        return test::gapAlong(m_a.points, m_b.points, LongVector(normal.x(), normal.y(), normal.z()));
    }

    /// How far a point of the world is from a core.
    long double distanceOf(const LongVector& point, const PolytopeCore& core) const
    {
        return SignedDistance({point}, core.points, m_size).gap();
    }

    LongVector relative(const btVector3& point) const
    {
        const LongVector p(point.x(), point.y(), point.z());
        return p - LongVector(m_from.x(), m_from.y(), m_from.z());
    }

private:
    static long double farOf(const PosedPair& pair)
    {
        const btVector3 a = pair.atA.getOrigin().absolute(), b = pair.atB.getOrigin().absolute();
        return std::max(a[a.maxAxis()], b[b.maxAxis()]);
    }

    const btVector3 m_from;
    const PolytopeCore m_a, m_b;
    const long double m_size;
    const SignedDistance m_distance;
    const ContactBounds m_bounds;
};

/// What is wrong with answers; the first fault stays.
class ContactFault
{
public:
    const std::string& text() const { return m_text; }

    template <class... Parts>
    void require(bool isTrue, const Parts&... parts)
    {
        if (isTrue || !m_text.empty())
            return;
        std::ostringstream text;
        text.precision(12);
        (text << ... << parts);
        m_text = text.str();
    }

private:
    std::string m_text;
};

/// What a query promises beside the contacts themselves.
struct ContactQuery
{
    const char* name;
    long double reach;  ///< up to which gap of the cores it answers
    int most;           ///< most points
    /// A step computes distances from points that it has rounded in the world.
    bool isStep = false;
    long double threshold = 0;  ///< of a step's manifold
    /// How far a point of a patch may be beside the other face; see Prism.
    long double beside = 0;
};

/// Compares the contacts of one query with the exact answer.
class ContactCheck
{
public:
    ContactCheck(const PolytopePair& truth, ContactFault& fault) : m_truth(truth), m_fault(fault) {}

    void check(const Contacts& contacts, const ContactQuery& query)
    {
        m_name = query.name;
        const long double gap = m_truth.gap(), reach = query.reach;
        m_beside = query.beside;
        m_slack = m_truth.bounds().of(gap) + (query.isStep ? m_truth.bounds().place : 0.0L);
        const long double slack = m_slack + 16 * ContactBounds::kEpsilon * reach;
        // The manifold drops points that rounding in the world has moved by more than its threshold.
        if (contacts.empty() && query.isStep && query.threshold <= m_truth.bounds().place)
            return;
        if (contacts.empty())
            return require(gap > reach - slack, "nothing is found, but the gap is ", gap, " and the reach ",
                           reach);
        require(gap < reach + slack, "a contact is found, but the gap is ", gap, " and the reach ", reach);
        require(contacts.size() <= static_cast<std::size_t>(query.most), contacts.size(), " points");
        long double least = std::numeric_limits<long double>::infinity();
        for (const Reported& contact : contacts)
        {
            checkNumbers(contact);
            checkPoints(contact);
            least = std::min(least, static_cast<long double>(contact.distance));
        }
        // Of points that are nearly as deep, a patch chooses by their places; see makeContactPatch().
        const long double choice = query.most > 1 ? 1.2e-3L * (reach - gap) : 0.0L;
        checkLeast(least, choice, contacts.front().normal);
    }

    /// The normals of distant shapes are unique.
    void checkMirrored(const Contacts& contacts, const Contacts& swapped)
    {
        m_name = "swapped";
        if (contacts.empty() || swapped.empty())
            return;
        const long double gap = m_truth.gap();
        if (gap <= m_truth.bounds().touching)
            return;
        const long double turned = (contacts[0].normal + swapped[0].normal).length();
        const long double allowed =
            4 * std::sqrt(2 * m_truth.size() * m_truth.bounds().rounding) / gap + 8 * ContactBounds::kEpsilon;
        require(turned <= allowed, "normals differ by ", turned, ", allowed ", allowed, " at gap ", gap);
    }

private:
    template <class... Parts>
    void require(bool isTrue, const Parts&... parts)
    {
        m_fault.require(isTrue, m_name, ": ", parts..., " (gap of the cores ", m_truth.gap(), ", margins ",
                        m_truth.margins(), ", size ", m_truth.size(), ")");
    }

    void checkNumbers(const Reported& contact)
    {
        require(isFinite(contact.normal) && isFinite(contact.onB) && std::isfinite(contact.distance),
                "a number is not finite");
        require(std::abs(double(contact.normal.length()) - 1.0) <= (ContactBounds::kIsFloat ? 1e-6 : 1e-14),
                "the normal has length ", double(contact.normal.length()));
    }

    void checkPoints(const Reported& contact)
    {
        const LongVector normal(contact.normal.x(), contact.normal.y(), contact.normal.z());
        const LongVector onB = m_truth.relative(contact.onB), onA = onB + contact.distance * normal;
        const long double allowed = m_truth.bounds().of(m_truth.gap()) + m_truth.bounds().place + m_beside +
                                    ContactBounds::kEpsilon * m_truth.size();
        const long double outB = m_truth.distanceOf(onB, m_truth.b()) - m_truth.b().margin;
        const long double outA = m_truth.distanceOf(onA, m_truth.a()) - m_truth.a().margin;
        require(outB <= allowed, "the point of B is outside of it by ", outB, ", allowed ", allowed, ": ",
                textOf({contact}));
        require(outA <= allowed, "the point of A is outside of it by ", outA, ", allowed ", allowed, ": ",
                textOf({contact}));
    }

    /// The gap is the largest of all directions, so that no answer may exceed it; that along its own normal, it has.
    void checkLeast(long double least, long double choice, const btVector3& normal)
    {
        const long double core = least + m_truth.margins(), gap = m_truth.gap();
        const long double allowed = m_slack + 4 * ContactBounds::kEpsilon * std::abs(least);
        require(core >= gap - allowed && core <= gap + allowed + choice, "the gap is ", core, ", off by ",
                core - gap, ", allowed ", allowed);
        const long double along = m_truth.gapAlong(normal);
        require(std::abs(core - along) <= allowed + choice + m_truth.bounds().rounding + tiltOf(gap),
                "the gap along the normal is ", along, ", not ", core);
    }

    /// By how much the gap along a normal may be less than that between the closest points whose difference v it is. Each
    /// is a sum of three products and an origin, in double: off by 4 u of the size, so v by 8 u = 4 eps of it. That turns
    /// v / |v| by 4 eps size / gap, and no point of A - B is farther from the closest one than the size, so its height
    /// over it changes by the size times that.
    long double tiltOf(long double gap) const
    {
        const long double size = m_truth.size();
        return gap > m_truth.bounds().touching
                   ? 4 * static_cast<long double>(std::numeric_limits<double>::epsilon()) * size * size / gap
                   : 0.0L;
    }

    const PolytopePair& m_truth;
    ContactFault& m_fault;
    const char* m_name = "";
    long double m_slack = 0;   ///< of the distances of the query
    long double m_beside = 0;  ///< of its points
};
}  // namespace cullet::test
