#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/base/time.hpp"

namespace waymark {

/// A queue from the network threads to one receiver. It holds the messages of all subscriptions in order of
/// arrival. At most `depth` messages per subscription are queued; when the queue is full, the oldest are
/// dropped and counted. `Message` must have a member `subscription` with the number of its subscription.
/// Thread-safe.
template <class Message>
class ArrivalQueue {
 public:
  /// Adds a subscription and returns its number. A depth below 1 counts as 1.
  std::size_t add(int depth) {
    const std::lock_guard lock(mutex_);
    subscriptions_.push_back({.depth = static_cast<std::size_t>(std::max(1, depth))});
    return subscriptions_.size() - 1;
  }

  void push(Message message) {
    {
      const std::lock_guard lock(mutex_);
      Subscription& subscription = subscriptions_[message.subscription];
      if (subscription.waiting == subscription.depth) {
        messages_.erase(std::ranges::find(messages_, message.subscription, &Message::subscription));
        --subscription.waiting;
        ++subscription.dropped;
      }
      ++subscription.waiting;
      messages_.push_back(std::move(message));
    }
    arrived_.notify_one();
  }

  /// Removes and returns the oldest message; empty if none arrives within `timeout`.
  [[nodiscard]] std::optional<Message> take(Duration timeout) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_for(lock, timeout, [this] { return !messages_.empty(); })) return std::nullopt;
    Message message = std::move(messages_.front());
    messages_.pop_front();
    --subscriptions_[message.subscription].waiting;
    return message;
  }

  [[nodiscard]] bool empty() const {
    const std::lock_guard lock(mutex_);
    return messages_.empty();
  }

  [[nodiscard]] std::uint64_t dropped(std::size_t subscription) const {
    const std::lock_guard lock(mutex_);
    return subscriptions_[subscription].dropped;
  }

 private:
  struct Subscription {
    std::size_t depth = 1;
    std::size_t waiting = 0;
    std::uint64_t dropped = 0;
  };

  mutable std::mutex mutex_{};
  std::condition_variable arrived_{};
  std::deque<Message> messages_{};
  std::vector<Subscription> subscriptions_{};
};

}  // namespace waymark
