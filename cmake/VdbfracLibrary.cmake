# vdbfrac_library(NAME SOURCES ... [PUBLIC targets...] [PRIVATE targets...])
# A static library vdbfrac::NAME with its own include root, so that only what is linked can be included.
function(vdbfrac_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(vdbfrac_${name} STATIC ${arg_SOURCES})
  add_library(vdbfrac::${name} ALIAS vdbfrac_${name})
  target_include_directories(vdbfrac_${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
  target_link_libraries(vdbfrac_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:vdbfrac_flags>)
  set_target_properties(vdbfrac_${name} PROPERTIES EXPORT_NAME ${name})
  install(DIRECTORY include/ DESTINATION include)
  set_property(GLOBAL APPEND PROPERTY VDBFRAC_LIBRARIES vdbfrac_${name})
endfunction()
