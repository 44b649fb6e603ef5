# Compile options shared by every package: language, warnings, build type, sanitizers.
include_guard(DIRECTORY)  # sets directory variables, so every package needs its own

set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

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

function(understory_compile_options target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast
    -Wnon-virtual-dtor -Woverloaded-virtual -Wdouble-promotion -Wformat=2
    $<$<BOOL:${UNDERSTORY_WERROR}>:-Werror>
    $<$<BOOL:${UNDERSTORY_ASSERTS}>:-UNDEBUG>)
  if(UNDERSTORY_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${UNDERSTORY_SANITIZE}
      -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${UNDERSTORY_SANITIZE})
  endif()
endfunction()
