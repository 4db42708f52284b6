// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/bullet_joints.h"

#include "cullet/plugin/core/dynamic_type.h"

#include <BulletDynamics/ConstraintSolver/btConeTwistConstraint.h>
#include <BulletDynamics/ConstraintSolver/btFixedConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGearConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpringConstraint.h>
#include <BulletDynamics/ConstraintSolver/btHinge2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/ConstraintSolver/btSliderConstraint.h>
#include <BulletDynamics/ConstraintSolver/btUniversalConstraint.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
template <class... Joints>
bool isOneOf(const btTypedConstraint& joint)
{
    return (isExactly<Joints>(joint) || ...);
}
}  // namespace

bool isBulletJoint(const btTypedConstraint& joint)
{
    switch (joint.getConstraintType())
    {
        case POINT2POINT_CONSTRAINT_TYPE:
            return isOneOf<btPoint2PointConstraint>(joint);
        case HINGE_CONSTRAINT_TYPE:
            return isOneOf<btHingeConstraint, btHingeAccumulatedAngleConstraint>(joint);
        case CONETWIST_CONSTRAINT_TYPE:
            return isOneOf<btConeTwistConstraint>(joint);
        case D6_CONSTRAINT_TYPE:
            return isOneOf<btGeneric6DofConstraint, btUniversalConstraint>(joint);
        case SLIDER_CONSTRAINT_TYPE:
            return isOneOf<btSliderConstraint>(joint);
        case D6_SPRING_CONSTRAINT_TYPE:
            return isOneOf<btGeneric6DofSpringConstraint>(joint);
        case GEAR_CONSTRAINT_TYPE:
            return isOneOf<btGearConstraint>(joint);
        case FIXED_CONSTRAINT_TYPE:
        case D6_SPRING_2_CONSTRAINT_TYPE:
            return isOneOf<btGeneric6DofSpring2Constraint, btFixedConstraint, btHinge2Constraint>(joint);
        default:
            return false;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
