#include "waymark/robots/fastdds/participant_qos.hpp"

#include <array>
#include <memory>
#include <string_view>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fmt/format.h>
#include <unistd.h>

namespace waymark {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastdds::rtps::UDPv4TransportDescriptor;

constexpr const char* kLoopback = "127.0.0.1";
constexpr const char* kDiscoveryGroup = "239.255.0.1";  // RTPS 2.2, section 9.6.1.4.1
constexpr std::uint32_t kParticipantsPerHost = 32;      // that are asked without multicast
constexpr std::uint32_t kSocketBuffer = 1U << 22U;
constexpr rtps::MemoryManagementPolicy_t kGrows = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
const eprosima::fastrtps::Duration_t kHeartbeat(0, 100'000'000U);

void add_peer(rtps::LocatorList_t& peers, const std::string& address) {
  rtps::Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  rtps::IPLocator::setIPv4(locator, address);
  peers.push_back(locator);
}

/// Certificates as SROS 2 lays them out in the folder of an enclave (DDS Security 1.1, section 9).
void add_security(dds::DomainParticipantQos& qos, const std::string& folder) {
  if (folder.empty()) return;
  auto& properties = qos.properties().properties();
  const auto set = [&](const char* name, std::string value) {
    properties.emplace_back(name, std::move(value));
  };
  const auto file = [&](std::string_view name) { return "file://" + folder + "/" + std::string(name); };
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set("dds.sec.auth.builtin.PKI-DH.identity_ca", file("identity_ca.cert.pem"));
  set("dds.sec.auth.builtin.PKI-DH.identity_certificate", file("cert.pem"));
  set("dds.sec.auth.builtin.PKI-DH.private_key", file("key.pem"));
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set("dds.sec.access.builtin.Access-Permissions.permissions_ca", file("permissions_ca.cert.pem"));
  set("dds.sec.access.builtin.Access-Permissions.governance", file("governance.p7s"));
  set("dds.sec.access.builtin.Access-Permissions.permissions", file("permissions.p7s"));
}

template <class Qos>
void set_common(Qos& q, const TopicQos& qos) {
  q.reliability().kind = qos.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  q.durability().kind =
      qos.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  q.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  q.history().depth = qos.depth;
  q.resource_limits().allocated_samples = qos.depth;
  q.endpoint().history_memory_policy = kGrows;
  q.data_sharing().off();
}

/// "waymark_robot (process 4711 on limo-7)": of several that are called alike it says which.
std::string name_for_people(const std::string& node) {
  std::array<char, 65> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return fmt::format("{} (process {} on {})", node, getpid(), host.data());
}

}  // namespace

dds::DomainParticipantQos participant_qos(const BusOptions& options) {
  dds::DomainParticipantQos qos;
  qos.name(name_for_people(options.node).c_str());
  const std::string enclave = "enclave=" + options.enclave + ";";  // what rmw looks for in a participant
  qos.user_data().setValue(std::vector<std::uint8_t>(enclave.begin(), enclave.end()));
  const auto udp = std::make_shared<UDPv4TransportDescriptor>();
  udp->maxInitialPeersRange = kParticipantsPerHost;
  udp->sendBufferSize = kSocketBuffer;
  udp->receiveBufferSize = kSocketBuffer;
  udp->interfaceWhiteList = options.interfaces;
  if (options.localhost_only) udp->interfaceWhiteList = {kLoopback};
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.readerHistoryMemoryPolicy = kGrows;
  builtin.writerHistoryMemoryPolicy = kGrows;
  // Unless said, one announces itself five times in half a second and then every three: who misses those, as
  // where another participant has just left the same port, is not found for seconds.
  builtin.discovery_config.leaseDuration_announcementperiod = {0, 500'000'000};
  if (options.localhost_only || !options.peers.empty()) {
    add_peer(builtin.initialPeersList, kDiscoveryGroup);
    if (options.localhost_only) add_peer(builtin.initialPeersList, kLoopback);
    for (const std::string& peer : options.peers) add_peer(builtin.initialPeersList, peer);
  }
  add_security(qos, options.keystore);
  return qos;
}

dds::DataWriterQos writer_qos(const TopicQos& qos) {
  dds::DataWriterQos q = dds::DATAWRITER_QOS_DEFAULT;
  set_common(q, qos);
  q.publish_mode().kind = qos.large ? dds::ASYNCHRONOUS_PUBLISH_MODE : dds::SYNCHRONOUS_PUBLISH_MODE;
  q.reliable_writer_qos().times.heartbeatPeriod = kHeartbeat;
  return q;
}

dds::DataReaderQos reader_qos(const TopicQos& qos) {
  dds::DataReaderQos q = dds::DATAREADER_QOS_DEFAULT;
  set_common(q, qos);
  return q;
}

}  // namespace waymark
