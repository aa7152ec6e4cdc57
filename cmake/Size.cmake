# A release is compiled for speed (-O3) where a robot waits for it. The rooms that read options and files, print and draw are compiled for size in
# packages, and quickly (-O1) elsewhere. Functions without a caller are left out of the programs.
set(WAYMARK_SMALL_ROOMS app config media plot sdf server robots/wire robots/dds robots/fastdds inputs/gamepad robots/gazebo
  cameras/gstreamer robots/ignition inputs/keyboard robots/limo robots/mbot robots/process robots/ros2 cameras/v4l2 robots/watchdog)
set(WAYMARK_MEDIUM_ROOMS recording mapping/camera mapping/scene evaluation)  # -O2
set(WAYMARK_QUICK_ROOMS geometry camera samples tags pose factors mapping/solver mapping/lap mapping/camera mapping/scene localization replay
  simulation evaluation pipeline runtime codecs recording robots/simulated)

set(WAYMARK_FOR_SIZE OFF)
if(PROJECT_IS_TOP_LEVEL AND CMAKE_BUILD_TYPE MATCHES "^(Release|RelWithDebInfo)$" AND CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang" AND NOT WAYMARK_SANITIZE AND NOT APPLE)
  set(WAYMARK_FOR_SIZE ON)
  add_compile_options(-ffunction-sections -fdata-sections)
endif()

# waymark_size_of_room(TARGET ROOM)
function(waymark_size_of_room target room)
  if(WAYMARK_FOR_SIZE AND room IN_LIST WAYMARK_SMALL_ROOMS)
    target_compile_options(${target} PRIVATE $<IF:$<BOOL:${WAYMARK_PACKAGE}>,-Os,-O1>)
  elseif(WAYMARK_FOR_SIZE AND room IN_LIST WAYMARK_MEDIUM_ROOMS)
    target_compile_options(${target} PRIVATE -O2)
  endif()
endfunction()

# waymark_size_of_program(TARGET): the linker takes a template that a quick and a small room share (Eigen, standard library) from the
# first object that has it, so the quick rooms come first.
function(waymark_size_of_program target)
  if(NOT WAYMARK_FOR_SIZE)
    return()
  endif()
  set(files "")
  foreach(room IN LISTS WAYMARK_QUICK_ROOMS)
    string(REPLACE "/" "_" name waymark_${room})
    list(APPEND files $<TARGET_FILE:${name}>)
  endforeach()
  list(JOIN files "," files)
  target_link_options(${target} PRIVATE -Wl,--gc-sections -Wl,-z,pack-relative-relocs -Wl,--whole-archive,${files},--no-whole-archive)
endfunction()
