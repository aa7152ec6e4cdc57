#pragma once

#include "waymark/recording/sample_recorder.hpp"

namespace waymark::topics {

// The topic of each kind of sample. Tags have two: TagFrame is recorded with its corner covariances.
[[nodiscard]] inline const char* of(const TagFrame& /**/) { return kTags; }
[[nodiscard]] inline const char* of(const Odometry& /**/) { return kOdometry; }
[[nodiscard]] inline const char* of(const WheelTicks& /**/) { return kWheels; }
[[nodiscard]] inline const char* of(const ImuSample& /**/) { return kImu; }
[[nodiscard]] inline const char* of(const StampedCommand& /**/) { return kCommand; }
[[nodiscard]] inline const char* of(const TruthPose& /**/) { return kTruth; }
[[nodiscard]] inline const char* of(const CameraFrame& /**/) { return kImage; }
[[nodiscard]] inline const char* of(const TagPoseFrame& /**/) { return kTagPoses; }
[[nodiscard]] inline const char* of(const RangeBearing& /**/) { return kRangeBearing; }
[[nodiscard]] inline const char* of(const LaserScan& /**/) { return kScan; }
[[nodiscard]] inline const char* of(const GamepadState& /**/) { return kGamepad; }

}  // namespace waymark::topics
