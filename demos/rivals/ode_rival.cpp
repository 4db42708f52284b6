// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/rivals/rival.h"

#include <ode/ode.h>

namespace cullet
{
namespace
{
struct OdeBody
{
    Aabb box;
    std::uint32_t row;
};

OdeBody& bodyOf(dGeomID geom)
{
    return *static_cast<OdeBody*>(dGeomGetClassData(geom));
}

void boundsOf(dGeomID geom, dReal* bounds)
{
    const Aabb& box = bodyOf(geom).box;
    for (int axis = 0; axis < 3; ++axis)
    {
        bounds[2 * axis] = dReal(box.min[axis]);
        bounds[2 * axis + 1] = dReal(box.max[axis]);
    }
}

dColliderFn* noCollider(int)
{
    return nullptr;
}

/// A class of geometry that is its bounding box, exactly; ODE's own box would compute it from a centre and lengths.
int boxClass()
{
    static const int number = []
    {
        dInitODE2(0);
        dGeomClass description = {};
        description.bytes = sizeof(OdeBody);
        description.collider = noCollider;
        description.aabb = boundsOf;
        return dCreateGeomClass(&description);
    }();
    return number;
}

class OdeRival : public Rival
{
public:
    explicit OdeRival(bool sweeps)
        : m_class(boxClass()),
          m_space(sweeps ? dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ) : dHashSpaceCreate(nullptr))
    {
    }

    ~OdeRival() override { dSpaceDestroy(m_space); }
    OdeRival(const OdeRival&) = delete;
    OdeRival& operator=(const OdeRival&) = delete;

    void create(const Aabb* boxes, std::size_t count) override
    {
        for (std::size_t i = 0; i < count; ++i)
        {
            const dGeomID geom = dCreateGeom(m_class);
            bodyOf(geom) = {boxes[i], static_cast<std::uint32_t>(m_geoms.size())};
            dSpaceAdd(m_space, geom);
            m_geoms.push_back(geom);
        }
    }

    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override
    {
        for (const std::uint32_t row : rows)
        {
            const Aabb& box = boxes[row];
            bodyOf(m_geoms[row]).box = box;
            // The position is unused; setting it marks the geometry as moved in the space.
            dGeomSetPosition(m_geoms[row], dReal(box.min[0]), dReal(box.min[1]), dReal(box.min[2]));
        }
    }

    void remove(std::uint32_t row) override { dGeomDestroy(m_geoms[row]); }

    void findPairs(Pairs& pairs) override
    {
        const auto collect = [](void* list, dGeomID a, dGeomID b)
        { static_cast<Pairs*>(list)->push_back(makePair(bodyOf(a).row, bodyOf(b).row)); };
        dSpaceCollide(m_space, &pairs, collect);
    }

private:
    int m_class;
    dSpaceID m_space;  ///< owns the geometries
    std::vector<dGeomID> m_geoms;
};
}  // namespace

std::unique_ptr<Rival> makeOdeRival(const RivalRequest& request)
{
    return std::make_unique<OdeRival>(request.name == "ode-sap");
}
}  // namespace cullet
