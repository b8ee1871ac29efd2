# vdbfrac_library(NAME [INTERNAL] [COLD] SOURCES ... [APART sources...] [PUBLIC targets...] [PRIVATE targets...])
# A static library vdbfrac::NAME with its own include root, so that only what is linked can be included. INTERNAL: for our own
# programs, not installed. COLD: programs spend no time in it. APART: sources that are never compiled together with others,
# since they use the same names for local things.
function(vdbfrac_library name)
  cmake_parse_arguments(arg "INTERNAL;COLD" "" "SOURCES;APART;PUBLIC;PRIVATE" ${ARGN})
  add_library(vdbfrac_${name} STATIC ${arg_SOURCES} ${arg_APART})
  set_target_properties(vdbfrac_${name} PROPERTIES UNITY_BUILD ${VDBFRAC_UNITY})
  set_source_files_properties(${arg_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  add_library(vdbfrac::${name} ALIAS vdbfrac_${name})
  target_include_directories(vdbfrac_${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
  target_compile_features(vdbfrac_${name} PUBLIC cxx_std_20)
  target_link_libraries(vdbfrac_${name} PUBLIC ${arg_PUBLIC} PRIVATE $<BUILD_INTERFACE:vdbfrac_flags>)
  if(arg_COLD)
    target_link_libraries(vdbfrac_${name} PRIVATE $<BUILD_INTERFACE:vdbfrac_cold>)
  endif()
  foreach(need IN LISTS arg_PRIVATE)
    vdbfrac_is_header_only(${need} headers_only)
    if(headers_only)  # whoever links the finished library has no use for it
      set(need $<BUILD_INTERFACE:${need}>)
    endif()
    target_link_libraries(vdbfrac_${name} PRIVATE ${need})
  endforeach()
  if(arg_INTERNAL)
    return()
  endif()
  # Position independent, so that plug-ins can link them too.
  set_target_properties(vdbfrac_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  install(DIRECTORY include/ DESTINATION include)
  set_property(GLOBAL APPEND PROPERTY VDBFRAC_LIBRARIES vdbfrac_${name})
endfunction()

# Sets `result`: is this a target that brings nothing to link?
function(vdbfrac_is_header_only need result)
  set(${result} FALSE PARENT_SCOPE)
  if(NOT TARGET ${need})
    return()
  endif()
  get_target_property(type ${need} TYPE)
  get_target_property(links ${need} INTERFACE_LINK_LIBRARIES)
  if(type STREQUAL "INTERFACE_LIBRARY" AND NOT links)
    set(${result} TRUE PARENT_SCOPE)
  endif()
endfunction()

# vdbfrac_effect_names(FOLDER names...): writes FOLDER/effect_names.h, the list of effects that effect_list.cpp reads.
function(vdbfrac_effect_names folder)
  set(text "")
  foreach(name IN LISTS ARGN)
    string(APPEND text "VDBFRAC_EFFECT(${name})\n")
  endforeach()
  file(CONFIGURE OUTPUT ${folder}/effect_names.h CONTENT "${text}" @ONLY)
endfunction()
