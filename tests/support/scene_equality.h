// Scenes that have to be equal, key by key.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/scene/scene.h>

#include <gtest/gtest.h>

#include <variant>
#include <vector>

namespace vdbfrac::test {

inline void expectEqual(const Primitive& a, const Primitive& b)
{
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.center, b.center);
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.rotate, b.rotate);
    EXPECT_EQ(a.axis, b.axis);
    EXPECT_EQ(a.radius, b.radius);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.tube, b.tube);
    EXPECT_EQ(a.offset, b.offset);
}

inline void expectEqual(const std::vector<Primitive>& a, const std::vector<Primitive>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) expectEqual(a[i], b[i]);
}

inline void expectEqual(const decltype(scene::Body::shape)& a, const decltype(scene::Body::shape)& b)
{
    ASSERT_EQ(a.index(), b.index());
    if (const auto* solid = std::get_if<Primitive>(&a)) expectEqual(*solid, std::get<Primitive>(b));
    if (const auto* mesh = std::get_if<scene::MeshFile>(&a)) {
        const scene::MeshFile& other = std::get<scene::MeshFile>(b);
        EXPECT_EQ(mesh->file, other.file);
        EXPECT_EQ(mesh->scale, other.scale);
        EXPECT_EQ(mesh->rotate, other.rotate);
        EXPECT_EQ(mesh->translate, other.translate);
    }
    if (const auto* vdb = std::get_if<scene::VdbFile>(&a)) {
        const scene::VdbFile& other = std::get<scene::VdbFile>(b);
        EXPECT_EQ(vdb->file, other.file);
        EXPECT_EQ(vdb->grid, other.grid);
        EXPECT_EQ(vdb->scale, other.scale);
        EXPECT_EQ(vdb->rotate, other.rotate);
        EXPECT_EQ(vdb->translate, other.translate);
    }
}

inline void expectEqual(const scene::Body& a, const scene::Body& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.material, b.material);
    EXPECT_EQ(a.velocity, b.velocity);
    EXPECT_EQ(a.angularVelocity, b.angularVelocity);
    expectEqual(a.add, b.add);
    expectEqual(a.cut, b.cut);
    expectEqual(a.shape, b.shape);
}

/// Of a grip or a collider.
template <class Motion>
void expectEqualMotion(const Motion& a, const Motion& b)
{
    ASSERT_EQ(a.index(), b.index());
    if (const auto* m = std::get_if<scene::Velocity>(&a)) {
        EXPECT_EQ(m->velocity, std::get<scene::Velocity>(b).velocity);
    }
    if (const auto* m = std::get_if<scene::Keys>(&a)) {
        const scene::Keys& other = std::get<scene::Keys>(b);
        EXPECT_EQ(m->pivot, other.pivot);
        EXPECT_EQ(m->isSmooth, other.isSmooth);
        ASSERT_EQ(m->keys.size(), other.keys.size());
        for (std::size_t i = 0; i < m->keys.size(); ++i) {
            EXPECT_EQ(m->keys[i].time, other.keys[i].time);
            EXPECT_EQ(m->keys[i].translate, other.keys[i].translate);
            EXPECT_EQ(m->keys[i].rotate, other.keys[i].rotate);
        }
    }
}

inline void expectEqual(const scene::Grip& a, const scene::Grip& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.body, b.body);
    expectEqual(a.region, b.region);
    expectEqualMotion(a.move, b.move);
    if (const auto* m = std::get_if<scene::Force>(&a.move)) {
        EXPECT_EQ(m->force, std::get<scene::Force>(b.move).force);
        EXPECT_EQ(m->ramp, std::get<scene::Force>(b.move).ramp);
    }
}

inline void expectEqual(const scene::Collider& a, const scene::Collider& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.friction, b.friction);
    expectEqual(a.shape, b.shape);
    expectEqualMotion(a.move, b.move);
}

inline void expectEqualSettings(const scene::Scene& a, const scene::Scene& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.time.firstFrame, b.time.firstFrame);
    EXPECT_EQ(a.time.lastFrame, b.time.lastFrame);
    EXPECT_EQ(a.time.fps, b.time.fps);
    EXPECT_EQ(a.time.substeps, b.time.substeps);
    EXPECT_EQ(a.time.nodeCfl, b.time.nodeCfl);
    EXPECT_EQ(a.time.frontCfl, b.time.frontCfl);
    EXPECT_EQ(a.grid.voxelSize, b.grid.voxelSize);
    EXPECT_EQ(a.grid.lattice, b.grid.lattice);
    EXPECT_EQ(a.grid.coarsening, b.grid.coarsening);
    EXPECT_EQ(a.grid.halfWidth, b.grid.halfWidth);
    EXPECT_EQ(a.grid.grading, b.grid.grading);
    EXPECT_EQ(a.solver.newtonTolerance, b.solver.newtonTolerance);
    EXPECT_EQ(a.solver.newtonIterations, b.solver.newtonIterations);
    EXPECT_EQ(a.solver.linearSolver, b.solver.linearSolver);
    EXPECT_EQ(a.solver.linearTolerance, b.solver.linearTolerance);
    EXPECT_EQ(a.solver.linearIterations, b.solver.linearIterations);
    EXPECT_EQ(a.solver.cellDilation, b.solver.cellDilation);
    EXPECT_EQ(a.solver.integrator, b.solver.integrator);
    EXPECT_EQ(a.solver.strain, b.solver.strain);
    EXPECT_EQ(a.solver.tangent, b.solver.tangent);
    EXPECT_EQ(a.solver.precision, b.solver.precision);
    EXPECT_EQ(a.grid.wholeTets, b.grid.wholeTets);
    EXPECT_EQ(a.output.vdb, b.output.vdb);
    EXPECT_EQ(a.output.obj, b.output.obj);
}

inline void expectEqual(const std::vector<scene::NamedValues>& a, const std::vector<scene::NamedValues>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].name, b[i].name);
        EXPECT_TRUE(a[i].values == b[i].values) << a[i].name;
    }
}

/// All but the places, which belong to the text.
inline void expectEqual(const scene::Scene& a, const scene::Scene& b)
{
    expectEqualSettings(a, b);
    ASSERT_EQ(a.bodies.size(), b.bodies.size());
    for (std::size_t i = 0; i < a.bodies.size(); ++i) expectEqual(a.bodies[i], b.bodies[i]);
    ASSERT_EQ(a.grips.size(), b.grips.size());
    for (std::size_t i = 0; i < a.grips.size(); ++i) expectEqual(a.grips[i], b.grips[i]);
    ASSERT_EQ(a.colliders.size(), b.colliders.size());
    for (std::size_t i = 0; i < a.colliders.size(); ++i) expectEqual(a.colliders[i], b.colliders[i]);
    ASSERT_EQ(a.materials.size(), b.materials.size());
    for (std::size_t i = 0; i < a.materials.size(); ++i) {
        EXPECT_EQ(a.materials[i].name, b.materials[i].name);
        EXPECT_EQ(a.materials[i].youngsModulus, b.materials[i].youngsModulus);
        EXPECT_EQ(a.materials[i].poissonRatio, b.materials[i].poissonRatio);
        EXPECT_EQ(a.materials[i].density, b.materials[i].density);
        EXPECT_EQ(a.materials[i].colour, b.materials[i].colour);
        EXPECT_EQ(a.materials[i].tornColour, b.materials[i].tornColour);
    }
    expectEqual(a.tables, b.tables);
    expectEqual(a.notes, b.notes);
}

}  // namespace vdbfrac::test
