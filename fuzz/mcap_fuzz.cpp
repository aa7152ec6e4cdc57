// Any bytes as an MCAP file: a result or an error with a message, never a crash, no memory beyond the limit;
// a recovered file is complete and has the same messages.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/recover.hpp"

namespace {

using namespace waymark;

void demand(bool holds) {
  if (!holds) std::abort();
}

struct Seen {
  std::uint64_t messages = 0;
  std::uint64_t damage = 0;
};

Seen visit(const ByteSource& source, const mcap::Index& index, const mcap::Selection& selection) {
  Seen seen;
  mcap::ReaderOptions options{.max_record_bytes = 1 << 22};
  options.on_damage = [&](const Error& error) {
    demand(!error.message.empty());
    ++seen.damage;
  };
  const Status status = mcap::visit_messages(
      source, index, selection,
      [&](const mcap::Channel&, const mcap::Message& message) {
        demand(message.log_time >= selection.from && message.log_time < selection.to);
        ++seen.messages;
        return Status{};
      },
      options);
  if (!status) ++seen.damage;
  return seen;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const mcap::ReaderOptions options{.max_record_bytes = 1 << 22};
  const auto source = memory_source({data, size}, "fuzz");
  const auto index = mcap::read_index(*source, options);
  if (!index) {
    demand(!index.error().message.empty());
    return 0;
  }
  (void)visit(*source, *index, {});
  (void)visit(*source, *index, {.from = 2, .to = 1'000'000'000});
  for (const auto& entry : index->attachments) {
    Bytes room;
    (void)mcap::read_attachment(*source, entry, room, options);
  }
  for (const auto& entry : index->metadata) (void)mcap::read_metadata(*source, entry, options);
  Bytes file;
  const auto recovery = mcap::recover(*source, memory_sink(file), options);
  demand(recovery.has_value());
  const auto whole = memory_source(file);
  const auto again = mcap::read_index(*whole, options);
  demand(again.has_value());
  if (recovery->problems.empty() && again->from_summary) demand(again->problems.empty());
  return 0;
}
