# What the CMakeLists of all packages share: language, warnings, build type, sanitizers, and how a
# package finds our other libraries. The plain build includes it from the root; in a catkin build it
# comes with find_package(catkin COMPONENTS understory_core).
include_guard(DIRECTORY)  # sets directory variables, so every package needs its own

set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
# Installed programs (lib/<package>) and libraries (lib) find our libraries without any variable.
set(CMAKE_INSTALL_RPATH "$ORIGIN:$ORIGIN/..")

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, Debug or RelWithDebInfo" FORCE)
endif()

find_program(UNDERSTORY_CCACHE ccache)
if(UNDERSTORY_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${UNDERSTORY_CCACHE})
endif()

option(UNDERSTORY_WERROR "Treat warnings as errors" OFF)
option(UNDERSTORY_ASSERTS "Keep assertions on in Release builds" OFF)
set(UNDERSTORY_SANITIZE "" CACHE STRING "Sanitizers, e.g. address,undefined")

# Reading the headers of others takes most of the time that a file takes.
option(UNDERSTORY_PCH "Precompile headers of other libraries" ON)
set(UNDERSTORY_COMMON_HEADERS
  <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <chrono> <cmath> <functional> <limits> <map>
  <memory> <optional> <string> <string_view> <unordered_map> <vector>)

# The first option is for ccache. Of its own strings GCC 12 has false alarms, which it keeps to itself
# only as long as it reads them from a system header.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(UNDERSTORY_PCH_OPTIONS -fpch-preprocess
    -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
endif()

# Headers as <name>, for all files of a target.
function(understory_precompile target)
  if(UNDERSTORY_PCH)
    target_precompile_headers(${target} PRIVATE ${ARGN})
    target_compile_options(${target} PRIVATE ${UNDERSTORY_PCH_OPTIONS})
  endif()
endfunction()

# Those of another target with the same options and no definitions of its own; none where that is
# not part of the build.
function(understory_precompile_as target other)
  if(UNDERSTORY_PCH AND TARGET ${other})
    target_precompile_headers(${target} REUSE_FROM ${other})
    get_target_property(type ${target} TYPE)
    if(type STREQUAL EXECUTABLE)  # made with -fPIE, which does not go with headers of a library
      set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
      target_compile_options(${target} PRIVATE -fPIC)
    endif()
    target_compile_options(${target} PRIVATE ${UNDERSTORY_PCH_OPTIONS})
  endif()
endfunction()

function(understory_compile_options target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast
    -Wnon-virtual-dtor -Woverloaded-virtual -Wdouble-promotion -Wformat=2
    $<$<BOOL:${UNDERSTORY_WERROR}>:-Werror>
    $<$<BOOL:${UNDERSTORY_ASSERTS}>:-UNDEBUG>)
  if(UNDERSTORY_ASSERTS)
    target_compile_definitions(${target} PRIVATE _GLIBCXX_ASSERTIONS)
  endif()
  if(UNDERSTORY_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${UNDERSTORY_SANITIZE}
      -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${UNDERSTORY_SANITIZE})
  endif()
endfunction()

# Makes `library` of our catkin package `package` a target, unless this build has it already: a
# package that is built by itself (catkin_make_isolated, install space) gets it from catkin.
function(understory_find_library package library)
  if(TARGET ${library})
    return()
  endif()
  find_package(${package} REQUIRED)
  add_library(${library} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${library} INTERFACE ${${package}_INCLUDE_DIRS})
  target_link_libraries(${library} INTERFACE ${${package}_LIBRARIES})
endfunction()

# Installs libraries and the headers beside their sources (understory/<module>/*.hpp).
function(understory_install_libraries)
  if(NOT catkin_FOUND)
    return()
  endif()
  install(TARGETS ${ARGN}
    ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
    LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
    RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
  install(DIRECTORY understory DESTINATION ${CATKIN_GLOBAL_INCLUDE_DESTINATION}
    FILES_MATCHING PATTERN "*.hpp")
endfunction()

# Installs programs where `rosrun` looks for them.
function(understory_install_programs)
  if(catkin_FOUND)
    install(TARGETS ${ARGN} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
endfunction()
