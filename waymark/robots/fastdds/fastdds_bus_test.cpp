// Tests the quality of service passed to Fast DDS, and serialised messages. Communication between
// participants is covered by tests/ros2.
#include "waymark/robots/fastdds/fastdds_bus.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <unistd.h>

#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastdds::rtps::UDPv4TransportDescriptor;

const UDPv4TransportDescriptor& udp_of(const dds::DomainParticipantQos& qos) {
  EXPECT_EQ(qos.transport().user_transports.size(), 1U);
  return dynamic_cast<const UDPv4TransportDescriptor&>(*qos.transport().user_transports.front());
}

std::string property(const dds::DomainParticipantQos& qos, const std::string& name) {
  for (const auto& one : qos.properties().properties())
    if (one.name() == name) return one.value();
  return {};
}

TEST(ParticipantQos, UsesOnlyUdpOnTheGivenInterfaces) {
  const auto all = participant_qos({});
  EXPECT_FALSE(all.transport().use_builtin_transports)
      << "no shared memory, because other users of a robot could not open it";
  EXPECT_TRUE(udp_of(all).interfaceWhiteList.empty());
  const auto some = participant_qos({.interfaces = {"10.0.0.2"}});
  EXPECT_EQ(udp_of(some).interfaceWhiteList, std::vector<std::string>{"10.0.0.2"});
  const auto local = participant_qos({.localhost_only = true, .interfaces = {"10.0.0.2"}});
  EXPECT_EQ(udp_of(local).interfaceWhiteList, std::vector<std::string>{"127.0.0.1"})
      << "nothing leaves the machine";
}

TEST(ParticipantQos, PeersAreContactedInAdditionToMulticast) {
  const auto qos = participant_qos({.peers = {"10.0.0.9"}});
  std::set<std::string> contacted;
  for (const auto& locator : qos.wire_protocol().builtin.initialPeersList) {
    std::string text;
    for (std::size_t i = 12; i < 16; ++i)
      text += (text.empty() ? "" : ".") + std::to_string(locator.address[i]);
    contacted.insert(text);
  }
  EXPECT_EQ(contacted, (std::set<std::string>{"10.0.0.9", "239.255.0.1"}));
  EXPECT_TRUE(participant_qos({}).wire_protocol().builtin.initialPeersList.empty())
      << "the default in Fast DDS";
}

TEST(ParticipantQos, ContainsNameAndEnclaveAsInRos) {
  const auto qos = participant_qos({.node = "robot", .enclave = "/lab"});
  EXPECT_TRUE(std::string(qos.name().c_str()).starts_with("robot (process ")) << qos.name().c_str();
  const auto& bytes = qos.user_data().getValue();
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "enclave=/lab;");
}

TEST(ParticipantQos, UsesTheCertificatesOfTheEnclave) {
  EXPECT_EQ(property(participant_qos({}), "dds.sec.auth.plugin"), "") << "no security by default";
  const auto qos = participant_qos({.keystore = "/keys/enclaves/lab"});
  EXPECT_EQ(property(qos, "dds.sec.auth.plugin"), "builtin.PKI-DH");
  EXPECT_EQ(property(qos, "dds.sec.crypto.plugin"), "builtin.AES-GCM-GMAC");
  EXPECT_EQ(property(qos, "dds.sec.auth.builtin.PKI-DH.private_key"), "file:///keys/enclaves/lab/key.pem");
  EXPECT_EQ(property(qos, "dds.sec.access.builtin.Access-Permissions.governance"),
            "file:///keys/enclaves/lab/governance.p7s");
}

TEST(TopicQos, SetsTheQosOfWritersAndReaders) {
  for (const bool reliable : {false, true}) {
    for (const bool local : {false, true}) {
      const TopicQos qos{.reliable = reliable, .transient_local = local, .depth = 7};
      const auto writer = writer_qos(qos);
      const auto reader = reader_qos(qos);
      EXPECT_EQ(writer.reliability().kind == dds::RELIABLE_RELIABILITY_QOS, reliable);
      EXPECT_EQ(reader.reliability().kind == dds::RELIABLE_RELIABILITY_QOS, reliable);
      EXPECT_EQ(writer.durability().kind == dds::TRANSIENT_LOCAL_DURABILITY_QOS, local);
      EXPECT_EQ(reader.durability().kind == dds::TRANSIENT_LOCAL_DURABILITY_QOS, local);
      EXPECT_EQ(writer.history().depth, 7);
      EXPECT_EQ(reader.history().depth, 7);
    }
  }
  EXPECT_EQ(writer_qos({.large = true}).publish_mode().kind, dds::ASYNCHRONOUS_PUBLISH_MODE);
  EXPECT_EQ(writer_qos({}).publish_mode().kind, dds::SYNCHRONOUS_PUBLISH_MODE);
}

TEST(RawCdr, RoundTripsBytes) {
  RawCdrType type("nav_msgs::msg::dds_::Odometry_");
  EXPECT_EQ(std::string(type.getName()), "nav_msgs::msg::dds_::Odometry_");
  auto* sent = static_cast<RawCdr*>(type.createData());
  for (int i = 0; i < 5000; ++i) sent->bytes.push_back(static_cast<std::uint8_t>(i));
  sent->bytes[0] = 0;
  for (const bool little : {true, false}) {
    sent->bytes[1] = little ? 1 : 0;
    EXPECT_EQ(type.getSerializedSizeProvider(sent)(), 5000U);
    rtps::SerializedPayload_t payload(5000);
    ASSERT_TRUE(type.serialize(sent, &payload));
    EXPECT_EQ(payload.encapsulation, little ? CDR_LE : CDR_BE);
    RawCdr received;
    ASSERT_TRUE(type.deserialize(&payload, &received));
    EXPECT_EQ(received.bytes, sent->bytes);
  }
  type.deleteData(sent);
}

TEST(RawCdr, RejectsBytesThatDoNotFit) {
  RawCdrType type("a::msg::dds_::B_");
  RawCdr large{std::vector<std::uint8_t>(100, 0)};
  rtps::SerializedPayload_t payload(99);
  EXPECT_FALSE(type.serialize(&large, &payload));
  RawCdr headless{{0, 1, 0}};
  EXPECT_FALSE(type.serialize(&headless, &payload)) << "three bytes cannot contain an encapsulation header";
  RawCdr empty;
  EXPECT_FALSE(type.serialize(&empty, &payload));
  rtps::InstanceHandle_t handle;
  EXPECT_FALSE(type.getKey(&large, &handle, false)) << "ROS messages have no keys";
}

TEST(Discovered, ListsAParticipantFromDiscoveryUntilItLeaves) {
  Discovered discovered;
  EXPECT_TRUE(discovered.endpoints().empty());
  EXPECT_TRUE(discovered.participants().empty());
  rtps::RTPSParticipantAllocationAttributes sizes;
  const auto report = [&](rtps::ParticipantDiscoveryInfo::DISCOVERY_STATUS status) {
    rtps::ParticipantProxyData data(sizes);
    data.m_guid.guidPrefix.value[0] = 7;
    data.m_participantName = "/robot";
    rtps::ParticipantDiscoveryInfo info(data);
    info.status = status;
    discovered.on_participant_discovery(nullptr, std::move(info));
  };
  report(rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT);
  report(rtps::ParticipantDiscoveryInfo::CHANGED_QOS_PARTICIPANT);
  EXPECT_EQ(discovered.participants(), std::vector<std::string>{"/robot"}) << "once";
  report(rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT);
  EXPECT_TRUE(discovered.participants().empty());
}

TEST(FastddsBus, EndpointsExcludeOwnTopics) {
  const auto bus = open_fastdds_bus({.domain = 1 + getpid() % 199, .localhost_only = true});
  ASSERT_TRUE(bus) << to_string(bus.error());
  const BusTopic own{"rt/own", "std_msgs::msg::dds_::String_"};
  ASSERT_TRUE((*bus)->subscribe(own, {}));
  ASSERT_TRUE((*bus)->advertise(own, {}));
  (void)(*bus)->next(std::chrono::milliseconds(500));
  for (const BusEndpoint& endpoint : (*bus)->endpoints()) EXPECT_NE(endpoint.name.topic, own.topic);
}

TEST(FastddsBus, MissingCertificatesAreAnErrorThatNamesTheFolder) {
  const auto bus = open_fastdds_bus({.localhost_only = true, .keystore = "/nowhere/enclave"});
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().place.source, "DDS");
  EXPECT_EQ(bus.error().code, ErrorCode::Unsupported);
  EXPECT_NE(bus.error().hint.find("/nowhere/enclave"), std::string::npos);
  testing::expect_on_page("robots", bus.error());
}

}  // namespace
}  // namespace waymark
