// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/rivals/rival.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

namespace cullet
{
namespace
{
/// Has no state between frames; works on pointers to boxes, as CGAL's manual advises, so that the boxes are not moved.
class CgalRival : public Rival
{
public:
    void create(const Aabb* boxes, std::size_t count) override
    {
        for (std::size_t i = 0; i < count; ++i)
            m_boxes.push_back(toCgal(boxes[i], static_cast<std::uint32_t>(m_boxes.size())));
        m_order.clear();
        for (const Box& box : m_boxes)
            m_order.push_back(&box);
    }

    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override
    {
        for (const std::uint32_t row : rows)
            m_boxes[row] = toCgal(boxes[row], row);
    }

    void remove(std::uint32_t row) override
    {
        std::size_t i = 0;
        while (m_order[i]->info() != row)
            ++i;
        m_order[i] = m_order.back();
        m_order.pop_back();
    }

    void findPairs(Pairs& pairs) override
    {
        CGAL::box_self_intersection_d(m_order.begin(), m_order.end(),
                                      [&pairs](const Box* a, const Box* b)
                                      { pairs.push_back(makePair(a->info(), b->info())); });
    }

private:
    using Box = CGAL::Box_intersection_d::Box_with_info_d<float, 3, std::uint32_t>;

    static Box toCgal(Aabb box, std::uint32_t row) { return Box(box.min, box.max, row); }

    std::vector<Box> m_boxes;
    std::vector<const Box*> m_order;
};
}  // namespace

std::unique_ptr<Rival> makeCgalRival(const RivalRequest&)
{
    return std::make_unique<CgalRival>();
}
}  // namespace cullet
