#include "waymark/recording/message_log.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/ros2_messages.hpp"
#include "waymark/recording/rosbag2_log.hpp"
#include "waymark/recording/unpack.hpp"
#include "waymark/recording/unpacked_log.hpp"

namespace waymark {
namespace {

/// The first bytes of a file, as many as there are.
Result<Bytes> head_of(const ByteSource& source) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(*size, kHeadBytes)));
  if (Status status = source.read(0, head); !status) return tl::unexpected(status.error());
  return head;
}

}  // namespace

std::string to_string(const LogProblem& problem) {
  return to_string(problem.error) + (problem.count > 1 ? fmt::format(" ({} times)", problem.count) : "");
}

LogSelection MessageLog::topics_used(const RecordingSetup& setup, std::optional<bool> pictures) const {
  LogSelection selection;
  for (const LogChannel& channel : channels()) {
    const bool picture = channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType;
    if (picture == pictures.value_or(picture) && !setup.chosen.unused.contains(channel.topic))
      selection.topics.insert(channel.topic);
  }
  return selection;
}

std::uint64_t recording_start_ns(MessageLog& log) {
  constexpr std::uint64_t kBeginning_ns = 10'000'000'000;
  const std::uint64_t start = log.summary().start.value_or(0);
  if (start > 0) return start;
  std::optional<std::uint64_t> next;
  // The first message is enough: an error of the visitor stops the visit.
  (void)log.visit({.from = 1}, [&](const LogChannel&, const LogMessage& message) -> Status {
    next = message.log_time;
    return fail(ErrorCode::LimitExceeded, "the first message is enough");
  });
  return next && *next > kBeginning_ns ? *next : start;
}

Result<std::unique_ptr<MessageLog>> open_log(std::unique_ptr<ByteSource> source, const LogOptions& options) {
  Result<Bytes> head = head_of(*source);
  if (!head) return tl::unexpected(head.error());
  const Packing packing = packing_of(*head);
  if (packing == Packing::None) return open_by_format(std::move(source), *head, options);

  Result<UnpackedFile> unpacked = unpack_file(*source, packing, options.unpack);
  if (!unpacked) return tl::unexpected(unpacked.error());
  head = head_of(*unpacked->source);
  if (!head) return tl::unexpected(head.error());
  if (head->empty() && unpacked->damage) {
    unpacked->damage->hint = "Nothing of it could be unpacked: not one block of the packing is whole.";
    return tl::unexpected(*unpacked->damage);
  }
  Result<std::unique_ptr<MessageLog>> log = open_by_format(std::move(unpacked->source), *head, options);
  if (!log) return log;
  return with_packing(std::move(*log), packing, unpacked->damage, source->size().value_or(0));
}

Result<std::unique_ptr<MessageLog>> open_log(const std::filesystem::path& path, const LogOptions& options) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return open_bag_folder(path, options);
  if (path.filename() == "metadata.yaml") return open_bag_folder(path.parent_path(), options);
  Result<std::unique_ptr<ByteSource>> source = open_file(path);
  if (!source) return tl::unexpected(source.error());
  const Result<Bytes> head = head_of(**source);
  if (head && begins_as_sqlite(*head)) return open_rosbag2_file(path, path.string(), false, options);
  return open_log(std::move(*source), options);
}

}  // namespace waymark
