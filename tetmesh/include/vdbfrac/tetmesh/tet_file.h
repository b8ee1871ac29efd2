// Tet meshes as files for other programs.
#pragma once

#include <vdbfrac/tetmesh/tet_mesh.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::tetmesh {

enum class TetFormat {
    vtu,     ///< ParaView, VTK: XML with raw 64-bit data
    vtk,     ///< the older VTK format, binary
    gmsh41,  ///< Gmsh's .msh 4.1, text
    gmsh22,  ///< Gmsh's .msh 2.2, text
    medit,   ///< .mesh of Medit, INRIA's tools, MFEM: text
    tetgen,  ///< TetGen's pair of .node and .ele: text
};

/// A number for each point or each tet. Written by vtu, vtk and Gmsh formats; the others have no place for it.
struct FileField {
    std::string name;  ///< letters, digits and _
    std::vector<double> values;
};
struct TetFields {
    std::vector<FileField> onPoints, onTets;
};

/// The format that an extension stands for, in upper or lower case; .msh is `gmsh41`. Throws InputError.
TetFormat tetFormatOf(const std::filesystem::path& file);

/// Writes a mesh atomically and verified, with the doubles as they are (in text: with all digits that count). Gmsh and
/// Medit files also hold the boundary as triangles, where fields of tets are 0: the tets are volume 1, the triangles
/// surface 1. (Only `gmsh22` with fields of tets has none.) `tetgen` writes two files, NAME.node and NAME.ele,
/// whichever of both is named; tets count from 0. Returns the files. Throws FileError; InputError for fields of a wrong
/// length or name.
std::vector<std::filesystem::path> writeTets(const std::filesystem::path& file, TetFormat format, const TetMesh& mesh,
                                             const TetFields& fields = {});

}  // namespace vdbfrac::tetmesh
