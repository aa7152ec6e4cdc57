#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/fake_bus.hpp"
#include "waymark/app/live/ros2_node.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark::test {

/// A node on its own network.
class Node : public ::testing::Test {
 protected:
  void SetUp() override { node_ = Ros2Node::start(std::make_unique<FakeBus>(network_), feed_).value(); }

  /// The messages of a topic once there are `many`; after ten seconds, those received so far.
  std::vector<std::vector<std::uint8_t>> sent(const std::string& topic, std::size_t many) {
    const Duration deadline = steady_now() + std::chrono::seconds(10);
    while (steady_now() < deadline) {
      {
        const std::scoped_lock lock(network_.mutex);
        if (network_.sent[topic].size() >= many) return network_.sent[topic];
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const std::scoped_lock lock(network_.mutex);
    return network_.sent[topic];
  }
  void request(const std::string& topic, const std::vector<std::uint8_t>& bytes,
               RequestIdentity identity = {}) {
    const std::scoped_lock lock(network_.mutex);
    for (std::size_t i = 0; i < network_.subscriptions.size(); ++i)
      if (network_.subscriptions[i] == topic) network_.waiting.push_back({i, bytes, {}, identity});
  }

  Network network_{};
  LiveFeed feed_{};
  std::unique_ptr<Ros2Node> node_{};
};

}  // namespace waymark::test
