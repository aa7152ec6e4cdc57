#include "waymark/robots/fastdds/fastdds_bus.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <deque>
#include <memory>
#include <string_view>
#include <utility>

#include <unistd.h>

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastrtps/utils/IPLocator.h>
#include <fmt/format.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include "waymark/modules/arrival_queue.hpp"

namespace waymark {
namespace {

constexpr std::uint32_t kInitialSize = 1024;  // initial size of histories in bytes; they grow as needed
constexpr std::size_t kEncapsulation = 4;

RawCdr& raw(void* data) { return *static_cast<RawCdr*>(data); }

}  // namespace

RawCdrType::RawCdrType(const std::string& dds_name) {
  setName(dds_name.c_str());
  m_typeSize = kInitialSize;
  m_isGetKeyDefined = false;
  auto_fill_type_information(false);
  auto_fill_type_object(false);
}

bool RawCdrType::serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) {
  const std::vector<std::uint8_t>& bytes = raw(data).bytes;
  if (bytes.size() < kEncapsulation || payload->max_size < bytes.size()) return false;
  std::memcpy(payload->data, bytes.data(), bytes.size());
  payload->length = static_cast<std::uint32_t>(bytes.size());
  payload->encapsulation = (bytes[1] & 1U) != 0 ? CDR_LE : CDR_BE;
  return true;
}

bool RawCdrType::deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) {
  raw(data).bytes.assign(payload->data, payload->data + payload->length);
  return true;
}

std::function<std::uint32_t()> RawCdrType::getSerializedSizeProvider(void* data) {
  return [data] { return static_cast<std::uint32_t>(raw(data).bytes.size()); };
}

void* RawCdrType::createData() { return new RawCdr; }

void RawCdrType::deleteData(void* data) { delete static_cast<RawCdr*>(data); }

bool RawCdrType::getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* /*handle*/,
                        bool /*force_md5*/) {
  return false;
}

namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastdds::rtps::UDPv4TransportDescriptor;

constexpr const char* kLoopback = "127.0.0.1";
constexpr const char* kDiscoveryGroup = "239.255.0.1";  // RTPS 2.2, section 9.6.1.4.1
constexpr std::uint32_t kParticipantsPerHost = 32;      // number contacted when there is no multicast
constexpr std::uint32_t kSocketBuffer = 1U << 22U;
constexpr rtps::MemoryManagementPolicy_t kGrows = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
const eprosima::fastrtps::Duration_t kHeartbeat(0, 100'000'000U);

void add_peer(rtps::LocatorList_t& peers, const std::string& address) {
  rtps::Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  rtps::IPLocator::setIPv4(locator, address);
  peers.push_back(locator);
}

/// Sets the certificates from the folder of an SROS 2 enclave (DDS Security 1.1, section 9).
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

/// A name such as "waymark_robot (process 4711 on limo-7)", which distinguishes nodes with the same name.
std::string participant_name(const std::string& node) {
  std::array<char, 65> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return fmt::format("{} (process {} on {})", node, getpid(), host.data());
}

}  // namespace

dds::DomainParticipantQos participant_qos(const BusOptions& options) {
  dds::DomainParticipantQos qos;
  qos.name(participant_name(options.node).c_str());
  const std::string enclave = "enclave=" + options.enclave + ";";  // rmw reads the enclave from the user data
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
  // By default, a participant announces itself five times in half a second and then every three seconds. A
  // participant that misses the first announcements, for example because a port has just been reused, would
  // only discover it seconds later.
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

/// Whether the endpoint belongs to this participant, because Fast DDS also reports its endpoints.
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

/// The GUIDs of a participant's endpoints begin with the twelve-byte prefix of the participant.
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

namespace {

namespace dds = eprosima::fastdds::dds;

/// As in rmw_fastrtps: the client's reader if the request contains it, otherwise its writer.
RequestIdentity identity_of(const dds::SampleInfo& info) {
  const auto& related = info.related_sample_identity.writer_guid();
  const bool named = related != eprosima::fastrtps::rtps::GUID_t::unknown();
  const auto& guid = named ? related : info.sample_identity.writer_guid();
  return {bytes_of(guid), static_cast<std::int64_t>(info.sample_identity.sequence_number().to64long())};
}

/// Pushes received messages into the queue, on the thread that received them.
class Arrival final : public dds::DataReaderListener {
 public:
  Arrival(ArrivalQueue<BusMessage>& queue, std::size_t number) : queue_(queue), number_(number) {}

  void on_data_available(dds::DataReader* reader) override {
    RawCdr raw;
    dds::SampleInfo info;
    while (reader->take_next_sample(&raw, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      queue_.push({number_, std::exchange(raw.bytes, {}), std::chrono::steady_clock::now().time_since_epoch(),
                   identity_of(info)});
    }
  }

 private:
  ArrivalQueue<BusMessage>& queue_;
  std::size_t number_;
};

class FastddsBus final : public Bus {
 public:
  Status join(const BusOptions& options);
  ~FastddsBus() override;

  Result<std::size_t> advertise(const BusTopic& topic, const TopicQos& qos) override;
  Result<std::size_t> subscribe(const BusTopic& topic, const TopicQos& qos) override;
  void unsubscribe(std::size_t subscription) override;
  Status publish(std::size_t publisher, std::span<const std::uint8_t> bytes) override;
  Status reply(std::size_t publisher, std::span<const std::uint8_t> bytes,
               const RequestIdentity& to) override;
  std::optional<BusMessage> next(Duration timeout) override { return queue_.take(timeout); }
  [[nodiscard]] bool more() const override { return !queue_.empty(); }
  [[nodiscard]] int matched_subscriptions(std::size_t publisher) const override;
  [[nodiscard]] int matched_publishers(std::size_t subscription) const override;
  [[nodiscard]] std::uint64_t dropped(std::size_t subscription) const override {
    return queue_.dropped(subscription);
  }
  [[nodiscard]] std::vector<BusEndpoint> endpoints() const override { return discovered_.endpoints(); }
  [[nodiscard]] std::vector<std::string> participants() const override { return discovered_.participants(); }
  [[nodiscard]] std::string participant_of(const Guid& endpoint) const override {
    return discovered_.participant_of(endpoint);
  }

 private:
  Result<dds::Topic*> topic(const BusTopic& name);
  Result<dds::DataWriter*> make_writer(const BusTopic& name, const TopicQos& qos);
  void describe_self();

  Discovered discovered_{};
  ArrivalQueue<BusMessage> queue_{};
  std::deque<Arrival> arrivals_{};
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  std::vector<dds::DataWriter*> writers_{};
  std::vector<dds::DataReader*> readers_{};
  std::optional<SelfDescription> self_{};
  dds::DataWriter* self_writer_ = nullptr;
};

Status FastddsBus::join(const BusOptions& options) {
  dds::Log::ClearConsumers();  // keeps Fast DDS from printing to the program's output
  const dds::StatusMask discovery_only = dds::StatusMask::none();
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<dds::DomainId_t>(options.domain), participant_qos(options), &discovered_, discovery_only);
  if (participant_ != nullptr) publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  if (participant_ != nullptr) subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ != nullptr && subscriber_ != nullptr) {
    self_ = options.self;
    describe_self();
    return {};
  }
  return fail(ErrorCode::Unsupported, fmt::format("cannot join domain {}", options.domain), {.source = "DDS"},
              options.keystore.empty()
                  ? "Check that the network interface exists and is up."
                  : "Check that the certificates in " + options.keystore + " are complete and valid.");
}

FastddsBus::~FastddsBus() {
  if (participant_ == nullptr) return;
  (void)participant_->delete_contained_entities();
  (void)dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

Result<dds::Topic*> FastddsBus::topic(const BusTopic& name) {
  if (auto* existing = dynamic_cast<dds::Topic*>(participant_->lookup_topicdescription(name.topic))) {
    if (existing->get_type_name() == name.type) return existing;
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the topic already has type {}, not {}", existing->get_type_name(), name.type),
                {.key = name.topic});
  }
  const dds::TypeSupport type(new RawCdrType(name.type));
  (void)type.register_type(participant_);
  auto* made = participant_->create_topic(name.topic, name.type, dds::TOPIC_QOS_DEFAULT);
  if (made == nullptr)
    return fail(ErrorCode::InvalidArgument, "DDS rejects the topic or its type " + name.type,
                {.key = name.topic});
  return made;
}

/// Best effort: if the message is lost, the only effect is that `ros2 node list` does not show the node.
void FastddsBus::describe_self() {
  if (!self_) return;
  if (self_writer_ == nullptr)
    self_writer_ = make_writer(self_->name, {.transient_local = true, .depth = 1}).value_or(nullptr);
  if (self_writer_ == nullptr) return;
  OwnEndpoints own{.participant = bytes_of(participant_->guid())};
  for (const dds::DataWriter* writer : writers_) own.publishers.push_back(bytes_of(writer->guid()));
  for (const dds::DataReader* reader : readers_)
    if (reader != nullptr) own.subscriptions.push_back(bytes_of(reader->guid()));
  RawCdr raw{self_->bytes(own)};
  (void)self_writer_->write(&raw);
}

Result<dds::DataWriter*> FastddsBus::make_writer(const BusTopic& name, const TopicQos& qos) {
  const auto topic = this->topic(name);
  if (!topic) return tl::unexpected(topic.error());
  dds::DataWriter* writer = publisher_->create_datawriter(*topic, writer_qos(qos));
  if (writer == nullptr)
    return fail(ErrorCode::Unsupported, "DDS cannot create a publisher", {.key = name.topic});
  return writer;
}

Result<std::size_t> FastddsBus::advertise(const BusTopic& name, const TopicQos& qos) {
  const auto writer = make_writer(name, qos);
  if (!writer) return tl::unexpected(writer.error());
  writers_.push_back(*writer);
  describe_self();
  return writers_.size() - 1;
}

Result<std::size_t> FastddsBus::subscribe(const BusTopic& name, const TopicQos& qos) {
  const auto topic = this->topic(name);
  if (!topic) return tl::unexpected(topic.error());
  const std::size_t number = queue_.add(qos.depth);
  Arrival& arrival = arrivals_.emplace_back(queue_, number);
  dds::DataReader* reader = subscriber_->create_datareader(*topic, reader_qos(qos), &arrival);
  if (reader == nullptr)
    return fail(ErrorCode::Unsupported, "DDS cannot create a subscription", {.key = name.topic});
  readers_.push_back(reader);
  describe_self();
  return number;
}

void FastddsBus::unsubscribe(std::size_t subscription) {
  dds::DataReader* reader = std::exchange(readers_[subscription], nullptr);
  if (reader == nullptr) return;
  (void)reader->set_listener(nullptr);
  (void)subscriber_->delete_datareader(reader);
  describe_self();
}

Status FastddsBus::publish(std::size_t publisher, std::span<const std::uint8_t> bytes) {
  RawCdr raw{{bytes.begin(), bytes.end()}};
  if (writers_[publisher]->write(&raw)) return {};
  return fail(ErrorCode::Unwritable, fmt::format("cannot send a message of {} bytes", bytes.size()),
              {.key = writers_[publisher]->get_topic()->get_name()});
}

Status FastddsBus::reply(std::size_t publisher, std::span<const std::uint8_t> bytes,
                         const RequestIdentity& to) {
  RawCdr raw{{bytes.begin(), bytes.end()}};
  eprosima::fastrtps::rtps::WriteParams parameters;
  auto& related = parameters.related_sample_identity();
  std::copy_n(to.guid.begin(), 12, related.writer_guid().guidPrefix.value);
  std::copy_n(to.guid.begin() + 12, 4, related.writer_guid().entityId.value);
  related.sequence_number() =
      eprosima::fastrtps::rtps::SequenceNumber_t(static_cast<std::uint64_t>(to.sequence));
  if (writers_[publisher]->write(&raw, parameters)) return {};
  return fail(ErrorCode::Unwritable, "cannot send the reply",
              {.key = writers_[publisher]->get_topic()->get_name()});
}

int FastddsBus::matched_subscriptions(std::size_t publisher) const {
  dds::PublicationMatchedStatus status;
  (void)writers_[publisher]->get_publication_matched_status(status);
  return status.current_count;
}

int FastddsBus::matched_publishers(std::size_t subscription) const {
  dds::SubscriptionMatchedStatus status;
  if (readers_[subscription] == nullptr) return 0;
  (void)readers_[subscription]->get_subscription_matched_status(status);
  return status.current_count;
}

}  // namespace

Result<std::unique_ptr<Bus>> open_fastdds_bus(const BusOptions& options) {
  auto bus = std::make_unique<FastddsBus>();
  if (Status status = bus->join(options); !status) return tl::unexpected(status.error());
  return bus;
}

}  // namespace waymark
