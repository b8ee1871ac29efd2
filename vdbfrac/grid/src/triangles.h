// The triangles of a closed surface, what they cross, and on which side of them a point lies. Not installed.
#pragma once

#include <vdbfrac/base/triangle.h>
#include <vdbfrac/base/vec.h>

#include <openvdb/openvdb.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::grid {

/// Points are in voxels. Also what tools::meshToVolume asks a mesh for, which takes a minute to compile: voxelize() is
/// its one use.
struct Triangles {
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> corners;

    std::size_t polygonCount() const { return corners.size(); }
    std::size_t pointCount() const { return points.size(); }
    std::size_t vertexCount(std::size_t) const { return 3; }
    std::array<Vec3, 3> cornersOf(std::size_t n) const
    {
        return {points[corners[n][0]], points[corners[n][1]], points[corners[n][2]]};
    }
    void getIndexSpacePoint(std::size_t n, std::size_t v, openvdb::Vec3d& p) const
    {
        const Vec3& X = points[corners[n][v]];
        p = {X.x(), X.y(), X.z()};
    }
};

/// tools::meshToVolume: distances [m] within `halfWidth` voxels of the triangles, and which of them is the closest to
/// each voxel. Without removal of intersections and without renormalization.
struct Voxelized {
    openvdb::FloatGrid::Ptr phi;
    openvdb::Int32Grid::Ptr closest;
};
Voxelized voxelize(const Triangles& triangles, double voxelSize, float halfWidth);

/// Of a triangle among others.
ClosestPoint closestPoint(const Triangles& triangles, std::size_t triangle, const Vec3& X);

/// Boxes round the triangles in a binary tree, to find those that a short segment crosses. Triangles are in the order
/// of a Morton curve, so the tree has no pointers: node n has the children 2n and 2n + 1.
class TriangleTree {
public:
    explicit TriangleTree(const Triangles& triangles);

    struct Crossing {
        double t = 0;  ///< along the segment, 0 to 1
        std::uint32_t triangle = 0;
        bool alongNormal = false;  ///< does the segment go to where the corners run counter-clockwise?
    };
    /// Does the segment touch a triangle? When in doubt it does.
    bool isCrossed(const Vec3& from, const Vec3& to) const;
    /// All of them, from first to last. Those at an edge come once for each of its triangles.
    std::vector<Crossing> crossings(const Vec3& from, const Vec3& to) const;

private:
    struct Box {
        std::array<float, 3> lower, upper;
    };
    template <class Visit>
    void visitNear(const Vec3& from, const Vec3& to, const Visit& visit) const;
    void fill(const std::vector<std::uint64_t>& ordered);

    const Triangles& triangles_;
    std::vector<std::uint32_t> order_;
    std::vector<Box> nodes_;
    std::size_t firstLeaf_ = 1;
};

/// On which side of a surface a point lies, by the pseudonormal of its closest part: the normal of a face, the sum of
/// those of an edge's two faces, the sum of those of a corner's faces weighted with their angles. Exact for a surface
/// that does not cross itself. Baerentzen, Aanaes 2005, Signed distance computation using the angle weighted
/// pseudonormal, IEEE TVCG 11. Triangles that hang together by edges are a shell; the outside of each is where its
/// volume says, whatever the winding.
class TriangleSides {
public:
    explicit TriangleSides(const Triangles& triangles);

    enum class Side { inside, outside, unknown };
    /// Of the shell of the triangle closest to X. Unknown on the triangle, at edges without just two triangles, and
    /// where a triangle has no area or the shell no sides.
    Side sideOf(const Vec3& X, std::size_t triangle) const;
    /// Do the corners run counter-clockwise as seen from outside?
    bool isOutward(std::size_t triangle) const { return !turned_[triangle]; }
    bool hasSides(std::size_t triangle) const { return sound_[shell_[triangle]]; }

private:
    struct HalfEdge {
        std::uint64_t key = 0;  // its two points
        std::uint32_t number = 0;
    };
    std::vector<HalfEdge> halfEdges() const;
    void weldPoints();
    void measureFaces();
    void join(const std::vector<HalfEdge>& edges);
    void findShells(const std::vector<HalfEdge>& edges);
    void orientFrom(std::uint32_t seed, std::uint32_t shell);
    void turnOutward();
    void sumCorners();
    bool runsAlike(std::uint32_t halfEdge, std::uint32_t other) const;
    std::uint32_t startOf(std::uint32_t halfEdge) const
    {
        return point_[triangles_.corners[halfEdge / 3][halfEdge % 3]];
    }

    const Triangles& triangles_;
    std::vector<std::uint32_t> point_;              // of each point the first with its coordinates
    std::vector<Eigen::Vector3f> normal_, corner_;  // of each triangle, outward; of each point
    std::vector<std::uint32_t> twin_;               // of each half edge, when the edge has just two triangles
    std::vector<std::uint32_t> shell_;              // of each triangle
    std::vector<std::uint8_t> turned_, flat_, mixed_, sound_;  // of each triangle, triangle, point, shell
};

}  // namespace vdbfrac::grid
