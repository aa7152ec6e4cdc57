#include "waymark/robots/fastdds/discovered.hpp"

#include <algorithm>
#include <utility>

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>

namespace waymark {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

template <class Proxy>
BusEndpoint endpoint_of(const Proxy& proxy, bool publishes) {
  BusEndpoint endpoint{.publishes = publishes,
                       .name = {proxy.topicName().to_string(), proxy.typeName().to_string()}};
  endpoint.qos.reliable = proxy.m_qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS;
  endpoint.qos.transient_local = proxy.m_qos.m_durability.kind != dds::VOLATILE_DURABILITY_QOS;
  endpoint.guid = bytes_of(proxy.guid());
  return endpoint;
}

/// Fast DDS tells of a participant's own readers and writers, too.
bool is_own(const dds::DomainParticipant* participant, const rtps::GUID_t& endpoint) {
  return participant != nullptr && participant->guid().guidPrefix == endpoint.guidPrefix;
}

}  // namespace

Guid bytes_of(const rtps::GUID_t& guid) {
  Guid bytes{};
  std::copy_n(guid.guidPrefix.value, 12, bytes.begin());
  std::copy_n(guid.entityId.value, 4, bytes.begin() + 12);
  return bytes;
}

std::vector<BusEndpoint> Discovered::endpoints() const {
  const std::lock_guard lock(mutex_);
  std::vector<BusEndpoint> all;
  all.reserve(endpoints_.size());
  for (const auto& [guid, endpoint] : endpoints_) all.push_back(endpoint);
  return all;
}

std::vector<std::string> Discovered::participants() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> all;
  all.reserve(participants_.size());
  for (const auto& [guid, name] : participants_) all.push_back(name);
  return all;
}

/// What one participant has begins with the twelve bytes of its own identity.
std::string Discovered::participant_of(const waymark::Guid& endpoint) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(participants_, [&](const auto& entry) {
    return std::equal(endpoint.begin(), endpoint.begin() + 12, entry.first.guidPrefix.value);
  });
  return found == participants_.end() ? std::string() : found->second;
}

void Discovered::set(const Guid& guid, bool present, BusEndpoint endpoint) {
  const std::lock_guard lock(mutex_);
  if (present)
    endpoints_[guid] = std::move(endpoint);
  else
    endpoints_.erase(guid);
}

void Discovered::on_participant_discovery(dds::DomainParticipant* /*participant*/,
                                          rtps::ParticipantDiscoveryInfo&& info) {
  const std::lock_guard lock(mutex_);
  const bool present = info.status == rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT ||
                       info.status == rtps::ParticipantDiscoveryInfo::CHANGED_QOS_PARTICIPANT;
  if (present) {
    participants_[info.info.m_guid] = info.info.m_participantName.to_string();
    return;
  }
  participants_.erase(info.info.m_guid);
  std::erase_if(endpoints_,
                [&](const auto& entry) { return entry.first.guidPrefix == info.info.m_guid.guidPrefix; });
}

void Discovered::on_subscriber_discovery(dds::DomainParticipant* participant,
                                         rtps::ReaderDiscoveryInfo&& info) {
  if (is_own(participant, info.info.guid())) return;
  set(info.info.guid(), info.status != rtps::ReaderDiscoveryInfo::REMOVED_READER,
      endpoint_of(info.info, false));
}

void Discovered::on_publisher_discovery(dds::DomainParticipant* participant,
                                        rtps::WriterDiscoveryInfo&& info) {
  if (is_own(participant, info.info.guid())) return;
  set(info.info.guid(), info.status != rtps::WriterDiscoveryInfo::REMOVED_WRITER,
      endpoint_of(info.info, true));
}

}  // namespace waymark
