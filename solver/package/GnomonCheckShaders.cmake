# gnomon_check_shaders(<name>
#   SHADERS file...            the shaders; stages by extension (.vert .tesc .tese .geom .frag .comp, also .frag.glsl)
#   [INCLUDES folder...]       include paths; the library's own includes are found without one
#   [DEFINES NAME=VALUE...]
#   [TARGETS target...]        "330 core", "300 es", vulkan, opengl, "450 vulkan", ...; none: as each file's #version says
#   [STAGE stage]              of files whose names do not say it
#   [BUILD])                   check while building as well: an error in a shader fails the build
#
# Adds the test <name>_shaders, which runs `gnomon check`. With BUILD it also adds the target <name>_shaders_checked, which runs again when
# a shader or a file in an include path changes; where <name> is a target, that depends on it, else it is part of ALL.
# The tool is the target gnomon_cli where there is one (gnomon built beside), else the program GNOMON_TOOL, found beside this package.
function(gnomon_check_shaders name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "BUILD" "STAGE" "SHADERS;INCLUDES;DEFINES;TARGETS")
  if(arg_UNPARSED_ARGUMENTS OR arg_KEYWORDS_MISSING_VALUES)
    message(FATAL_ERROR "gnomon_check_shaders(${name}): not understood: ${arg_UNPARSED_ARGUMENTS} ${arg_KEYWORDS_MISSING_VALUES}")
  endif()
  if(NOT arg_SHADERS)
    message(FATAL_ERROR "gnomon_check_shaders(${name}): SHADERS are missing")
  endif()

  if(TARGET gnomon_cli)
    set(tool $<TARGET_FILE:gnomon_cli>)
  else()
    find_program(GNOMON_TOOL gnomon
      HINTS ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../../bin ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../../../bin  # lib, lib/<architecture>
      DOC "The gnomon tool")
    if(NOT GNOMON_TOOL)
      message(FATAL_ERROR "gnomon_check_shaders(${name}): the gnomon tool is not found; set GNOMON_TOOL to it")
    endif()
    set(tool ${GNOMON_TOOL})
  endif()

  set(words check)
  set(shaders)
  set(inputs)
  foreach(shader IN LISTS arg_SHADERS)
    cmake_path(ABSOLUTE_PATH shader BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    list(APPEND shaders ${shader})
  endforeach()
  foreach(folder IN LISTS arg_INCLUDES)
    cmake_path(ABSOLUTE_PATH folder BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    list(APPEND words -I ${folder})
    file(GLOB_RECURSE files CONFIGURE_DEPENDS ${folder}/*)
    list(APPEND inputs ${files})
  endforeach()
  foreach(define IN LISTS arg_DEFINES)
    list(APPEND words -D ${define})
  endforeach()
  foreach(target IN LISTS arg_TARGETS)
    list(APPEND words --target ${target})
  endforeach()
  if(arg_STAGE)
    list(APPEND words --stage ${arg_STAGE})
  endif()

  add_test(NAME ${name}_shaders COMMAND ${tool} ${words} ${shaders})
  if(arg_BUILD)
    set(stamp ${CMAKE_CURRENT_BINARY_DIR}/${name}_shaders.checked)
    add_custom_command(OUTPUT ${stamp}
      COMMAND ${tool} ${words} ${shaders}
      COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
      DEPENDS ${shaders} ${inputs} ${tool}
      COMMENT "Checking the shaders of ${name}" VERBATIM)
    if(TARGET ${name})
      add_custom_target(${name}_shaders_checked DEPENDS ${stamp})
      add_dependencies(${name} ${name}_shaders_checked)
    else()
      add_custom_target(${name}_shaders_checked ALL DEPENDS ${stamp})
    endif()
  endif()
endfunction()
