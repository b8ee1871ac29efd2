# What is installed beside the program and the libraries, and `cpack`: vdbfrac_VERSION_ARCHITECTURE.deb.
install(FILES README.md CHANGELOG.md cmake/copyright DESTINATION share/doc/vdbfrac)
install(FILES vdbfrac/effects/README.md DESTINATION share/doc/vdbfrac/docs RENAME effects.md)
install(DIRECTORY docs DESTINATION share/doc/vdbfrac PATTERN "*.py" EXCLUDE PATTERN "*.in" EXCLUDE)
install(DIRECTORY data/ DESTINATION share/vdbfrac PATTERN "*.py" EXCLUDE)

set(CPACK_GENERATOR DEB)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_PACKAGE_CONTACT "vdbfrac maintainers <maintainers@vdbfrac.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "tears soft solids and writes .vdb and .obj sequences")
set(CPACK_PACKAGE_DESCRIPTION "A scene goes in as a text file, sequences of .vdb and .obj files come out, for any program that
reads OpenVDB's grids. Also makes tetrahedral meshes and clean level sets of surfaces.
The libraries, their headers and a package for CMake are part of it.")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# What find_package(vdbfrac) asks for.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "cmake, libblosc-dev, libboost-iostreams-dev, libcgal-dev, libeigen3-dev, libopenvdb-dev, libsuitesparse-dev, libtbb-dev, zlib1g-dev")
include(CPack)
