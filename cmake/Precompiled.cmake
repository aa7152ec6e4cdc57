# A quick build from nothing (WAYMARK_UNITY). Files of a library are compiled together: names in anonymous namespaces are unique in a room.
function(waymark_compile_together target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${WAYMARK_UNITY} UNITY_BUILD_BATCH_SIZE 8)
endfunction()

# With clang, too: the headers that most files include are parsed, and their templates instantiated, once
# (cmake/precompiled.hpp; the tests' list is longer). With clang a build from nothing takes a third less
# time than with GCC, which gains nothing by it.
set(WAYMARK_PRECOMPILED OFF)
if(WAYMARK_UNITY AND CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  set(WAYMARK_PRECOMPILED ON)
endif()

function(waymark_precompiled_list name)
  add_library(${name} OBJECT ${PROJECT_SOURCE_DIR}/cmake/precompiled.cpp)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE fmt::fmt tl::expected Eigen3::Eigen nlohmann_json::nlohmann_json
    yaml-cpp waymark_warnings ${ARGN})
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_compile_options(${name} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
endfunction()

if(WAYMARK_PRECOMPILED)
  waymark_precompiled_list(waymark_precompiled)
  set_target_properties(waymark_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON)  # as the rooms' libraries are; the tests are not
  target_precompile_headers(waymark_precompiled PRIVATE ${PROJECT_SOURCE_DIR}/cmake/precompiled.hpp)
  if(WAYMARK_BUILD_TESTS)
    waymark_precompiled_list(waymark_precompiled_tests GTest::gmock)
    target_precompile_headers(waymark_precompiled_tests PRIVATE ${PROJECT_SOURCE_DIR}/cmake/precompiled.hpp
      <gmock/gmock.h> <gtest/gtest.h>)
  endif()
endif()

# waymark_precompile(TARGET LIST): LIST is waymark_precompiled or waymark_precompiled_tests.
function(waymark_precompile target list)
  if(WAYMARK_PRECOMPILED)
    target_precompile_headers(${target} REUSE_FROM ${list})
  endif()
endfunction()
