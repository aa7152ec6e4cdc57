#include "waymark/robots/ros2/trigger_service.hpp"

#include <utility>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

/// cdds_request_header_t from rmw_cyclonedds.
struct CycloneHeader {
  std::uint64_t guid = 0;
  std::int64_t sequence = 0;
  WAYMARK_ROS2_FIELDS(self.guid, self.sequence)
};

struct Response {
  bool success = false;
  std::string message{};
  WAYMARK_ROS2_FIELDS(self.success, self.message)
};

struct CycloneResponse {
  CycloneHeader header{};
  Response response{};
  WAYMARK_ROS2_FIELDS(self.header, self.response)
};

constexpr std::size_t kWithCycloneHeader = 4 + 16;  // encapsulation header and request header
constexpr TopicQos kServiceQos{.reliable = true, .depth = 10};

}  // namespace

Status TriggerServices::offer(const std::string& name, std::function<TriggerReply()> answer) {
  const ServiceTopics topics = dds_service(name, "std_srvs/srv/Trigger");
  const auto replies = bus_.advertise(topics.reply, kServiceQos);
  if (!replies) return tl::unexpected(replies.error());
  const auto requests = bus_.subscribe(topics.request, kServiceQos);
  if (!requests) return tl::unexpected(requests.error());
  services_[*requests] = {*replies, std::move(answer)};
  return {};
}

bool TriggerServices::receive(const BusMessage& message) {
  const auto found = services_.find(message.subscription);
  if (found == services_.end()) return false;
  const Service& service = found->second;
  const bool headed = message.bytes.size() >= kWithCycloneHeader;
  const auto header =
      headed ? cdr::decode<CycloneHeader>(message.bytes) : Result<CycloneHeader>(CycloneHeader{});
  if (!header) return true;
  TriggerReply reply = service.answer();
  const Response response{reply.success, std::move(reply.message)};
  // Errors are ignored, because the client may have disconnected.
  if (headed)
    (void)bus_.publish(service.replies, cdr::encode(CycloneResponse{*header, response}));
  else
    (void)bus_.reply(service.replies, cdr::encode(response), message.identity);
  return true;
}

}  // namespace waymark
