#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// A serialised message: CDR with its encapsulation header.
struct RawCdr {
  std::vector<std::uint8_t> bytes{};
};

/// A Fast DDS type with an arbitrary type name for messages that are already serialised.
class RawCdrType final : public eprosima::fastdds::dds::TopicDataType {
 public:
  explicit RawCdrType(const std::string& dds_name);

  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override;
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override;
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override;
  void* createData() override;
  void deleteData(void* data) override;
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool force_md5) override;
};

/// Quality of service for a participant that acts like a ROS 2 node, over UDP only, with the interfaces and
/// peers from the options.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipantQos participant_qos(const BusOptions& options);
[[nodiscard]] eprosima::fastdds::dds::DataWriterQos writer_qos(const TopicQos& qos);
[[nodiscard]] eprosima::fastdds::dds::DataReaderQos reader_qos(const TopicQos& qos);

[[nodiscard]] Guid bytes_of(const eprosima::fastrtps::rtps::GUID_t& guid);

/// Publishers and subscriptions of other participants, as reported by the discovery threads.
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

/// Joins the domain with a Fast DDS participant over UDP. Fails if the participant cannot be created, for
/// example because the interface does not exist, no port is free, or certificates are rejected.
[[nodiscard]] Result<std::unique_ptr<Bus>> open_fastdds_bus(const BusOptions& options);

}  // namespace waymark
