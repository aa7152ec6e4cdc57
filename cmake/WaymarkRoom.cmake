# waymark_room(NAME [INTERNAL] USES room... [PUBLIC lib...] [PRIVATE lib...])
#
# One folder = one target = one layer. Sources, headers and tests stand side by side in waymark/NAME; tests are the
# files called *_test.cpp. USES is held against cmake/rooms.txt: an edge the table does not allow stops the configure.
# An INTERNAL room is the inside of a program and is not installed; of the others the headers in cmake/public_headers.txt are.
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/rooms.txt _waymark_rows REGEX "^[a-z0-9/]+ *\\|")
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/public_headers.txt WAYMARK_PUBLIC_HEADERS REGEX "^waymark/")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/rooms.txt ${CMAKE_CURRENT_LIST_DIR}/public_headers.txt)
foreach(row IN LISTS _waymark_rows)
  string(REGEX MATCH "^([a-z0-9/]+) *\\|([^|]*)" _ "${row}")
  set(_room ${CMAKE_MATCH_1})
  string(STRIP "${CMAKE_MATCH_2}" _edges)
  separate_arguments(_edges)
  set(_reach "")
  foreach(edge IN LISTS _edges)
    list(APPEND _reach ${edge} ${WAYMARK_REACH_${edge}})
  endforeach()
  list(REMOVE_DUPLICATES _reach)
  set(WAYMARK_REACH_${_room} ${_reach})
  list(APPEND WAYMARK_KNOWN_ROOMS ${_room})
endforeach()

function(waymark_check_edges name)
  if(NOT name IN_LIST WAYMARK_KNOWN_ROOMS)
    message(FATAL_ERROR "Room '${name}' is not in cmake/rooms.txt. Add a row there first.")
  endif()
  foreach(used IN LISTS ARGN)
    if(NOT used IN_LIST WAYMARK_REACH_${name} AND NOT "*" IN_LIST WAYMARK_REACH_${name})
      message(FATAL_ERROR "Room '${name}' may not use '${used}' (allowed: ${WAYMARK_REACH_${name}}). "
        "Either the code is in the wrong room, or cmake/rooms.txt must change, with the reason in docs/architecture.md.")
    endif()
  endforeach()
endfunction()

function(waymark_room name)
  cmake_parse_arguments(ROOM "INTERNAL" "" "USES;PUBLIC;PRIVATE;TEST_LIBS" ${ARGN})
  waymark_check_edges(${name} ${ROOM_USES})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} *.hpp)
  set(public_headers "")
  foreach(header IN LISTS headers)
    if(header IN_LIST WAYMARK_PUBLIC_HEADERS)
      list(APPEND public_headers ${PROJECT_SOURCE_DIR}/${header})
    endif()
  endforeach()
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$|/main\\.cpp$")
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")

  # A room in a room (drivers/simulated) is the target waymark_drivers_simulated.
  set(room ${name})
  string(REPLACE "/" "_" name ${name})
  string(REPLACE "/" "_" ROOM_USES "${ROOM_USES}")
  set(target waymark_${name})
  if(sources)
    set(scope PUBLIC)
    add_library(${target} STATIC ${sources})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    waymark_compile_together(${target} ${sources})
    waymark_size_of_room(${target} ${room})
    if(NOT name STREQUAL "base")  # which knows no Eigen
      waymark_precompile(${target} waymark_precompiled)
    endif()
    target_link_libraries(${target} PRIVATE ${ROOM_PRIVATE} $<BUILD_INTERFACE:waymark_warnings>)
  else()  # a room of headers
    set(scope INTERFACE)
    add_library(${target} INTERFACE)
  endif()
  add_library(Waymark::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${public_headers})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${ROOM_PUBLIC})
  foreach(used IN LISTS ROOM_USES)
    target_link_libraries(${target} ${scope} waymark_${used})
  endforeach()
  if(NOT ROOM_INTERNAL)
    install(TARGETS ${target} EXPORT WaymarkTargets ARCHIVE COMPONENT development
      FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
  endif()

  if(WAYMARK_BUILD_TESTS AND tests)
    waymark_test(waymark_${name}_tests SOURCES ${tests} LIBS ${target} ${ROOM_TEST_LIBS})
  endif()
endfunction()

# waymark_test(NAME [PLAIN] SOURCES file... LIBS lib...): a GoogleTest program with our seeds and data lookup; PLAIN: without
# precompiled headers.
function(waymark_test name)
  cmake_parse_arguments(TEST "PLAIN" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${TEST_SOURCES})
  waymark_compile_together(${name} ${TEST_SOURCES})
  if(NOT TEST_PLAIN AND NOT name STREQUAL "waymark_base_tests")
    waymark_precompile(${name} waymark_precompiled_tests)
  endif()
  target_link_libraries(${name} PRIVATE ${TEST_LIBS} waymark_test_support waymark_warnings GTest::gmock_main)
  # rapidcheck prints the seed of a failing property; the fixed one makes every run the same.
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST TEST_FILTER "-*Threads*"
    PROPERTIES ENVIRONMENT "RC_PARAMS=seed=20261121" LABELS ${name})
  # What the thread sanitizer has to see says so in its name.
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST TEST_FILTER "*Threads*" TEST_LIST ${name}_with_threads
    PROPERTIES ENVIRONMENT "RC_PARAMS=seed=20261121" LABELS threads)
endfunction()
