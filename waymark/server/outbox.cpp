#include "waymark/server/outbox.hpp"

#include <algorithm>
#include <utility>

namespace waymark {

bool Outbox::put(OutFrame frame) {
  if (frame.newest_of) {
    const auto old = std::ranges::find(frames_, frame.newest_of, &OutFrame::newest_of);
    if (old != frames_.end()) {
      bytes_ -= old->size();
      frames_.erase(old);
      ++dropped_;
    }
  }
  bytes_ += frame.size();
  frames_.push_back(std::move(frame));
  while (too_much()) {
    const auto oldest = std::ranges::find(frames_, false, &OutFrame::must_arrive);
    if (oldest == frames_.end()) return false;
    bytes_ -= oldest->size();
    frames_.erase(oldest);
    ++dropped_;
  }
  return true;
}

std::optional<OutFrame> Outbox::next() {
  if (frames_.empty()) return std::nullopt;
  OutFrame frame = std::move(frames_.front());
  frames_.pop_front();
  bytes_ -= frame.size();
  return frame;
}

}  // namespace waymark
