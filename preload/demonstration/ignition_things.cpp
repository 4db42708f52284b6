// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes, balls and cylinders that fall onto a floor in a world of Gazebo's physics library with its Bullet plug-in.

#include "falling_things.h"
#include <chrono>
#include <ignition/physics/ForwardStep.hh>
#include <ignition/physics/FrameSemantics.hh>
#include <ignition/physics/RequestEngine.hh>
#include <ignition/physics/sdf/ConstructLink.hh>
#include <ignition/physics/sdf/ConstructModel.hh>
#include <ignition/physics/sdf/ConstructWorld.hh>
#include <ignition/plugin/Loader.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/Root.hh>
#include <sdf/World.hh>
#include <sstream>
#include <string>
#include <vector>

namespace
{
namespace physics = ignition::physics;

struct Features
    : physics::FeatureList<physics::ForwardStep, physics::LinkFrameSemantics, physics::sdf::ConstructSdfWorld,
                           physics::sdf::ConstructSdfModel, physics::sdf::ConstructSdfLink>
{
};
using World = physics::WorldPtr<physics::FeaturePolicy3d, Features>;
using Link = physics::LinkPtr<physics::FeaturePolicy3d, Features>;

std::string shapeOf(int i)
{
    if (i % 3 == 1)
        return "<sphere><radius>0.25</radius></sphere>";
    if (i % 3 == 2)
        return "<cylinder><radius>0.25</radius><length>0.5</length></cylinder>";
    return "<box><size>0.5 0.5 0.5</size></box>";
}

std::string collisionOf(const std::string& shape)
{
    return "<collision name='collision'><geometry>" + shape + "</geometry></collision>";
}

/// A world whose first model is the floor.
std::string description()
{
    std::ostringstream text;
    text << "<sdf version='1.6'><world name='world'><model name='floor'><static>true</static>"
         << "<pose>0 0 -0.5 0 0 0</pose><link name='link'>"
         << collisionOf("<box><size>100 100 1</size></box>") << "</link></model>";
    for (int i = 0; i < 128; ++i)
    {
        const Place place(i);
        text << "<model name='thing" << i << "'><pose>" << place.x << ' ' << place.y << ' ' << place.z
             << " 0 0 0</pose><link name='link'><inertial><mass>1</mass><inertia><ixx>0.05</ixx>"
             << "<iyy>0.05</iyy><izz>0.05</izz></inertia></inertial>" << collisionOf(shapeOf(i))
             << "</link></model>";
    }
    text << "</world></sdf>";
    return text.str();
}

/// Model and link are created one after the other: the plug-in cannot return the links of a model created at once.
Link addModel(World& world, const sdf::Model& full)
{
    sdf::Model bare;
    bare.SetName(full.Name());
    bare.SetStatic(full.Static());
    bare.SetRawPose(full.RawPose());
    return world->ConstructModel(bare)->ConstructLink(*full.LinkByIndex(0));
}
}  // namespace

int main(int count, char** arguments)
{
    if (count != 2)
        return 2;
    ignition::plugin::Loader loader;
    loader.LoadLib(arguments[1]);
    auto engine = physics::RequestEngine<physics::FeaturePolicy3d, Features>::From(
        loader.Instantiate("ignition::physics::bullet::Plugin"));
    sdf::Root empty, full;
    empty.LoadSdfString("<sdf version='1.6'><world name='world'/></sdf>");
    full.LoadSdfString(description());
    World world = engine->ConstructWorld(*empty.WorldByIndex(0));
    std::vector<Link> links;
    for (std::uint64_t i = 0; i < full.WorldByIndex(0)->ModelCount(); ++i)
        links.push_back(addModel(world, *full.WorldByIndex(0)->ModelByIndex(i)));

    physics::ForwardStep::Input input;
    input.Get<std::chrono::steady_clock::duration>() = std::chrono::milliseconds(1);
    physics::ForwardStep::State state;
    physics::ForwardStep::Output output;
    for (int i = 0; i < 2000; ++i)
        world->Step(output, state, input);
    Result result;
    for (std::size_t i = 1; i < links.size(); ++i)
    {
        const Eigen::Vector3d at = links[i]->FrameDataRelativeToWorld().pose.translation();
        result.add(at.x(), at.y(), at.z());
    }
    result.print();
}
