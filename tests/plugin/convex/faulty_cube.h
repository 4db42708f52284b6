// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_contacts.h"

namespace cullet::test
{
/// A cube given by its support function, one call of which is faulty.
///
/// @tparam Fault called then, in place of the answer
template <class Fault>
class FaultyCube final : public btConvexInternalShape
{
public:
    FaultyCube(int badCall, const Fault& fault) : m_badCall(badCall), m_fault(fault)
    {
        m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    }

    btVector3 localGetSupportingVertexWithoutMargin(const btVector3& d) const override
    {
        if (m_calls++ == m_badCall)
            return m_fault();
        return vec(d.x() < 0 ? -0.5 : 0.5, d.y() < 0 ? -0.5 : 0.5, d.z() < 0 ? -0.5 : 0.5);
    }
    /// Computed without a support.
    void getAabb(const btTransform&, btVector3& low, btVector3& high) const override
    {
        low = vec(-1, -1, -1);
        high = vec(1, 1, 1);
    }
    void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3*, btVector3*, int) const override
    {
    }
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    const char* getName() const override { return "FaultyCube"; }

private:
    int m_badCall;
    Fault m_fault;
    mutable int m_calls = 0;
};
}  // namespace cullet::test
