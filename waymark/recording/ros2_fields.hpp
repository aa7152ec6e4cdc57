#pragma once

/// The fields of a ROS 2 message, named once in the order of its .msg file (waymark/recording/cdr.hpp).
#define WAYMARK_ROS2_FIELDS(...)                  \
  template <class Self, class Visit>              \
  static void fields(Self& self, Visit&& visit) { \
    visit(__VA_ARGS__);                           \
  }
