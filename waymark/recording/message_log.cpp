#include "waymark/recording/message_log.hpp"

#include <algorithm>
#include <array>

#include "waymark/recording/mcap_log.hpp"
#include "waymark/recording/mcap_records.hpp"
#include "waymark/recording/ros1_bag_log.hpp"
#include "waymark/recording/ros1_bag_records.hpp"
#include "waymark/recording/unpack.hpp"
#include "waymark/recording/unpacked_log.hpp"

namespace waymark {
namespace {

constexpr std::size_t kHeadBytes = 64 * 1024;

/// The first bytes of a file, as many as there are.
Result<Bytes> head_of(const ByteSource& source) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(*size, kHeadBytes)));
  if (Status status = source.read(0, head); !status) return tl::unexpected(status.error());
  return head;
}

bool begins(ByteSpan head, ByteSpan magic) {
  return head.size() >= magic.size() && std::ranges::equal(head.first(magic.size()), magic);
}

Result<std::unique_ptr<MessageLog>> open_plain(std::unique_ptr<ByteSource> source, ByteSpan head,
                                               const LogOptions& options) {
  if (begins(head, mcap::kMagic)) return open_mcap_log(std::move(source), options);
  if (begins(head, as_bytes(ros1bag::kMagic))) return open_ros1_bag(std::move(source), options);
  if (begins(head, as_bytes("#ROSBAG V1")))
    return fail(ErrorCode::Unsupported, "a ROS bag of version 1, from before 2010",
                {.source = source->name()}, "Convert it with `rosbag fix`.");
  if (head.empty()) return fail(ErrorCode::Unreadable, "the file is empty", {.source = source->name()});
  return fail(ErrorCode::Unsupported, "this is no recording of a kind we know", {.source = source->name()},
              "Known: MCAP, rosbag2 (.db3, bag folder), ROS 1 bag, LCM event log, CSV with named columns.");
}

}  // namespace

std::string_view to_string(LogFormat format) {
  constexpr std::array<std::string_view, 5> kNames = {"mcap", "rosbag2", "ros1bag", "lcm", "csv"};
  return kNames.at(static_cast<std::size_t>(format));
}

Result<std::unique_ptr<MessageLog>> open_log(std::unique_ptr<ByteSource> source, const LogOptions& options) {
  Result<Bytes> head = head_of(*source);
  if (!head) return tl::unexpected(head.error());
  const Packing packing = packing_of(*head);
  if (packing == Packing::None) return open_plain(std::move(source), *head, options);

  Result<UnpackedFile> unpacked = unpack_file(*source, packing, options.max_unpacked_bytes);
  if (!unpacked) return tl::unexpected(unpacked.error());
  head = head_of(*unpacked->source);
  if (!head) return tl::unexpected(head.error());
  if (head->empty() && unpacked->damage) return tl::unexpected(*unpacked->damage);
  Result<std::unique_ptr<MessageLog>> log = open_plain(std::move(unpacked->source), *head, options);
  if (!log) return log;
  return with_packing(std::move(*log), packing, unpacked->damage, source->size().value_or(0));
}

Result<std::unique_ptr<MessageLog>> open_log(const std::filesystem::path& path, const LogOptions& options) {
  Result<std::unique_ptr<ByteSource>> source = open_file(path);
  if (!source) return tl::unexpected(source.error());
  return open_log(std::move(*source), options);
}

}  // namespace waymark
