#include <vdbfrac/skin/skin.h>

#include "skin_corners.h"
#include "touching_lips.h"
#include "turned_normals.h"
#include "winding.h"

#include <vdbfrac/skin/riders.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <algorithm>
#include <map>
#include <utility>

namespace vdbfrac::skin {

namespace {

using tetmesh::RenderMesh;
constexpr std::uint32_t kNone = RenderMesh::kNone;

std::vector<std::array<std::uint32_t, 3>> trianglesOf(const RenderMesh& mesh, const tetmesh::Fans& fans)
{
    std::vector<std::array<std::uint32_t, 3>> triangles;
    triangles.reserve(fans.corners.size());
    for (const auto& c : fans.corners)
        triangles.push_back({mesh.corners[c[0]].point, mesh.corners[c[1]].point, mesh.corners[c[2]].point});
    return triangles;
}

/// Each normal of one point only, so that it can turn with it.
void partNormals(RenderMesh& mesh)
{
    struct Copy {
        std::uint32_t point = kNone, number = 0;
    };
    std::vector<Copy> first(mesh.normals.size());                              // most normals are of one point anyway
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> further;  // by normal and point
    std::vector<Vec3> normals;
    for (RenderMesh::Corner& c : mesh.corners) {
        if (c.normal == kNone) continue;
        const Vec3& normal = mesh.normals[c.normal];
        const auto next = std::uint32_t(normals.size());
        Copy& copy = first[c.normal];
        if (copy.point == kNone) copy = {c.point, next};
        const std::uint32_t number =
            copy.point == c.point ? copy.number : further.try_emplace({c.normal, c.point}, next).first->second;
        if (number == next) normals.push_back(normal);
        c.normal = number;
    }
    mesh.normals = std::move(normals);
}

/// Puts the faces of a frame together.
class Drawer {
public:
    Drawer(const GivenSkin& skin, std::span<const std::uint8_t> isSeam, const SkinCut& cut)
        : mesh_(skin.mesh),
          fans_(skin.fans),
          cut_(cut),
          now_(drawn.mesh),
          corners_(skin, isSeam, cut.points, drawn.mesh)
    {
        now_ = mesh_;
        now_.corners.clear(), now_.faceEnd.clear(), now_.group.clear(), now_.material.clear();
        for (const SkinCut::Point& p : cut.points) now_.points.push_back(p.X);
        addKept();
        addParts(cut.parts);
        drawn.taken[0] = std::uint32_t(now_.faces());
        addParts(cut.taken);
        drawn.taken[1] = std::uint32_t(now_.faces());
        givenNormals = now_.normals.size();
        addTorn();
    }

    tetmesh::DrawnTopology drawn;
    std::size_t givenNormals = 0;

private:
    using Corner = RenderMesh::Corner;

    void addFace(std::span<const Corner> corners, std::uint32_t like, bool torn)
    {
        now_.addFace(corners, like == kNone ? kNone : mesh_.group[like], like == kNone ? kNone : mesh_.material[like]);
        drawn.torn.push_back(torn);
    }
    Corner given(std::size_t triangle, std::size_t k) const { return mesh_.corners[fans_.corners[triangle][k]]; }

    /// Faces as they were given, and of those that a crack meets the triangles that it leaves whole.
    void addKept()
    {
        const auto isKept = [&](std::size_t t) { return cut_.fate[t] == SkinCut::Fate::kept; };
        for (std::size_t t = 0, end = 0; t < fans_.face.size(); t = end) {
            const std::uint32_t f = fans_.face[t];
            bool whole = true;
            for (end = t; end < fans_.face.size() && fans_.face[end] == f; ++end) whole = whole && isKept(end);
            if (whole) addFace(mesh_.face(f), f, false);
            for (std::size_t i = t; i < end && !whole; ++i)
                if (isKept(i)) addFace(std::array{given(i, 0), given(i, 1), given(i, 2)}, f, false);
        }
    }

    void addParts(std::span<const SkinCut::Part> parts)
    {
        const auto corners = corners_.of(parts);
        for (std::size_t i = 0; i < parts.size(); ++i) addFace(corners[i], fans_.face[parts[i].triangle], false);
    }

    /// Torn faces have the place at rest as texture coordinates, and normals where the surface has any.
    void addTorn()
    {
        std::vector<std::uint32_t> corner(now_.points.size(), kNone);
        std::uint32_t count = 0;
        const std::size_t firstUv = now_.uvs.size(), firstNormal = now_.normals.size();
        for (const auto& t : cut_.torn) {
            std::array<Corner, 3> corners;
            for (std::size_t k = 0; k < 3; ++k) {
                if (corner[t[k]] == kNone) {
                    corner[t[k]] = count++;
                    now_.uvs.push_back(now_.points[t[k]]);
                    if (!mesh_.normals.empty()) now_.normals.push_back(Vec3::Zero());
                }
                corners[k] = {t[k], std::uint32_t(firstUv + corner[t[k]]),
                              mesh_.normals.empty() ? kNone : std::uint32_t(firstNormal + corner[t[k]])};
            }
            addFace(corners, kNone, true);
        }
    }

    const RenderMesh& mesh_;
    const tetmesh::Fans& fans_;
    const SkinCut& cut_;
    RenderMesh& now_;
    SkinCorners corners_;
};

/// Lips that are closed would still be drawn where nothing is left to carry them.
void takeAll(SkinCut& cut)
{
    std::ranges::fill(cut.fate, SkinCut::Fate::gone);
    cut.parts.clear(), cut.taken.clear(), cut.torn.clear();
}

}  // namespace

Skin::Skin(RenderMesh mesh, const tetmesh::BodyMesh& body, const CrackStyle& style, bool isInParts)
    : style_(style),
      mesh_(woundOutward(std::move(mesh), body)),
      fans_(tetmesh::fansOf(mesh_)),
      cutter_(mesh_.points, trianglesOf(mesh_, fans_), body.restPhi(), body.voxelSize(), isInParts)
{
    partNormals(mesh_);
    isSeam_ = seamsOf({cutter_.topology(), mesh_, fans_});
}

void Skin::follow(const tetmesh::BodyMesh& body, std::span<const std::uint32_t> fragmentOfNode, Taken taken)
{
    const FragmentAt fragment = fragmentsAt(body, fragmentOfNode);
    SkinCut cut = cutter_.cut(body.restPhi(), body.phi(), style_, fragment, taken);
    if (body.elements().empty()) takeAll(cut);
    Drawer drawer({cutter_.topology(), mesh_, fans_}, isSeam_, cut);
    work_ = {
        cut.mixedVoxels, std::int64_t(cut.parts.size()), std::int64_t(cut.torn.size()), cut.specks, cut.defects, 0, 0};
    givenNormals_ = drawer.givenNormals;
    embed({body, cut, drawer.drawn, fragment, fragmentOfNode});
    tetmesh::DrawnTopology& drawn = drawer.drawn;
    drawn.fragment.reserve(drawn.mesh.faces());
    const auto fragmentAt = [&](const RenderMesh::Corner& c) { return fragmentOfNode[points_[c.point].node[0]]; };
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
        const auto corners = drawn.mesh.face(f);
        drawn.fragment.push_back(fragmentAt(corners[0]));
        const auto isOwn = [&](const RenderMesh::Corner& c) { return fragmentAt(c) == drawn.fragment.back(); };
        work_.bridges += !drawn.isTaken(f) && !std::ranges::all_of(corners, isOwn);
    }
    given_ = std::make_shared<const TurnedNormals>(drawn, givenNormals_, cutter_.places());
    if (style_.lips == Lips::closed)
        lips_ = std::make_shared<const TouchingLips>(drawn, cutter_.places(), body.voxelSize());
    drawn_ = std::make_shared<const tetmesh::DrawnTopology>(std::move(drawn));
}

/// Finds what carries the points that faces use.
void Skin::embed(const Embedding& what)
{
    const auto& [body, cut, drawn, fragment, fragmentOfNode] = what;
    std::vector<std::uint8_t> isUsed(drawn.mesh.points.size(), 0);
    for (const RenderMesh::Corner& c : drawn.mesh.corners) isUsed[c.point] = 1;
    // Given points at one place, as along seams and hard edges, move as one.
    std::vector<Rider> riders;
    std::vector<std::uint32_t> riderOf(isUsed.size(), kNone), riderAt(mesh_.points.size(), kNone);
    const std::size_t given = mesh_.points.size();
    for (std::uint32_t p = 0; p < isUsed.size(); ++p) {
        if (!isUsed[p]) continue;
        std::uint32_t& rider = p < given ? riderAt[cutter_.places()[p]] : riderOf[p];
        if (rider == kNone) {
            rider = std::uint32_t(riders.size());
            riders.push_back({drawn.mesh.points[p], p < given ? cut.anchor[p] : cut.points[p - given].anchor});
        }
        riderOf[p] = rider;
    }
    const Embedded embedded = embedRiders(body, cut.cracks, riders, fragment, fragmentOfNode);
    work_.far = embedded.far;
    outside_ = MeanMotion(body, cut.cracks, riders, embedded, fragment, fragmentOfNode);
    std::vector<std::uint32_t> numberOf(riders.size(), kNone);
    for (std::uint32_t n = 0; n < outside_.points().size(); ++n) numberOf[outside_.points()[n].rider] = n;
    points_.assign(isUsed.size(), {});
    outsidePoint_.clear();
    for (std::uint32_t p = 0; p < isUsed.size(); ++p) {
        if (riderOf[p] == kNone) continue;
        points_[p] = embedded.points[riderOf[p]];
        if (numberOf[riderOf[p]] != kNone) outsidePoint_.push_back({p, numberOf[riderOf[p]]});
    }
    outside_.evenOut(outsideEdges(drawn));
}

/// The edges of faces that join points outside of their tets, by their numbers in outside_. Faces that cracks have
/// taken join sides that part.
std::vector<std::array<std::uint32_t, 2>> Skin::outsideEdges(const tetmesh::DrawnTopology& drawn) const
{
    std::vector<std::uint32_t> number(drawn.mesh.points.size(), kNone);
    for (const auto& [point, own] : outsidePoint_) number[point] = own;
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
        if (drawn.isTaken(f)) continue;
        const auto corners = drawn.mesh.face(f);
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const std::uint32_t a = number[corners[k].point], b = number[corners[(k + 1) % corners.size()].point];
            if (a != kNone && b != kNone && a != b) edges.push_back({a, b});
        }
    }
    return edges;
}

std::vector<Vec3> Skin::carried(std::span<const Vec3> ofNodes) const
{
    std::vector<Vec3> at(points_.size(), Vec3::Zero());
    if (ofNodes.empty()) return at;  // all of the body is gone
    parallelChunks(at.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) at[i] = points_[i].at(ofNodes);
    });
    const std::vector<Vec3> outside = outside_.at(ofNodes);
    for (const auto& [point, number] : outsidePoint_)
        at[point] += outside_.points()[number].share * (outside[number] - at[point]);
    return at;
}

void Skin::partLips(std::span<Vec3> points, std::span<Vec3> velocity) const
{
    if (lips_) lips_->part(points, velocity);
}

std::vector<OutsidePoint> Skin::outside() const
{
    std::vector<OutsidePoint> all;
    for (const auto& [point, number] : outsidePoint_) {
        const MeanMotion::Point& p = outside_.points()[number];
        all.push_back({point, p.X, p.distance});
    }
    return all;
}

std::vector<Vec3> Skin::normals(std::span<const Vec3> points) const
{
    const RenderMesh& mesh = drawn_->mesh;
    std::vector<Vec3> normals(mesh.normals.size(), Vec3::Zero());
    given_->turn(mesh, points, normals);
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        if (!drawn_->torn[f] || normals.empty()) continue;
        const auto c = mesh.face(f);
        const Vec3 area = (points[c[1].point] - points[c[0].point]).cross(points[c[2].point] - points[c[0].point]);
        for (const RenderMesh::Corner& corner : c) normals[corner.normal] += area;
    }
    for (std::size_t n = givenNormals_; n < normals.size(); ++n) normals[n].stableNormalize();
    for (Vec3& n : normals)
        if (n.isZero()) n = Vec3::UnitY();  // of faces without area
    return normals;
}

}  // namespace vdbfrac::skin
