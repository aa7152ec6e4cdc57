#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "waymark/recording/byte_io.hpp"

namespace waymark {

/// One frame for a viewer. The body is shared among viewers, the head is its own.
struct OutFrame {
  bool text = false;
  std::string head{};                        ///< all of a text; the first bytes of a binary frame
  std::shared_ptr<const Bytes> body{};       ///< the rest, if any
  std::optional<std::uint32_t> newest_of{};  ///< replaces what waits with the same mark
  bool must_arrive = false;                  ///< never dropped; without it the viewer makes no sense

  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0); }
};

/// What waits for one viewer: bounded in number and bytes. A viewer that does not keep up loses the oldest of
/// what may be lost, and it is counted.
class Outbox {
 public:
  static constexpr std::size_t kMostFrames = 256;
  static constexpr std::size_t kMostBytes = std::size_t{4} << 20U;

  /// False when even what must arrive does not fit: the viewer has stopped reading and should be let go.
  [[nodiscard]] bool put(OutFrame frame);
  [[nodiscard]] std::optional<OutFrame> next();
  [[nodiscard]] bool empty() const { return frames_.empty(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  [[nodiscard]] bool too_much() const { return frames_.size() > kMostFrames || bytes_ > kMostBytes; }

  std::deque<OutFrame> frames_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace waymark
