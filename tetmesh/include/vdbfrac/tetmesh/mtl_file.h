// Material libraries (.mtl): colours and textures of the materials that .obj files name.
#pragma once

#include <vdbfrac/base/vec.h>

#include <Eigen/Core>

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::tetmesh {

/// A material of a library that is a little glossy; `colour`: Kd.
std::string mtlMaterial(const std::string& name, const Vec3& colour);
/// The same of torn faces of what is called so: its name is not only that.
std::string tornMaterial(const std::string& of, const Vec3& colour);
/// Is this a name of torn faces: "inside", or one that tornMaterial() gives?
bool isTornMaterial(std::string_view name);
/// The material library of the frames: "outside" neutral, "inside" red, and what `more` defines.
std::string mtlText(std::string_view more = "");
/// Writes it. Throws FileError.
void writeMtl(const std::filesystem::path& file, std::string_view more = "");

/// The files that `libraries` of a mesh name, by their folder. A line may name several, or one with blanks in its name:
/// it is one where there is such a file.
std::vector<std::filesystem::path> libraryFiles(std::span<const std::string> libraries,
                                                const std::filesystem::path& folder);

/// The text of a material library, with the paths of its textures made absolute. Throws FileError.
std::string readMtl(const std::filesystem::path& file);

/// A material of a library: its name, and the lines that tell what it looks like.
struct MtlMaterial {
    std::string name, look;
};
/// Of a library's text, in order.
std::vector<MtlMaterial> materialsIn(const std::string& mtl);

/// Diffuse colours (Kd) of the materials of a library's text, as it has them.
std::map<std::string, Vec3> diffuseColours(const std::string& mtl);

/// What a material lets through and gives off.
struct Light {
    double opacity = 1;           ///< d, or 1 - Tr
    Vec3 emitted = Vec3::Zero();  ///< Ke
};
/// Of the materials of a library's text that are not opaque, or shine.
std::map<std::string, Light> lightsOf(const std::string& mtl);

/// The texture of a diffuse colour: the point (u, v) of the surface has the texture's scale * (u, v) + offset.
struct DiffuseMap {
    std::string file;  ///< as the library names it
    Eigen::Array2d scale = {1, 1}, offset = {0, 0};
};
/// The light of a colour of a library, which is told as a screen shows it.
Vec3 lightOf(const Vec3& colour);

/// Textures (map_Kd, with -s and -o) of the materials of a library's text.
std::map<std::string, DiffuseMap> diffuseMaps(const std::string& mtl);

}  // namespace vdbfrac::tetmesh
