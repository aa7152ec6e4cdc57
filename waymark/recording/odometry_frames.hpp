#pragma once

#include <string>

namespace waymark {

/// The transforms of one topic between two frames, as a source of odometry. Frames have no leading slash.
struct OdometryFrames {
  std::string topic{};
  std::string parent{};  ///< odom, in any namespace
  std::string child{};   ///< the base

  bool operator==(const OdometryFrames&) const = default;
};

}  // namespace waymark
