// The lattices of multigrid, each with its elements and nodes where a test finds them.
#pragma once

#include "../../solver/src/coarsening.h"

#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/solid.h>

#include <array>
#include <numeric>
#include <utility>
#include <vector>

namespace vdbfrac::test {

using solver::ElementSet;

/// A lattice and those of twice its spacing after it, down to a few elements.
struct Hierarchy {
    std::vector<lab::Block> bodies;
    struct Level {
        std::vector<ElementSet> sets;
        std::size_t nodeCount = 0;
        solver::CoarseLattice coarser;  ///< empty on the last level
    };
    std::vector<Level> levels;

    explicit Hierarchy(std::vector<lab::Block> some) : bodies(std::move(some))
    {
        constexpr int kLevels = 4;
        Level top;
        for (const lab::Block& body : bodies) {
            top.sets.push_back({body.elements, body.nodes, std::uint32_t(top.nodeCount), lab::kGel});
            top.nodeCount += body.nodes.size();
        }
        levels.push_back(std::move(top));
        levels.reserve(kLevels);  // the sets of a level refer to the one before
        while (levels.size() < kLevels) {
            Level& fine = levels.back();
            fine.coarser = solver::coarsen(fine.sets, fine.nodeCount);
            Level next;
            next.sets = fine.coarser.elementSets();
            next.nodeCount = fine.coarser.nodeCount;
            levels.push_back(std::move(next));
        }
    }
};

struct Classes {
    std::vector<std::size_t> parent;
    explicit Classes(std::size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), std::size_t(0)); }
    std::size_t find(std::size_t i) const { return parent[i] == i ? i : find(parent[i]); }
    void join(std::size_t a, std::size_t b) { parent[find(a)] = find(b); }
};

/// Elements of a level, counted through its sets, in system node numbers.
struct View {
    struct Element {
        Coord cell;
        std::array<std::uint32_t, 8> node;
        std::array<bool, 8> used{};  ///< corners of tets with material
        double volume = 0;           ///< material, over that of a cell
        std::array<double, 6> tetVolume{};
        std::size_t set;
        tetmesh::CellShape shape;
    };
    std::vector<Element> elements;
    std::vector<Coord> at;  ///< of each node

    View(const std::vector<ElementSet>& sets, std::size_t nodeCount) : at(nodeCount)
    {
        for (std::size_t s = 0; s < sets.size(); ++s) {
            for (std::size_t n = 0; n < sets[s].nodes.size(); ++n) at[sets[s].firstNode + n] = sets[s].nodes[n];
            for (const auto& e : sets[s].elements) elements.push_back(element(sets[s], e, s));
        }
    }

private:
    Element element(const ElementSet& set, const tetmesh::CellElement& e, std::size_t s) const
    {
        Element out{{}, {}, {}, 0, {}, s, e.shape};
        const auto& tets = tetmesh::cellTets(e.shape);
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            if (!(e.fraction[t] > 0)) continue;
            out.tetVolume[t] = tets.volume[t] * e.fraction[t];
            out.volume += out.tetVolume[t];
            for (int c : tets.corner[t]) {
                out.used[std::size_t(c)] = true;
                out.cell = set.nodes[e.node[std::size_t(c)]] - Coord{c & 1, c >> 1 & 1, c >> 2 & 1};
            }
        }
        for (std::size_t c = 0; c < 8; ++c) out.node[c] = set.firstNode + e.node[c];
        return out;
    }
};

}  // namespace vdbfrac::test
