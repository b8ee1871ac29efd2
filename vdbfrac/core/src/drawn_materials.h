// The materials of all that is drawn, each name once. Not installed.
#pragma once

#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vdbfrac::core {

class DrawnMaterials {
public:
    /// Takes in what the libraries of a body's mesh define. Returns the names that frames have for those of its
    /// materials whose names others have for something else.
    std::map<std::string, std::string> add(const tetmesh::RenderMesh& mesh, const std::filesystem::path& folder,
                                           const std::string& body, std::vector<std::string>& notes);
    /// Adds a material of the scene, as .mtl files have it. Returns the name that frames have for it.
    std::string ofScene(const std::string& text);
    /// As a material library.
    const std::string& text() const { return text_; }
    /// The libraries that were read.
    const std::vector<std::filesystem::path>& files() const { return files_; }

private:
    /// A name under which this look is known from now on: `name`, unless another has it; then with `suffix`.
    std::string known(const tetmesh::MtlMaterial& material, const std::string& suffix);

    std::map<std::string, std::string> look_;  // by name
    std::string text_;
    std::vector<std::filesystem::path> files_;
};

}  // namespace vdbfrac::core
