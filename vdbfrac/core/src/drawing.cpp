#include <vdbfrac/core/drawing.h>

#include "drawn_materials.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/level_set_surface.h>
#include <vdbfrac/solids/solid_mesh.h>
#include <vdbfrac/tetmesh/winding.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace vdbfrac::core {

void moveMesh(tetmesh::RenderMesh& mesh, const scene::FilePlace& place)
{
    for (Vec3& X : mesh.points) X = place(X);
    for (Vec3& n : mesh.normals) n = place.turn * n;
}

namespace {

/// A mesh as it is read, where the scene places it.
tetmesh::RenderMesh placedMesh(const scene::MeshFile& file)
{
    tetmesh::RenderMesh mesh = tetmesh::readRenderMesh(file.file);
    moveMesh(mesh, scene::placeOf(file));
    return mesh;
}

/// The level set's own surface, for bodies that have no other.
tetmesh::RenderMesh levelSetMesh(const grid::LevelSet& phi)
{
    constexpr double kCrease = 60;  // degrees: edges are rounded on voxels
    tetmesh::RenderMesh mesh = tetmesh::drawnTopology(grid::surfaceOf(phi, 0)).mesh;
    tetmesh::setNormals(mesh, kCrease);
    return mesh;
}

/// A mesh as it can be torn: faces run one way, and shells that reach into each other are one.
tetmesh::RenderMesh tearable(tetmesh::RenderMesh mesh, const std::string& body, double edge,
                             std::vector<std::string>& notes)
{
    const std::size_t turned = tetmesh::windShells(mesh);
    const std::string own = "the mesh for body '" + body + "'";
    if (turned > 0)
        notes.push_back(own + " has " + std::to_string(turned) + " of " + std::to_string(mesh.faces()) +
                        " faces that look inward: they are turned");
    const auto bare = std::ranges::count(mesh.corners, tetmesh::RenderMesh::kNone, &tetmesh::RenderMesh::Corner::uv);
    if (!mesh.uvs.empty() && bare > 0)
        notes.push_back(own + " has " + std::to_string(bare) + " of " + std::to_string(mesh.corners.size()) +
                        " corners of faces without texture coordinates");
    solids::UnitedMesh united = solids::unitedMesh(mesh, edge);
    if (united.shells == 0) return mesh;
    const std::string shells =
        std::to_string(united.shells) + " shells that reach into each other or lie in each other";
    if (!united.mesh) {
        notes.push_back(own + " has " + shells +
                        "; they cannot be made one, as they meet themselves: torn faces may have gaps there");
        return mesh;
    }
    notes.push_back(own + " has " + shells + ": they are drawn as one, without what is inside");
    return std::move(*united.mesh);
}

/// A drawn mesh with what the scene adds to the body and without what it cuts from it; none where that cannot be had.
std::optional<tetmesh::RenderMesh> carved(tetmesh::RenderMesh mesh, const scene::Body& spec, double edge)
{
    if (spec.add.empty() && spec.cut.empty()) return mesh;
    return solids::carvedMesh(mesh, {spec.add, spec.cut}, edge);
}
constexpr const char* kCarvable =
    "a closed mesh that does not meet itself near the solids that the scene adds to or cuts from the body";

tetmesh::RenderMesh outerSurface(const scene::Body& spec, const Body& body, std::vector<std::string>& notes)
{
    const double edge = body.phi.voxelSize();
    if (const auto* file = std::get_if<scene::MeshFile>(&spec.shape)) {
        if (auto mesh = carved(tearable(placedMesh(*file), body.name, edge, notes), spec, edge))
            return std::move(*mesh);
        notes.push_back("body '" + body.name +
                        "' is drawn as its level set, without texture coordinates: its own mesh would have to be " +
                        kCarvable);
    }
    if (const auto* solid = std::get_if<Primitive>(&spec.shape))
        if (auto mesh = solids::solidMesh(*solid, {spec.add, spec.cut}, edge)) return std::move(*mesh);
    return levelSetMesh(body.phi);
}

/// Edges of the triangles of a solid in pictures [m]: their number does not depend on the grid.
double pictureEdge(const Primitive& solid)
{
    constexpr double kRound = 8, kLong = 256;  // edges to the smallest radius, and to the largest size
    const Bounds box = bounds(solid);
    const double size = (box.upper - box.lower).maxCoeff();
    if (solid.kind == Primitive::Kind::box) return size;
    return std::max((solid.kind == Primitive::Kind::torus ? solid.tube : solid.radius) / kRound, size / kLong);
}

}  // namespace

tetmesh::RenderMesh surfaceOf(const scene::Collider& collider, const scene::Grid& grid)
{
    constexpr double kLong = 40;  // radii of a cylinder
    if (const auto* file = std::get_if<scene::MeshFile>(&collider.shape)) return placedMesh(*file);
    if (const auto* solid = std::get_if<Primitive>(&collider.shape)) {
        Primitive shape = *solid;
        if (shape.kind == Primitive::Kind::halfspace) return {};
        if (shape.kind == Primitive::Kind::cylinder && shape.height == 0) shape.height = kLong * shape.radius;
        if (auto mesh = solids::solidMesh(shape, {}, pictureEdge(shape))) return std::move(*mesh);
        return {};
    }
    return levelSetMesh(grid::makeLevelSet(collider, grid, ~std::uint64_t{0}));
}

namespace {

/// Frames have materials of these names: "outside" is none, and "inside" are torn faces.
tetmesh::RenderMesh withOwnNames(tetmesh::RenderMesh mesh, const std::string& body, std::vector<std::string>& notes)
{
    for (const char* name : {"outside", "inside"}) {
        const auto found = std::ranges::find(mesh.materials, name);
        if (found == mesh.materials.end()) continue;
        const auto number = std::uint32_t(found - mesh.materials.begin());
        const auto count = std::ranges::count(mesh.material, number);
        std::ranges::replace(mesh.material, number, tetmesh::RenderMesh::kNone);
        if (count > 0 && *found == "inside")
            notes.push_back("the mesh for body '" + body + "' has " + std::to_string(count) +
                            " faces of a material 'inside', the name of torn faces in frames: they count as faces "
                            "without a material");
    }
    return mesh;
}

skin::CrackStyle styleOf(const scene::Scene& scene)
{
    const scene::Output& output = scene.output;
    return {output.lipsClosed ? skin::Lips::closed : skin::Lips::asSimulated,
            {output.tornDetail, output.tornDetailSize > 0 ? output.tornDetailSize : 3 * scene.grid.voxelSize,
             std::uint64_t(output.tornDetailSeed)}};
}

bool isInParts(const Body& body)
{
    const auto isOld = [](const tetmesh::Fragment& f) { return f.parent < 0; };
    return std::ranges::count_if(body.fragments.fragments(), isOld) > 1;
}

}  // namespace

Drawing::Drawing(const scene::Scene& scene, const Simulation& simulation)
    : materials_(std::make_shared<DrawnMaterials>())
{
    std::vector<tetmesh::RenderMesh> meshes;
    renamed_.resize(scene.bodies.size());
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const Body& body = simulation.bodies()[b];
        meshes.push_back(withOwnNames(outerSurface(scene.bodies[b], body, notes_), body.name, notes_));
        if (const auto* file = std::get_if<scene::MeshFile>(&scene.bodies[b].shape))
            renamed_[b] = materials_->add(meshes.back(), file->file.parent_path(), body.name, notes_);
    }
    for (const scene::Material& m : scene.materials) {
        if (m.hasColour()) colours_[m.name] = materials_->ofScene(tetmesh::mtlMaterial(m.name, m.colour));
        if (m.hasTornColour()) tornColours_[m.name] = materials_->ofScene(tetmesh::tornMaterial(m.name, m.tornColour));
    }
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const Body& body = simulation.bodies()[b];
        nameMaterials(scene, b, meshes[b]);
        surfaces_.push_back({skin::Skin(std::move(meshes[b]), *body.mesh, styleOf(scene), isInParts(body))});
    }
}

/// Gives the materials of a body's mesh the names that frames have for them. Faces without one have that of the body,
/// if it has a colour, and torn faces if it has one for them.
void Drawing::nameMaterials(const scene::Scene& scene, std::size_t body, tetmesh::RenderMesh& mesh) const
{
    for (std::string& name : mesh.materials)
        if (const auto other = renamed_[body].find(name); other != renamed_[body].end()) name = other->second;
    const std::string& material = scene.materialOf(scene.bodies[body]).name;
    if (const auto torn = tornColours_.find(material); torn != tornColours_.end()) mesh.torn = torn->second;
    const auto colour = colours_.find(material);
    if (colour == colours_.end()) return;
    const auto own = std::uint32_t(mesh.materials.size());
    mesh.materials.push_back(colour->second);
    std::ranges::replace(mesh.material, tetmesh::RenderMesh::kNone, own);
}

void Drawing::replace(const scene::Scene& scene, const Simulation& simulation, std::size_t body,
                      tetmesh::RenderMesh mesh, const std::filesystem::path& folder)
{
    const Body& own = simulation.bodies()[body];
    const double edge = own.phi.voxelSize();
    renamed_[body] = materials_->add(mesh, folder, own.name, notes_);
    mesh = tearable(withOwnNames(std::move(mesh), own.name, notes_), own.name, edge, notes_);
    auto whole = carved(std::move(mesh), scene.bodies[body], edge);
    if (!whole) throw InputError({"the mesh for body '" + own.name + "'", "cannot be drawn", kCarvable, ""});
    nameMaterials(scene, body, *whole);
    surfaces_[body] = {skin::Skin(std::move(*whole), *own.mesh, styleOf(scene), isInParts(own))};
}

const std::vector<std::filesystem::path>& Drawing::materialFiles() const { return materials_->files(); }

const std::string& Drawing::materials() const { return materials_->text(); }

void Drawing::follow(const Simulation& simulation, Ledger& work)
{
    for (std::size_t b = 0; b < surfaces_.size(); ++b)
        if (const Body& body = simulation.bodies()[b]; surfaces_[b].revision != body.revision)
            cut(body, skin::Taken::dropped, surfaces_[b], work);
}

void Drawing::followWhole(const Simulation& simulation, Ledger& work)
{
    for (std::size_t b = 0; b < surfaces_.size(); ++b)
        cut(simulation.bodies()[b], skin::Taken::kept, surfaces_[b], work);
}

void Drawing::cut(const Body& body, skin::Taken taken, Surface& surface, Ledger& work)
{
    surface.skin.follow(*body.mesh, body.fragments.ofNode(), taken);
    surface.revision = body.revision;
    const skin::SkinWork& done = surface.skin.work();
    work.count("draw", "mixed_voxels", done.mixedVoxels);
    work.count("draw", "cut_faces", done.cutFaces);
    work.count("draw", "torn_faces", done.tornFaces);
    work.count("draw", "specks", done.specks);
    work.count("draw", "defects", done.defects);
    work.count("draw", "far_points", done.far);
    work.count("draw", "bridges", done.bridges);
}

DrawnBody Drawing::body(std::size_t body, std::span<const Vec3> x, std::span<const Vec3> v) const
{
    const skin::Skin& skin = surfaces_[body].skin;
    return {skin.topology(), skin.carried(x), {}, skin.carried(v)};
}

void Drawing::finish(const Stages& stages, double time, DrawnFrame& frame) const
{
    for (std::size_t b = 0; b < frame.size(); ++b) surfaces_[b].skin.partLips(frame[b].points, frame[b].velocity);
    if (!stages.draw.empty()) {
        std::vector<std::vector<std::uint32_t>> used;
        std::vector<std::vector<std::uint8_t>> isMoved;
        for (const DrawnBody& body : frame) {
            used.push_back(tetmesh::usedPoints(body.topology->mesh));
            isMoved.emplace_back(body.points.size(), 0);
        }
        std::vector<DrawnSurface> surfaces;
        for (std::size_t b = 0; b < frame.size(); ++b)
            surfaces.push_back({*frame[b].topology, used[b], frame[b].points, frame[b].velocity, isMoved[b]});
        for (const DrawStage* stage : stages.draw) stage->place(time, surfaces);
        for (std::size_t b = 0; b < frame.size(); ++b) frame[b].moved = std::ranges::count(isMoved[b], 1);
    }
    for (std::size_t b = 0; b < frame.size(); ++b) frame[b].normals = surfaces_[b].skin.normals(frame[b].points);
}

namespace {

/// In a closed surface [m^3], at some places of its points.
double volumeIn(const tetmesh::RenderMesh& mesh, std::span<const Vec3> at)
{
    double volume = 0;
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto face = mesh.face(f);
        volume += volumeBelow(face.size(), [&](std::size_t k) -> const Vec3& { return at[face[k].point]; });
    }
    return volume;
}

/// Of a closed surface: its volume over that at rest.
double squeezeOf(const tetmesh::RenderMesh& mesh, std::span<const Vec3> at)
{
    const double rest = volumeIn(mesh, mesh.points);
    return rest > 0 ? volumeIn(mesh, at) / rest : 1;
}

}  // namespace

DrawnFrame Drawing::frame(const Simulation& simulation) const
{
    DrawnFrame frame;
    for (std::size_t b = 0; b < surfaces_.size(); ++b) {
        const Body& own = simulation.bodies()[b];
        frame.push_back(body(b, simulation.x().subspan(own.firstNode, own.mesh->nodeCount()),
                             simulation.v().subspan(own.firstNode, own.mesh->nodeCount())));
        DrawnBody& drawn = frame.back();
        drawn.squeeze = squeezeOf(drawn.topology->mesh, drawn.points);
    }
    finish(simulation.stages(), simulation.time(), frame);
    return frame;
}

Bounds boundsOf(const DrawnFrame& frame)
{
    constexpr double kFar = std::numeric_limits<double>::infinity();
    Bounds box{Vec3::Constant(kFar), Vec3::Constant(-kFar)};
    for (const DrawnBody& body : frame)
        for (const tetmesh::RenderMesh::Corner& c : body.topology->mesh.corners) {
            box.lower = box.lower.cwiseMin(body.points[c.point]);
            box.upper = box.upper.cwiseMax(body.points[c.point]);
        }
    if (!(box.lower.x() <= box.upper.x())) box = {Vec3::Zero(), Vec3::Zero()};
    return box;
}

double squeezeOf(const DrawnFrame& frame)
{
    double least = 1;
    for (const DrawnBody& body : frame) least = std::min(least, body.squeeze);
    return least;
}

std::vector<tetmesh::PlyBody> plyBodies(const DrawnFrame& frame)
{
    std::vector<tetmesh::PlyBody> bodies;
    for (const DrawnBody& body : frame) bodies.push_back({*body.topology, body.points, body.velocity, {}});
    return bodies;
}

MovingSurface movingSurface(const DrawnFrame& frame)
{
    MovingSurface all;
    tetmesh::Surface& sum = all.surface;
    for (const DrawnBody& body : frame) {
        const tetmesh::Surface one = tetmesh::triangleSurface(*body.topology, body.points);
        const std::uint32_t first = std::uint32_t(sum.points.size());
        sum.points.insert(sum.points.end(), one.points.begin(), one.points.end());
        for (const auto& t : one.triangles) sum.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        sum.fragment.insert(sum.fragment.end(), one.fragment.begin(), one.fragment.end());
        sum.torn.insert(sum.torn.end(), one.torn.begin(), one.torn.end());
        all.velocity.insert(all.velocity.end(), body.velocity.begin(), body.velocity.end());
    }
    return all;
}

}  // namespace vdbfrac::core
