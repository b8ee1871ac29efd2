// Solids cut by each kind of lattice.
#pragma once

#include "mesh_checks.h"

#include <vdbfrac/lab/samples/block.h>

#include <gtest/gtest.h>

#include <string>

namespace vdbfrac::test {

class Lattices : public testing::TestWithParam<tetmesh::Lattice> {
protected:
    static constexpr double dx = 0.1;
    tetmesh::CutMesh cut(int reach, const Phi& phi) const
    {
        return {GetParam(), lab::sample({-reach, -reach, -reach}, {reach, reach, reach}, dx, phi)};
    }
};

inline const auto kLattices = testing::Values(
    tetmesh::Lattice{tetmesh::Lattice::Kind::six, 1, 0.1}, tetmesh::Lattice{tetmesh::Lattice::Kind::six, 2, 0.1},
    tetmesh::Lattice{tetmesh::Lattice::Kind::six, 3, 0.1}, tetmesh::Lattice{tetmesh::Lattice::Kind::five, 1, 0.1});

inline std::string nameOfLattice(const testing::TestParamInfo<tetmesh::Lattice>& info)
{
    const tetmesh::Lattice& lattice = info.param;
    return (lattice.kind == tetmesh::Lattice::Kind::six ? "six" : "five") + std::to_string(lattice.coarsening);
}

}  // namespace vdbfrac::test
