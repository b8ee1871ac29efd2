// Mean stresses of the material round voxel nodes. Not installed.
#pragma once

#include "node_values.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/tension.h>
#include <vdbfrac/tetmesh/nodes_around.h>

#include <Eigen/Eigenvalues>

#include <algorithm>

namespace vdbfrac::grid {

struct NodalStress {
    double volume = 0;      // voxels; 0 too where the material does not count
    Mat3 S = Mat3::Zero();  // Pa
    double tension = 0;     // <s1>^2 [Pa^2]
};

/// Stresses of the material round voxel nodes, each computed once.
class NodalStresses {
public:
    NodalStresses(const tetmesh::BodyMesh& mesh, const ElementStress& stress, const VoxelFilter& isCounted)
        : mesh_(mesh), stress_(stress), isCounted_(isCounted), nodes_(mesh.phi().lower(), mesh.phi().upper())
    {
    }

    void computeAround(std::span<const Coord> voxels, int reach)
    {
        std::vector<Coord> fresh = tetmesh::nodesAround(voxels, reach);
        keepIf(fresh,
               [&](const Coord& c) { return nodes_.contains(c) && !nodes_.find(c) && (!isCounted_ || isCounted_(c)); });
        nodes_.add(fresh);
        computeElements(fresh);
        parallelChunks(fresh.size(), 64, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) *nodes_.find(fresh[i]) = at(fresh[i]);
        });
    }
    /// Nothing of nodes that were not computed.
    const NodalStress& operator()(Coord c) const
    {
        static const NodalStress nothing;
        const NodalStress* node = nodes_.find(c);
        return node ? *node : nothing;
    }
    std::int64_t count() const { return std::int64_t(nodes_.size()); }

private:
    static constexpr std::uint32_t kUnseen = ~0u;

    void computeElements(const std::vector<Coord>& voxels)
    {
        if (voxels.empty()) return;
        if (number_.empty()) number_.assign(mesh_.elements().size(), kUnseen);
        const std::size_t known = ofElement_.size();
        std::vector<std::uint32_t> fresh;
        for (const std::uint32_t e : elementsRound(mesh_, voxels))
            if (number_[e] == kUnseen) number_[e] = std::uint32_t(known + fresh.size()), fresh.push_back(e);
        ofElement_.resize(known + fresh.size());
        parallelChunks(fresh.size(), 32, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) ofElement_[known + i] = stress_(fresh[i]);
        });
    }

    NodalStress at(Coord voxel) const
    {
        NodalStress node;
        mesh_.visitTets(voxel, [&](std::uint32_t e, int t, double part) {
            node.volume += part;
            node.S += part * ofElement_[number_[e]][std::size_t(t)];
        });
        if (node.volume == 0) return node;
        node.S /= node.volume;
        const double s =
            std::max(0., Eigen::SelfAdjointEigenSolver<Mat3>(node.S, Eigen::EigenvaluesOnly).eigenvalues()[2]);
        node.tension = s * s;
        return node;
    }

    const tetmesh::BodyMesh& mesh_;
    const ElementStress& stress_;
    const VoxelFilter& isCounted_;
    NodeValues<NodalStress> nodes_;
    std::vector<std::uint32_t> number_;  // by element, in ofElement_
    std::vector<std::array<Mat3, tetmesh::kMaxTets>> ofElement_;
};

}  // namespace vdbfrac::grid
