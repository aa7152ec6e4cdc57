#include "waymark/drivers/fastdds/message_queue.hpp"

#include <algorithm>
#include <utility>

namespace waymark {

std::size_t MessageQueue::add(int depth) {
  const std::lock_guard lock(mutex_);
  subscriptions_.push_back({.depth = static_cast<std::size_t>(std::max(1, depth))});
  return subscriptions_.size() - 1;
}

void MessageQueue::push(BusMessage message) {
  {
    const std::lock_guard lock(mutex_);
    Subscription& subscription = subscriptions_[message.subscription];
    if (subscription.waiting == subscription.depth) {
      messages_.erase(std::ranges::find(messages_, message.subscription, &BusMessage::subscription));
      --subscription.waiting;
      ++subscription.dropped;
    }
    ++subscription.waiting;
    messages_.push_back(std::move(message));
  }
  arrived_.notify_one();
}

std::optional<BusMessage> MessageQueue::take(Duration most) {
  std::unique_lock lock(mutex_);
  if (!arrived_.wait_for(lock, most, [this] { return !messages_.empty(); })) return std::nullopt;
  BusMessage message = std::move(messages_.front());
  messages_.pop_front();
  --subscriptions_[message.subscription].waiting;
  return message;
}

bool MessageQueue::empty() const {
  const std::lock_guard lock(mutex_);
  return messages_.empty();
}

std::uint64_t MessageQueue::dropped(std::size_t subscription) const {
  const std::lock_guard lock(mutex_);
  return subscriptions_[subscription].dropped;
}

}  // namespace waymark
