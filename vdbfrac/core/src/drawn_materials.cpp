#include "drawn_materials.h"

#include <algorithm>
#include <set>
#include <system_error>

namespace vdbfrac::core {

std::string DrawnMaterials::known(const tetmesh::MtlMaterial& material, const std::string& suffix)
{
    std::string name = material.name;
    for (;; name += suffix) {
        const auto [at, isNew] = look_.emplace(name, material.look);
        if (isNew) text_ += "\nnewmtl " + name + '\n' + material.look;
        if (at->second == material.look) return name;
    }
}

std::map<std::string, std::string> DrawnMaterials::add(const tetmesh::RenderMesh& mesh,
                                                       const std::filesystem::path& folder, const std::string& body,
                                                       std::vector<std::string>& notes)
{
    std::map<std::string, std::string> renamed;
    std::set<std::string> seen{"outside", "inside"};  // names of frames: no face of the mesh has them
    const auto isThere = [](const std::filesystem::path& file) {
        std::error_code unused;  // as of names that are too long
        return std::filesystem::is_regular_file(file, unused);
    };
    for (const std::filesystem::path& library : tetmesh::libraryFiles(mesh.libraries, folder)) {
        if (!isThere(library)) {
            notes.push_back(library.string() + " is not there: its materials have no colours or textures");
            continue;
        }
        const bool isNew = std::ranges::find(files_, library) == files_.end();
        if (isNew) files_.push_back(library);
        const std::string looks = tetmesh::readMtl(library);
        for (const auto& [material, map] : tetmesh::diffuseMaps(looks)) {
            if (!isNew || std::ranges::find(mesh.materials, material) == mesh.materials.end()) continue;
            if (!isThere(map.file))
                notes.push_back(map.file + " is not there: pictures show '" + material + "' without its texture");
            else if (mesh.uvs.empty())
                notes.push_back("the mesh for body '" + body + "' has no texture coordinates for the texture of '" +
                                material + "'");
        }
        for (const tetmesh::MtlMaterial& material : tetmesh::materialsIn(looks)) {
            if (!seen.insert(material.name).second) continue;
            const std::string name = known(material, "_" + body);
            if (name == material.name) continue;
            renamed[material.name] = name;
            notes.push_back("the material '" + material.name + "' of the mesh for body '" + body +
                            "' looks otherwise in another body: frames call it '" + name + "'");
        }
    }
    return renamed;
}

std::string DrawnMaterials::ofScene(const std::string& text)
{
    return known(tetmesh::materialsIn(text).front(), "_scene");
}

}  // namespace vdbfrac::core
