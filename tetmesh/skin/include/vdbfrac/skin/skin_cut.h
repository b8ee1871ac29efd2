// The outer surface of a body cut by its cracks, and the torn faces between.
//
// The outer surface S0 is any set of triangles; c comes from crack_field.h. Kept is S0 where c < 0; torn is c = 0
// inside S0, trimmed by it. Both use the same points along the rim, so what encloses material is closed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/skin/crack_field.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// Where the two sides of a crack are drawn: where they are simulated, which leaves a gap of a voxel or two, or both at
/// the middle of that gap, so that a crack opens from nothing.
enum class Lips { closed, asSimulated };

/// Roughness of torn faces that the simulation does not resolve.
struct TornDetail {
    double amplitude = 0;    ///< m; 0: none
    double size = 1;         ///< m, of its largest features
    std::uint64_t seed = 0;  ///< another one looks different
};

/// How cracks are drawn.
struct CrackStyle {
    Lips lips = Lips::closed;
    TornDetail detail;
};

/// What cracks have taken of the outer surface: let go, or kept, to be drawn until they come.
enum class Taken { dropped, kept };

struct SkinCut {
    /// What became of a triangle of the outer surface.
    enum class Fate : std::uint8_t { kept, gone, cut };
    static constexpr std::uint32_t kNoSkin = 0xffffffff;
    /// A point that the cut made.
    struct Point {
        Vec3 X = Vec3::Zero();         ///< m, at rest
        Coord anchor;                  ///< voxel node of the side of the crack that it belongs to
        std::uint32_t skin = kNoSkin;  ///< edge or triangle of the outer surface that the cut made it on
        bool onEdge = false;           ///< on an edge
        std::uint32_t on = kNoSkin;    ///< triangle of the outer surface that it lies on
    };
    /// A part of a triangle. Corners: points of the outer surface as given, then those of `points`.
    struct Part {
        std::uint32_t triangle = 0;
        std::array<std::uint32_t, 3> corner{};
    };
    CrackField cracks;
    std::vector<Coord> anchor;  ///< as Point::anchor, of each point that was given and is in no crack
    std::vector<Point> points;
    std::vector<Fate> fate;   ///< of each triangle
    std::vector<Part> parts;  ///< of triangles that were cut, by triangle
    /// The other parts of these, and triangles that are gone, by triangle, where they are kept. With lips closed they
    /// cover what is between them.
    std::vector<Part> taken;
    std::vector<std::array<std::uint32_t, 3>> torn;  ///< seen from the crack counter-clockwise; numbered alike
    std::int64_t mixedVoxels = 0;                    ///< that a crack's surface goes through
    std::int64_t specks = 0;                         ///< closed pieces, tiny or without material, that were taken out
    std::int64_t defects = 0;  ///< places where rounding left a gap; 0 unless the surface meets itself
};

struct SkinTopology;
struct Crossings;
class CrackLattice;

/// Cuts one surface again and again, as cracks grow.
class SkinCutter {
public:
    /// Triangles of `points` [m] with the material on their inner side; points with equal coordinates are one. `rest`:
    /// phi [m] of the body; dx: voxel size [m]; `isInParts`: it is several fragments at rest.
    SkinCutter(std::span<const Vec3> points, std::vector<std::array<std::uint32_t, 3>> triangles,
               const tetmesh::NodeField<float>& rest, double dx, bool isInParts = false);

    /// `rest`: as before. `fragment`: as crackField takes it. `now`: phi [m] at present, on the same box and nowhere
    /// below it.
    SkinCut cut(const tetmesh::NodeField<float>& rest, const tetmesh::NodeField<float>& now, const CrackStyle& style,
                const FragmentAt& fragment = {}, Taken taken = Taken::dropped) const;
    /// Of each point that was given a number less than their count, which those with equal coordinates share.
    std::span<const std::uint32_t> places() const;
    const SkinTopology& topology() const { return *topology_; }

private:
    std::vector<Coord> anchors(const CrackLattice& lattice) const;
    void divide(const Crossings& crossings, std::span<const std::uint8_t> isOpen, SkinCut& cut) const;

    std::vector<std::array<std::uint32_t, 3>> triangles_;
    std::shared_ptr<const SkinTopology> topology_;
    std::vector<std::uint8_t> isInner_;  // of each triangle: it lies in the material, not on its surface
    std::vector<Coord> between_;         // nodes between parts that are apart at rest
    double dx_;
    double offset_ = 0;  // m: how far the surface lies from that of phi, at most
};

}  // namespace vdbfrac::skin
