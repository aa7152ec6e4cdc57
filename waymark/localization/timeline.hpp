#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "waymark/localization/motion_input.hpp"
#include "waymark/localization/observation.hpp"

namespace waymark {

/// All that was seen at one moment.
struct FrameObservations {
  static constexpr std::size_t kMost = 16;
  SensorTime stamp{};
  std::uint64_t number = 0;  ///< order of arrival among equal stamps
  bool sealed = true;        ///< no more will be added
  bool reported = false;
  std::array<Observation, kMost> seen{};
  std::size_t count = 0;
};

/// The last second of motion and looks, in order of stamps: what a filter needs to go back in time. All
/// memory is taken at construction.
class Timeline {
 public:
  Timeline(std::size_t segments, std::size_t frames);

  void add(const MotionSegment& segment);
  /// A slot for a look, put where its stamp belongs. The oldest goes when all are taken.
  FrameObservations& add_frame(SensorTime stamp);

  [[nodiscard]] SensorTime covered() const { return covered_; }
  [[nodiscard]] bool empty() const { return segment_count_ == 0; }
  /// The oldest moment to which one can go back.
  [[nodiscard]] SensorTime begin() const;
  /// Forgets what ended before.
  void forget_before(SensorTime stamp);

  [[nodiscard]] std::size_t segments() const { return segment_count_; }
  [[nodiscard]] const MotionSegment& segment(std::size_t i) const {
    return segments_[(first_segment_ + i) % segments_.size()];
  }
  /// In order of (stamp, arrival).
  [[nodiscard]] std::size_t frames() const { return order_count_; }
  [[nodiscard]] FrameObservations& frame(std::size_t i) { return frames_[order_[i]]; }

 private:
  std::vector<MotionSegment> segments_;
  std::size_t first_segment_ = 0;
  std::size_t segment_count_ = 0;
  std::vector<FrameObservations> frames_;
  std::vector<std::uint32_t> order_;  ///< slots of looks in order of time, then the free ones
  std::size_t order_count_ = 0;
  std::uint64_t numbers_ = 0;
  SensorTime covered_{};
};

}  // namespace waymark
