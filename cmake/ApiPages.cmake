# The target `docs`: pages on the installed headers, where doxygen is there. A malformed comment is an error.
find_package(Doxygen 1.9.4)
if(DOXYGEN_FOUND)
  get_property(libraries GLOBAL PROPERTY VDBFRAC_LIBRARIES)
  foreach(library IN LISTS libraries)
    get_target_property(folder ${library} SOURCE_DIR)
    string(APPEND headers " ${folder}/include")
  endforeach()
  configure_file(docs/Doxyfile.in ${CMAKE_CURRENT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(docs COMMAND Doxygen::doxygen ${CMAKE_CURRENT_BINARY_DIR}/Doxyfile
    COMMENT "API pages: ${CMAKE_CURRENT_BINARY_DIR}/docs/html/index.html" VERBATIM)
endif()
