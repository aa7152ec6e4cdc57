#include "waymark/localization/timeline.hpp"

#include <algorithm>
#include <numeric>

namespace waymark {

Timeline::Timeline(std::size_t segments, std::size_t frames)
    : segments_(segments), frames_(frames), order_(frames) {
  std::iota(order_.begin(), order_.end(), 0U);
}

void Timeline::add(const MotionSegment& segment) {
  if (segment_count_ == segments_.size()) {
    first_segment_ = (first_segment_ + 1) % segments_.size();
    --segment_count_;
  }
  segments_[(first_segment_ + segment_count_) % segments_.size()] = segment;
  ++segment_count_;
  covered_ = segment.to;
}

FrameObservations& Timeline::add_frame(SensorTime stamp) {
  if (order_count_ == order_.size()) {
    std::rotate(order_.begin(), order_.begin() + 1, order_.end());
    --order_count_;
  }
  const std::uint32_t slot = order_[order_count_];
  std::size_t at = order_count_;
  while (at > 0 && frames_[order_[at - 1]].stamp > stamp) --at;
  const auto place = order_.begin() + static_cast<std::ptrdiff_t>(at);
  std::rotate(place, order_.begin() + static_cast<std::ptrdiff_t>(order_count_),
              order_.begin() + static_cast<std::ptrdiff_t>(order_count_) + 1);
  ++order_count_;
  FrameObservations& frame = frames_[slot];
  frame.stamp = stamp;
  frame.number = numbers_++;
  frame.sealed = true;
  frame.reported = false;
  frame.count = 0;
  return frame;
}

SensorTime Timeline::begin() const { return segment_count_ == 0 ? covered_ : segment(0).from; }

void Timeline::forget_before(SensorTime stamp) {
  while (segment_count_ > 0 && segment(0).to < stamp) {
    first_segment_ = (first_segment_ + 1) % segments_.size();
    --segment_count_;
  }
  std::size_t old = 0;
  while (old < order_count_ && frames_[order_[old]].stamp < stamp) ++old;
  std::rotate(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(old),
              order_.begin() + static_cast<std::ptrdiff_t>(order_count_));
  order_count_ -= old;
}

}  // namespace waymark
