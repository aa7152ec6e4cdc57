#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipantListener.hpp>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

[[nodiscard]] Guid bytes_of(const eprosima::fastrtps::rtps::GUID_t& guid);

/// What others publish and subscribe to, as the threads of discovery report it.
class Discovered final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  [[nodiscard]] std::vector<BusEndpoint> endpoints() const;
  [[nodiscard]] std::vector<std::string> participants() const;
  [[nodiscard]] std::string participant_of(const waymark::Guid& endpoint) const;

  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override;
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;

 private:
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  void set(const Guid& guid, bool present, BusEndpoint endpoint);

  mutable std::mutex mutex_{};
  std::map<Guid, BusEndpoint> endpoints_{};
  std::map<Guid, std::string> participants_{};
};

}  // namespace waymark
