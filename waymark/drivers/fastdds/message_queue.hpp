#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "waymark/drivers/dds/bus.hpp"

namespace waymark {

/// Messages of all subscriptions in the order in which they came, from the threads of the network to the one
/// that takes them. Of each subscription at most its depth wait: the oldest are dropped and counted.
class MessageQueue {
 public:
  /// The number of a new subscription.
  std::size_t add(int depth);
  void push(BusMessage message);
  [[nodiscard]] std::optional<BusMessage> take(Duration most);
  [[nodiscard]] bool empty() const;
  [[nodiscard]] std::uint64_t dropped(std::size_t subscription) const;

 private:
  struct Subscription {
    std::size_t depth = 1;
    std::size_t waiting = 0;
    std::uint64_t dropped = 0;
  };

  mutable std::mutex mutex_{};
  std::condition_variable arrived_{};
  std::deque<BusMessage> messages_{};
  std::vector<Subscription> subscriptions_{};
};

}  // namespace waymark
