#include "waymark/recording/ros1_bag_log.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "waymark/recording/ros1_bag_index.hpp"
#include "waymark/recording/ros_definition.hpp"
#include "waymark/recording/ros_log.hpp"

namespace waymark {
namespace {

using ros1bag::ChunkEntry;
using ros1bag::Op;
using ros1bag::Record;

/// One chunk being merged: its unpacked records and its messages in order of time.
struct Merged {
  struct Message {
    std::uint64_t time = 0;
    std::size_t channel = 0;
    ByteSpan data{};
  };
  Bytes records{};
  std::vector<Message> messages{};
  std::size_t next = 0;
  std::size_t number = 0;
  [[nodiscard]] std::uint64_t time() const { return messages[next].time; }
};

class Ros1BagLog final : public RosLog {
 public:
  Ros1BagLog(std::unique_ptr<ByteSource> source, ros1bag::Index index, LogProblems problems,
             const LogOptions& options)
      : source_(std::move(source)),
        index_(std::move(index)),
        options_(options),
        opened_(std::move(problems)) {
    for (const auto& [id, connection] : index_.connections) add_channel(id, connection);
  }

  LogFormat format() const override { return LogFormat::Ros1Bag; }
  std::string description() const override {
    return fmt::format("ROS 1 bag 2.0, {} chunks{}{}", index_.chunks.size(),
                       index_.compression.empty() || index_.compression == "none"
                           ? ""
                           : ", packed with " + index_.compression,
                       index_.from_file ? "" : ", without a usable index");
  }
  const std::vector<LogChannel>& channels() const override { return channels_; }

  LogSummary summary() const override {
    LogSummary summary{.messages = 0, .size_bytes = source_->size().value_or(0), .files = {source_->name()}};
    for (const auto& [connection, count] : index_.counts) *summary.messages += count;
    for (const ChunkEntry& chunk : index_.chunks) {
      summary.start = std::min(summary.start.value_or(chunk.start_time), chunk.start_time);
      summary.end = std::max(summary.end.value_or(chunk.end_time), chunk.end_time);
    }
    return summary;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    const std::vector<std::size_t> order = by_start_time(selection);
    std::vector<std::unique_ptr<Merged>> heap;
    const auto later = [](const auto& a, const auto& b) {
      return a->time() != b->time() ? a->time() > b->time() : a->number > b->number;
    };
    for (std::size_t next = 0; !heap.empty() || next < order.size();) {
      // Open every chunk that may hold an earlier message than the earliest at hand.
      while (next < order.size() &&
             (heap.empty() || index_.chunks[order[next]].start_time <= heap.front()->time())) {
        const std::size_t number = order[next++];
        std::unique_ptr<Merged> chunk = open(index_.chunks[number], selection);
        if (!chunk || chunk->messages.empty()) continue;
        chunk->number = number;
        heap.push_back(std::move(chunk));
        std::ranges::push_heap(heap, later);
      }
      if (heap.empty()) continue;
      std::ranges::pop_heap(heap, later);
      Merged& earliest = *heap.back();
      const Merged::Message message = earliest.messages[earliest.next++];
      const Status status = visit(channels_[message.channel], {message.time, message.time, message.data});
      if (!status) return status;
      if (earliest.next == earliest.messages.size()) {
        heap.pop_back();
      } else {
        std::ranges::push_heap(heap, later);
      }
    }
    return {};
  }

  std::vector<LogProblem> problems() const override { return joined(opened_, visited_); }

 private:
  /// Connections of several publishers on one topic are one channel.
  void add_channel(std::uint32_t id, const ros1bag::Connection& connection) {
    LogChannel channel{.topic = connection.topic,
                       .type = ros::ros2_type(connection.type),
                       .encoding = "ros1",
                       .schema_encoding = "ros1msg",
                       .schema = connection.definition,
                       .metadata = {{"md5sum", connection.md5sum}, {"ros1_type", connection.type}},
                       .messages = 0};
    if (connection.latching) channel.metadata["latching"] = "1";
    const auto same = std::ranges::find_if(channels_, [&](const LogChannel& known) {
      return known.topic == channel.topic && known.type == channel.type && known.schema == channel.schema;
    });
    channel_of_[id] = static_cast<std::size_t>(same - channels_.begin());
    LogChannel& kept = same == channels_.end() ? channels_.emplace_back(std::move(channel)) : *same;
    if (!connection.caller.empty()) {
      std::string& callers = kept.metadata["callerid"];
      callers += (callers.empty() ? "" : " ") + connection.caller;
    }
    if (const auto count = index_.counts.find(id); count != index_.counts.end())
      *kept.messages += count->second;
  }

  [[nodiscard]] std::vector<std::size_t> by_start_time(const LogSelection& selection) const {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < index_.chunks.size(); ++i) {
      if (index_.chunks[i].end_time >= selection.from && index_.chunks[i].start_time < selection.to)
        order.push_back(i);
    }
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return index_.chunks[i].start_time; });
    return order;
  }

  std::unique_ptr<Merged> open(const ChunkEntry& entry, const LogSelection& selection) {
    Result<ros1bag::OpenChunk> chunk = open_chunk(*source_, entry, options_.max_record_bytes);
    if (!chunk) {
      visited_.damage("ros1bag.chunk", [&] { return chunk.error(); });
      return nullptr;
    }
    auto merged = std::make_unique<Merged>();
    merged->records = std::move(chunk->records);
    const bool whole = ros1bag::visit_chunk(merged->records, [&](const Record& record) {
      if (record.op != Op::Message) return;
      const auto time = record.fields.time("time");
      const auto channel = channel_of_.find(record.fields.number<std::uint32_t>("conn").value_or(~0U));
      if (!time || channel == channel_of_.end()) {
        visited_.damage("ros1bag.message", [&] {
          return Error{ErrorCode::Unreadable, "a message without time or connection", place(entry), {}};
        });
        return;
      }
      if (selection.takes(*time) && selection.takes(channels_[channel->second].topic))
        merged->messages.push_back({*time, channel->second, record.data});
    });
    if (chunk->damage || !whole) {
      visited_.damage("ros1bag.chunk", [&] {
        Error error = chunk->damage.value_or(
            Error{ErrorCode::Unreadable, "a chunk holds something that is no record", place(entry), {}});
        error.hint = "The messages before the damage are read.";
        return error;
      });
    }
    std::ranges::stable_sort(merged->messages, {}, &Merged::Message::time);
    return merged;
  }

  [[nodiscard]] Place place(const ChunkEntry& entry) const {
    return {.source = source_->name(), .byte = static_cast<std::int64_t>(entry.offset)};
  }

  std::unique_ptr<ByteSource> source_;
  ros1bag::Index index_;
  LogOptions options_;
  std::vector<LogChannel> channels_;
  std::map<std::uint32_t, std::size_t> channel_of_;
  LogProblems opened_;
};

}  // namespace

Result<std::unique_ptr<MessageLog>> open_ros1_bag(std::unique_ptr<ByteSource> source,
                                                  const LogOptions& options) {
  LogProblems problems;
  Result<ros1bag::Index> index = ros1bag::read_index(*source, options.max_record_bytes, problems);
  if (!index) return tl::unexpected(index.error());
  return std::make_unique<Ros1BagLog>(std::move(source), std::move(*index), std::move(problems), options);
}

}  // namespace waymark
