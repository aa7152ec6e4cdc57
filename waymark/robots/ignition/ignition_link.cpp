#include "waymark/robots/ignition/ignition_link.hpp"

#include <chrono>
#include <cstdlib>
#include <deque>
#include <memory>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <ignition/transport/Node.hh>

#include "waymark/modules/arrival_queue.hpp"
#include "waymark/robots/ignition/values.hpp"

namespace waymark {
namespace {

/// A received message that is still serialised.
struct Arrived {
  std::size_t subscription = 0;
  std::string type{};
  std::string bytes{};
  Duration arrived{};
};

class IgnitionLink final : public GazeboLink {
 public:
  Result<std::size_t> subscribe(const std::string& topic, int depth) override {
    const std::size_t number = queue_->add(depth);
    const auto put = [queue = queue_, number](const char* bytes, std::size_t size,
                                              const ignition::transport::MessageInfo& info) {
      queue->push({number, info.Type(), std::string(bytes, size),
                   std::chrono::steady_clock::now().time_since_epoch()});
    };
    if (node_.SubscribeRaw(topic, put)) return number;
    return fail(ErrorCode::InvalidArgument, "Ignition Transport rejects the topic", {.key = topic},
                "Use a name such as /model/limo/odometry, without spaces.");
  }

  void unsubscribe(const std::string& topic) override { (void)node_.Unsubscribe(topic); }

  Result<std::size_t> advertise(const std::string& topic, const GazeboValue& like) override {
    const auto publisher = node_.Advertise(topic, type_of(like));
    if (!publisher.Valid())
      return fail(ErrorCode::InvalidArgument, "Ignition Transport rejects the topic", {.key = topic},
                  "Use a name such as /model/limo/cmd_vel, without spaces.");
    publishers_.push_back({publisher, topic, type_of(like)});
    return publishers_.size() - 1;
  }

  Status publish(std::size_t publisher, const GazeboValue& value) override {
    Publisher& out = publishers_[publisher];
    if (out.node.PublishRaw(serialize_gazebo(value), out.type)) return {};
    return fail(ErrorCode::Unwritable, "cannot send a message", {.key = out.topic});
  }

  std::optional<GazeboMessage> next(Duration timeout) override {
    const auto came = queue_->take(timeout);
    if (!came) return std::nullopt;
    return GazeboMessage{came->subscription, came->type, parse_gazebo(came->type, came->bytes),
                         came->arrived};
  }

  [[nodiscard]] bool has_subscriber(std::size_t publisher) const override {
    return publishers_[publisher].node.HasConnections();
  }

  [[nodiscard]] std::vector<GazeboTopic> topics() const override {
    std::set<std::string> own;
    for (const Publisher& publisher : publishers_) own.insert(publisher.topic);
    std::vector<std::string> names;
    node_.TopicList(names);
    std::vector<GazeboTopic> found;
    for (std::string& name : names) {
      std::vector<ignition::transport::MessagePublisher> publishers;
      if (own.contains(name) || !node_.TopicInfo(name, publishers) || publishers.empty()) continue;
      found.push_back({std::move(name), publishers.front().MsgTypeName()});
    }
    return found;
  }

  [[nodiscard]] std::vector<std::string> publishers(const std::string& topic) const override {
    std::vector<ignition::transport::MessagePublisher> found;
    std::vector<std::string> addresses;
    if (!node_.TopicInfo(topic, found)) return addresses;
    for (const auto& publisher : found) addresses.push_back(publisher.Addr());
    return addresses;
  }

  [[nodiscard]] std::string where() const override {
    const char* address = std::getenv("IGN_IP");
    return fmt::format("searched partition '{}' on {}", node_.Options().Partition(),
                       address == nullptr ? std::string("all addresses (IGN_IP is not set)")
                                          : fmt::format("address {} (IGN_IP)", address));
  }

 private:
  struct Publisher {
    ignition::transport::Node::Publisher node;
    std::string topic;
    std::string type;
  };

  // Shared with the callbacks, because a thread of the library may still be running one when the node is
  // destroyed.
  std::shared_ptr<ArrivalQueue<Arrived>> queue_ = std::make_shared<ArrivalQueue<Arrived>>();
  std::deque<Publisher> publishers_{};
  ignition::transport::Node node_{};
};

}  // namespace

Result<std::unique_ptr<GazeboLink>> open_ignition_link() { return std::make_unique<IgnitionLink>(); }

}  // namespace waymark
