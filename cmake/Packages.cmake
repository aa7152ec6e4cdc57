# Debian packages by CPack; tools/make_packages.sh builds and checks them. Components: program → waymark, development → libwaymark-dev,
# ros2 → waymark-ros2, python → python3-waymark, gazebo → waymark-gazebo, boards → waymark-boards.
if(NOT WAYMARK_PACKAGE)
  return()
endif()

if(WAYMARK_PYTHON_PROGRAM)  # the interpreter that the Python package is built for
  set(Python3_EXECUTABLE ${WAYMARK_PYTHON_PROGRAM})
endif()
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(files ${PROJECT_BINARY_DIR}/package)
add_custom_command(OUTPUT ${files}/changelog.gz
  COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/make_package_files.py ${PROJECT_VERSION} ${files}
  DEPENDS tools/make_package_files.py docs/reference/cli.md CHANGELOG.md)
add_custom_target(waymark_package_files ALL DEPENDS ${files}/changelog.gz)

install(DIRECTORY ${files}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES packaging/completions/waymark.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME waymark COMPONENT program)
install(FILES packaging/completions/_waymark DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
install(FILES packaging/completions/waymark.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
install(FILES packaging/lintian/waymark DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides COMPONENT program)
install(FILES packaging/udev/60-waymark.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES packaging/systemd/waymark@.service DESTINATION lib/systemd/system COMPONENT program)
install(FILES ${WAYMARK_VIEWER_DIST}/notices.txt.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/waymark RENAME third-party-notices.gz COMPONENT program)
function(waymark_package_documents component package)
  install(FILES packaging/debian/copyright ${files}/changelog.gz ${files}/changelog.Debian.gz
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endfunction()
waymark_package_documents(program waymark)
waymark_package_documents(development libwaymark-dev)

set(CPACK_GENERATOR DEB)
if(CMAKE_CROSSCOMPILING AND CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64)  # else that of the machine
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
endif()
set(CPACK_PACKAGE_NAME waymark)
set(CPACK_PACKAGE_VENDOR "The Waymark authors")
set(CPACK_PACKAGE_CONTACT "The Waymark authors <waymark@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own: the first line of its description
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(revision ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME waymark)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
# Loaded when the first video is opened (waymark/media).
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "libavformat59 | libavformat60, libavcodec59 | libavcodec60, libavutil57 | libavutil58, libsdl2-2.0-0")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "Teach a robot a route once and repeat it, from AprilTags and one camera
A person drives a lap with a small robot; the recording becomes an optimised
map of the tags and a reference route; then the robot localises itself with a
covariance and drives the route autonomously behind a safety limiter.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libwaymark-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libfmt-dev, libexpected-dev, libapriltag-dev, libyaml-cpp-dev, \
nlohmann-json3-dev, libjpeg-dev, libpng-dev, zlib1g-dev, libbz2-dev, libsqlite3-dev, libcairo2-dev, libzstd-dev, liblz4-dev, libdeflate-dev, pkg-config")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS waymark)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Library of Waymark: detect tags, map, localise and replay in C++
Headers, static libraries and the CMake package Waymark: geometry, cameras,
tags, pose, mapping, localisation, recordings and replay.")

if(TARGET waymark_dds_module)  # a separate package, so that Fast DDS is only installed for ROS 2
  list(APPEND CPACK_COMPONENTS_ALL ros2)
  set(CPACK_DEBIAN_ROS2_PACKAGE_NAME waymark-ros2)
  set(CPACK_DEBIAN_ROS2_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_ROS2_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_ROS2_PACKAGE_DEPENDS "waymark (= ${revision})")
  set(CPACK_COMPONENT_ROS2_DESCRIPTION "Waymark on the network of ROS 2
The module by which `waymark` drives robots that speak ROS 2, and is a node
for others, on a machine without ROS.")
  waymark_package_documents(ros2 waymark-ros2)
endif()

if(TARGET waymark_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-waymark)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")  # the module is built for one version of the interpreter
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR}~), python3 (<< 3.${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS waymark)  # the worlds and robots that it names
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/python3/postinst ${PROJECT_SOURCE_DIR}/packaging/python3/prerm)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Waymark in Python: detect tags, map, localise and replay
One module a room of the library, images as NumPy arrays without copies,
recordings as iterators.")
  waymark_package_documents(python python3-waymark)
endif()

if(TARGET waymark_gazebo_module)  # apart, as that for ROS 2
  list(APPEND CPACK_COMPONENTS_ALL gazebo)
  set(CPACK_DEBIAN_GAZEBO_PACKAGE_NAME waymark-gazebo)
  set(CPACK_DEBIAN_GAZEBO_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_GAZEBO_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_GAZEBO_PACKAGE_DEPENDS "waymark (= ${revision})")
  set(CPACK_COMPONENT_GAZEBO_DESCRIPTION "Waymark on the network of Gazebo Fortress
The module by which `waymark` drives robots in Gazebo Fortress, by its topics.")
  waymark_package_documents(gazebo waymark-gazebo)
endif()

if(TARGET waymark_boards_module)  # a separate package, so that OpenCV is only installed for chessboards
  list(APPEND CPACK_COMPONENTS_ALL boards)
  set(CPACK_DEBIAN_BOARDS_PACKAGE_NAME waymark-boards)
  set(CPACK_DEBIAN_BOARDS_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_BOARDS_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_BOARDS_PACKAGE_DEPENDS "waymark (= ${revision})")
  set(CPACK_COMPONENT_BOARDS_DESCRIPTION "Chessboards, ChArUco boards and AprilGrids for Waymark
The module by which `waymark calibrate camera` finds boards that are not made
of single tags, and `waymark tags board` prints ChArUco boards, by OpenCV.")
  waymark_package_documents(boards waymark-boards)
endif()
include(CPack)
