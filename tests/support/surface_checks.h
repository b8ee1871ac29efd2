// What every surface of a cut mesh has to be: closed, oriented, and round the material.
#pragma once

#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/surface_measures.h>

#include <gtest/gtest.h>

namespace vdbfrac::test {

/// Every directed edge of the surface has exactly one triangle, and its reverse exactly one other.
inline void expectClosed(const tetmesh::BodyMesh& mesh)
{
    const auto surface = mesh.surface();
    const lab::BadEdges bad = lab::badEdges(surface);
    EXPECT_EQ(bad.open, 0u) << "edges whose faces do not match";
    EXPECT_EQ(bad.crowded, 0u) << "edges with more than two faces";
    EXPECT_EQ(surface.torn.size(), surface.triangles.size());
}

}  // namespace vdbfrac::test
