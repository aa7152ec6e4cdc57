# Precompiled headers for our own builds: most of the time of a file goes into reading Eigen, GoogleTest and the
# standard library again. Off by default and never exported. They hide a missing include: the presets release and
# fuzz do without, and `./test.sh --full` compiles every header alone.
option(WAYMARK_PRECOMPILE "Precompiled headers (our presets; never exported)" OFF)

# waymark_precompile_as(KIND headers... [LIBS lib...]): what targets of this kind read once.
function(waymark_precompile_as kind)
  cmake_parse_arguments(PRE "" "" "HEADERS;LIBS" ${ARGN})
  if(WAYMARK_PRECOMPILE)
    add_library(waymark_precompiled_${kind} STATIC ${PROJECT_SOURCE_DIR}/cmake/precompiled.cpp)
    target_link_libraries(waymark_precompiled_${kind} PRIVATE ${PRE_LIBS} waymark_warnings)
    target_precompile_headers(waymark_precompiled_${kind} PRIVATE ${PRE_HEADERS})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(waymark_precompiled_${kind} PRIVATE -fpch-preprocess)  # for ccache
    endif()
  endif()
endfunction()

function(waymark_precompile target kind)
  if(WAYMARK_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM waymark_precompiled_${kind})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE -fpch-preprocess)
    endif()
  endif()
endfunction()

set(_standard <algorithm> <array> <cmath> <cstddef> <cstdint> <filesystem> <fstream> <functional> <map> <memory>
  <numbers> <optional> <span> <string> <string_view> <variant> <vector>)
set(_eigen <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <Eigen/Cholesky>)
waymark_precompile_as(room HEADERS ${_standard} ${_eigen} LIBS Eigen3::Eigen)
if(WAYMARK_PRECOMPILE)
  set_target_properties(waymark_precompiled_room PROPERTIES POSITION_INDEPENDENT_CODE ON)  # as rooms are
endif()
if(WAYMARK_BUILD_TESTS)
  waymark_precompile_as(test HEADERS ${_standard} ${_eigen} <gtest/gtest.h> <gmock/gmock.h>
    LIBS Eigen3::Eigen GTest::gmock)
endif()
