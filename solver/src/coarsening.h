// A lattice of twice the spacing, made of what there is on the finer one. Not installed.
//
// A coarse cell stands over 2^3 finer ones. The finer elements in it that hang together by nodes make one coarse
// element, so a crack that parts them gives two, with corners of their own; and two coarse elements share a corner only
// where a finer node that both have takes its value from it. So cracks do not couple on any level. Values go from
// coarse to fine linearly along the edges of the Kuhn tets: the finer node at p takes the mean of the coarse nodes at
// floor(p / 2) and ceil(p / 2), which are one for even p. On six-tet lattices these spaces are nested.
#pragma once

#include <vdbfrac/solver/elastic_operator.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::solver {

struct CoarseLattice {
    struct Set {
        std::vector<tetmesh::CellElement> elements;
        std::vector<Coord> nodes;
        std::uint32_t firstNode = 0;
        Material material;
    };
    std::vector<Set> sets;
    std::size_t nodeCount = 0;
    std::vector<std::array<std::uint32_t, 2>> parents;  ///< coarse nodes of each finer node; equal where they coincide
    FinerElements finer;

    std::vector<ElementSet> elementSets() const;
};

/// `nodeCount`: of the finer lattice.
CoarseLattice coarsen(std::span<const ElementSet> sets, std::size_t nodeCount);

}  // namespace vdbfrac::solver
