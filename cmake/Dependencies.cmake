# Everything from outside. TBB's own config has to come before OpenVDB's find module (Debian's is not on the path).
find_program(VDBFRAC_CCACHE ccache)
if(VDBFRAC_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${VDBFRAC_CCACHE})
endif()

find_package(TBB CONFIG REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
find_package(OpenVDB 10 REQUIRED)
find_package(CGAL 5.5 REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_library(VDBFRAC_BLOSC blosc REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(spdlog 1.10 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(tomlplusplus 3.3 REQUIRED)

# OpenVDB's headers warn under our flags; they are not ours to mend.
if(TARGET OpenVDB::openvdb)
  get_target_property(dirs OpenVDB::openvdb INTERFACE_INCLUDE_DIRECTORIES)
  set_target_properties(OpenVDB::openvdb PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${dirs}")
endif()
