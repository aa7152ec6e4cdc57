#pragma once

#include <functional>
#include <map>
#include <string>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

struct TriggerReply {
  bool success = false;
  std::string message{};
};

/// Services of type std_srvs/srv/Trigger. Clients on rmw_fastrtps are told apart by the identity of their
/// sample (related_sample_identity), those on rmw_cyclonedds by a header of 16 bytes before the request; each
/// gets its reply in its own way.
class TriggerServices {
 public:
  explicit TriggerServices(Bus& bus) : bus_(bus) {}

  /// Offers "/waymark/stop" and the like; `answer` is called for each request by receive().
  Status offer(const std::string& name, std::function<TriggerReply()> answer);
  /// Answers, where the message is a request to one of the services; false: it is not.
  bool receive(const BusMessage& message);

 private:
  struct Service {
    std::size_t replies = 0;
    std::function<TriggerReply()> answer;
  };
  Bus& bus_;
  std::map<std::size_t, Service> services_{};  ///< by subscription
};

}  // namespace waymark
