// The content of tet mesh files. Not installed.
#pragma once

#include <vdbfrac/tetmesh/tet_file.h>

#include <string>

namespace vdbfrac::tetmesh {

std::string vtuText(const TetMesh& mesh, const TetFields& fields);
std::string vtkText(const TetMesh& mesh, const TetFields& fields);
std::string gmsh41Text(const TetMesh& mesh, const TetFields& fields);
std::string gmsh22Text(const TetMesh& mesh, const TetFields& fields);

}  // namespace vdbfrac::tetmesh
