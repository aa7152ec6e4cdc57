#include "waymark/robots/watchdog/lines.hpp"

#include <algorithm>
#include <utility>

namespace waymark {

void LineSplitter::add(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view piece = bytes.substr(0, end);
    const std::size_t room = longest_ - std::min(longest_, partial_.size());
    too_long_ = too_long_ || piece.size() > room;
    partial_.append(piece.substr(0, room));
    if (end == std::string_view::npos) return;
    ready_.push_back({++lines_, std::exchange(partial_, {}), std::exchange(too_long_, false)});
    bytes.remove_prefix(end + 1);
  }
}

std::optional<Line> LineSplitter::next() {
  if (ready_.empty()) return std::nullopt;
  Line line = std::move(ready_.front());
  ready_.pop_front();
  return line;
}

std::optional<Line> LineSplitter::rest() {
  if (partial_.empty() && !too_long_) return std::nullopt;
  return Line{++lines_, std::exchange(partial_, {}), std::exchange(too_long_, false)};
}

void LineQueue::push(std::string line) {
  bytes_ += line.size();
  lines_.push_back(std::move(line));
  // The first line may be half written: it stays.
  while (bytes_ > most_bytes_ && lines_.size() > 2) {
    const auto oldest = lines_.begin() + 1;
    bytes_ -= oldest->size();
    lines_.erase(oldest);
    ++dropped_;
  }
}

void LineQueue::pop(std::size_t bytes) {
  written_ += bytes;
  if (written_ < lines_.front().size()) return;
  bytes_ -= lines_.front().size();
  written_ = 0;
  lines_.pop_front();
}

}  // namespace waymark
