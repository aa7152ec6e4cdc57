# Ten test programs for all rooms: one program per room would link the same libraries fifty times.
#
# ctest has one entry for each file with tests, named and labelled after its room: `ctest -L '^mapping/lap$'`, `ctest -R geometry.se3`.
# tools/list_tests.py asks a program, once it is linked, which tests it holds.
set(WAYMARK_TEST_PROGRAMS core bytes tags mapping localization replay simulation files robots app)
set(WAYMARK_TESTS_core geometry image families camera samples factors)
set(WAYMARK_TESTS_bytes base codecs recording robots/process)  # what the sanitizers see in the short run
set(WAYMARK_TESTS_tags tags pose)
set(WAYMARK_TESTS_mapping mapping/solver mapping/lap mapping/scene mapping/camera)
set(WAYMARK_TESTS_localization localization)
set(WAYMARK_TESTS_replay replay pipeline runtime)
set(WAYMARK_TESTS_simulation simulation robots/simulated evaluation)
set(WAYMARK_TESTS_files config plot media media/opencv sdf sdf/sdformat)
set(WAYMARK_TESTS_robots robots/watchdog inputs/keyboard inputs/gamepad cameras/gstreamer cameras/v4l2 modules robots/dds robots/fastdds
  robots/limo robots/mbot robots/wire robots/ros2 robots/gazebo robots/ignition)
set(WAYMARK_TESTS_app server)  # and the tests in waymark/app

# The system's own interpreter, where there is one: it has the system's modules (NumPy, genpy).
find_program(WAYMARK_PYTHON_PROGRAM python3 PATHS /usr/bin NO_DEFAULT_PATH)
find_program(WAYMARK_PYTHON_PROGRAM python3)
set(Python3_EXECUTABLE ${WAYMARK_PYTHON_PROGRAM})
find_package(Python3 REQUIRED COMPONENTS Interpreter)

function(waymark_new_test_program target)
  add_executable(${target})
  target_link_libraries(${target} PRIVATE waymark_test_support waymark_warnings GTest::gmock_main)
  target_compile_definitions(${target} PRIVATE WAYMARK_SHARE="${PROJECT_SOURCE_DIR}/share")
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
endfunction()

foreach(program IN LISTS WAYMARK_TEST_PROGRAMS)
  waymark_new_test_program(waymark_${program}_tests)
endforeach()

# waymark_tests(PROGRAM SOURCES file... LIBS lib...): GoogleTest files, with our seeds and data lookup, for one of the programs above.
function(waymark_tests program)
  cmake_parse_arguments(TEST "" "" "SOURCES;LIBS" ${ARGN})
  list(TRANSFORM TEST_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/ REGEX "^[^/]")
  target_sources(waymark_${program}_tests PRIVATE ${TEST_SOURCES})
  target_link_libraries(waymark_${program}_tests PRIVATE ${TEST_LIBS})
endfunction()

# The target of the program that holds a room's tests.
function(waymark_test_program_of room variable)
  foreach(program IN LISTS WAYMARK_TEST_PROGRAMS)
    if(room IN_LIST WAYMARK_TESTS_${program})
      set(${variable} waymark_${program}_tests PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "No test program holds the tests of room '${room}': add it to cmake/TestPrograms.cmake.")
endfunction()

# One ctest entry for each file of a program. Most tests compute: two of them at a time with `ctest -j4`; those of robots and pages wait.
function(waymark_list_tests target)
  set(processors 2)
  if(target MATCHES "waymark_(robots|app)_tests")
    set(processors 1)
  endif()
  set(listed ${PROJECT_BINARY_DIR}/tests/${target}.cmake)
  add_custom_command(TARGET ${target} POST_BUILD COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/list_tests.py
    --root ${PROJECT_SOURCE_DIR} --build ${PROJECT_BINARY_DIR} --output ${listed} --processors ${processors} -- ${CMAKE_CROSSCOMPILING_EMULATOR} $<TARGET_FILE:${target}> VERBATIM)
  set(include ${PROJECT_BINARY_DIR}/tests/${target}_if_built.cmake)
  file(CONFIGURE OUTPUT ${include} CONTENT "if(EXISTS \"${listed}\")\n  include(\"${listed}\")\nelse()\n  add_test(${target}_is_not_built ${target})\nendif()\n")
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY TEST_INCLUDE_FILES ${include})
endfunction()

# A program of its own, for tests that change what others rely on (the heap). Without precompiled headers.
function(waymark_test_alone target)
  cmake_parse_arguments(TEST "" "" "SOURCES;LIBS" ${ARGN})
  waymark_new_test_program(${target})
  target_sources(${target} PRIVATE ${TEST_SOURCES})
  target_link_libraries(${target} PRIVATE ${TEST_LIBS})
  waymark_list_tests(${target})
endfunction()

# Once every room has added its tests.
function(waymark_finish_test_programs)
  foreach(program IN LISTS WAYMARK_TEST_PROGRAMS)
    set(target waymark_${program}_tests)
    waymark_precompile(${target} waymark_precompiled_tests)
    waymark_list_tests(${target})
  endforeach()
endfunction()
