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

/// Services of type std_srvs/srv/Trigger. Clients using rmw_fastrtps identify a request by
/// related_sample_identity, and clients using rmw_cyclonedds by a 16-byte header before the request. The
/// reply has the same format.
class TriggerServices {
 public:
  explicit TriggerServices(Bus& bus) : bus_(bus) {}

  /// Offers a service such as "/waymark/stop"; receive() calls `answer` for each request.
  Status offer(const std::string& name, std::function<TriggerReply()> answer);
  /// Answers a request to one of the services; returns false if the message is not such a request.
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
