#include "waymark/robots/fastdds/fastdds_bus.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <utility>

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
#include "waymark/robots/fastdds/discovered.hpp"
#include "waymark/robots/fastdds/participant_qos.hpp"
#include "waymark/robots/fastdds/raw_cdr.hpp"

namespace waymark {
namespace {

namespace dds = eprosima::fastdds::dds;

/// As rmw_fastrtps does: the reader of the client where the request names it, else its writer.
RequestIdentity identity_of(const dds::SampleInfo& info) {
  const auto& related = info.related_sample_identity.writer_guid();
  const bool named = related != eprosima::fastrtps::rtps::GUID_t::unknown();
  const auto& guid = named ? related : info.sample_identity.writer_guid();
  return {bytes_of(guid), static_cast<std::int64_t>(info.sample_identity.sequence_number().to64long())};
}

/// Puts what comes into the queue, on the thread it comes by.
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
  std::optional<BusMessage> next(Duration most) override { return queue_.take(most); }
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
  dds::Log::ClearConsumers();  // nothing is printed by a library
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
  return fail(
      ErrorCode::Unsupported, fmt::format("domain {} cannot be joined", options.domain), {.source = "DDS"},
      options.keystore.empty() ? "Is the network interface there and up?"
                               : "Are the certificates in " + options.keystore + " complete and valid?");
}

FastddsBus::~FastddsBus() {
  if (participant_ == nullptr) return;
  (void)participant_->delete_contained_entities();
  (void)dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

Result<dds::Topic*> FastddsBus::topic(const BusTopic& name) {
  if (auto* known = dynamic_cast<dds::Topic*>(participant_->lookup_topicdescription(name.topic))) {
    if (known->get_type_name() == name.type) return known;
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the topic has the type {} already, not {}", known->get_type_name(), name.type),
                {.key = name.topic});
  }
  const dds::TypeSupport type(new RawCdrType(name.type));
  (void)type.register_type(participant_);
  auto* made = participant_->create_topic(name.topic, name.type, dds::TOPIC_QOS_DEFAULT);
  if (made == nullptr)
    return fail(ErrorCode::InvalidArgument, "DDS refuses this topic or its type " + name.type,
                {.key = name.topic});
  return made;
}

/// Where it cannot be told nobody is told, and everything else goes on.
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
  if (writer == nullptr) return fail(ErrorCode::Unsupported, "DDS makes no publisher", {.key = name.topic});
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
    return fail(ErrorCode::Unsupported, "DDS makes no subscription", {.key = name.topic});
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
  return fail(ErrorCode::Unwritable, fmt::format("a message of {} bytes cannot be sent", bytes.size()),
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
  return fail(ErrorCode::Unwritable, "a reply cannot be sent",
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
