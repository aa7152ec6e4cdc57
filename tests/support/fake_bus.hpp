#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "waymark/robots/dds/bus.hpp"

namespace waymark::test {

/// Messages published on a simulated network, and requests that wait for a subscriber.
struct Network {
  std::mutex mutex{};
  std::vector<std::string> publishers{};     ///< topics by number
  std::vector<std::string> subscriptions{};  ///< likewise
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> sent{};
  std::vector<BusMessage> waiting{};
  std::vector<RequestIdentity> answered{};
};

class FakeBus final : public Bus {
 public:
  explicit FakeBus(Network& network) : network_(network) {}

  Result<std::size_t> advertise(const BusTopic& topic, const TopicQos& /*qos*/) override {
    const std::scoped_lock lock(network_.mutex);
    network_.publishers.push_back(topic.topic);
    return network_.publishers.size() - 1;
  }
  Result<std::size_t> subscribe(const BusTopic& topic, const TopicQos& /*qos*/) override {
    const std::scoped_lock lock(network_.mutex);
    network_.subscriptions.push_back(topic.topic);
    return network_.subscriptions.size() - 1;
  }
  void unsubscribe(std::size_t /*subscription*/) override {}
  Status publish(std::size_t publisher, std::span<const std::uint8_t> bytes) override {
    const std::scoped_lock lock(network_.mutex);
    network_.sent[network_.publishers[publisher]].emplace_back(bytes.begin(), bytes.end());
    return {};
  }
  Status reply(std::size_t publisher, std::span<const std::uint8_t> bytes,
               const RequestIdentity& to) override {
    (void)publish(publisher, bytes);
    network_.answered.push_back(to);
    return {};
  }
  std::optional<BusMessage> next(Duration most) override {
    {
      const std::scoped_lock lock(network_.mutex);
      if (!network_.waiting.empty()) {
        BusMessage message = network_.waiting.front();
        network_.waiting.erase(network_.waiting.begin());
        return message;
      }
    }
    std::this_thread::sleep_for(most);
    return std::nullopt;
  }
  [[nodiscard]] bool more() const override { return false; }
  [[nodiscard]] int matched_subscriptions(std::size_t /*publisher*/) const override { return 1; }
  [[nodiscard]] int matched_publishers(std::size_t /*subscription*/) const override { return 1; }
  [[nodiscard]] std::uint64_t dropped(std::size_t /*subscription*/) const override { return 0; }
  [[nodiscard]] std::vector<BusEndpoint> endpoints() const override { return {}; }
  [[nodiscard]] std::vector<std::string> participants() const override { return {}; }
  [[nodiscard]] std::string participant_of(const Guid& /*endpoint*/) const override { return {}; }

 private:
  Network& network_;
};

}  // namespace waymark::test
