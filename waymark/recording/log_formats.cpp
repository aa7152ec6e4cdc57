#include "waymark/recording/log_formats.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/recording/csv_log.hpp"
#include "waymark/recording/lcm_log.hpp"
#include "waymark/recording/mcap_log.hpp"
#include "waymark/recording/mcap_records.hpp"
#include "waymark/recording/ros1_bag_log.hpp"
#include "waymark/recording/ros1_bag_records.hpp"
#include "waymark/recording/rosbag2_log.hpp"
#include "waymark/recording/temporary_file.hpp"
#include "waymark/recording/unpack.hpp"
#include "waymark/recording/unpacked_log.hpp"

namespace waymark {
namespace {

using OpenedLog = Result<std::unique_ptr<MessageLog>>;

/// A format of recordings, and how it is recognised and read.
struct FormatRow {
  LogFormat format;
  std::string_view name;     ///< in JSON
  std::string_view known{};  ///< in the list of what is known; empty: not in it
  bool samples = false;      ///< gives samples, not messages with types of ROS
  /// By the first bytes and the size of the file; nullptr: nothing begins so.
  bool (*begins)(ByteSpan head, std::uint64_t size) = nullptr;
  OpenedLog (*open)(std::unique_ptr<ByteSource> source, const LogOptions& options) = nullptr;
  bool certain = true;  ///< nothing but a recording begins so
};

bool begins_with(ByteSpan head, ByteSpan magic) {
  return head.size() >= magic.size() && std::ranges::equal(head.first(magic.size()), magic);
}

bool begins_as_mcap(ByteSpan head, std::uint64_t /*size*/) { return begins_with(head, mcap::kMagic); }
bool begins_as_bag(ByteSpan head, std::uint64_t /*size*/) {
  return begins_with(head, as_bytes(ros1bag::kMagic));
}
bool begins_as_old_bag(ByteSpan head, std::uint64_t /*size*/) {
  return begins_with(head, as_bytes("#ROSBAG V1"));
}
bool begins_as_rosbag2(ByteSpan head, std::uint64_t /*size*/) { return begins_as_sqlite(head); }
bool begins_as_csv(ByteSpan head, std::uint64_t /*size*/) { return looks_like_csv(head); }

/// SQLite reads files, not bytes: what is none yet is written to one.
OpenedLog open_sqlite(std::unique_ptr<ByteSource> source, const LogOptions& options) {
  constexpr std::size_t kPieceBytes = std::size_t{1} << 16U;
  if (const auto unpacked = unpacked_to(*source))
    return open_rosbag2_bytes(unpacked, source->name(), options);
  const Result<std::uint64_t> size = source->size();
  if (!size) return tl::unexpected(size.error());
  const auto file = TemporaryFile::create();
  if (!file) return tl::unexpected(file.error());
  Bytes piece;
  for (std::uint64_t at = 0; at < *size; at += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kPieceBytes, *size - at)));
    Status status = source->read(at, piece);
    if (status) status = (*file)->append(piece);
    if (!status) return tl::unexpected(status.error());
  }
  return open_rosbag2_bytes(*file, source->name(), options);
}

OpenedLog open_old_bag(std::unique_ptr<ByteSource> source, const LogOptions& /*options*/) {
  return fail(ErrorCode::Unsupported, "a ROS bag of version 1, from before 2010", {.source = source->name()},
              "Convert it with `rosbag fix`.");
}

/// THE table of formats, in the order in which they are tried. A format more is a row here, and its reader.
/// CSV comes last: it takes any text with a comma in its first line.
constexpr std::array kFormats = {
    FormatRow{LogFormat::Mcap, "mcap", "MCAP", false, begins_as_mcap, open_mcap_log},
    FormatRow{LogFormat::Rosbag2, "rosbag2", "rosbag2 (.db3, bag folder)", false, begins_as_rosbag2,
              open_sqlite},
    FormatRow{LogFormat::Ros1Bag, "ros1bag", "ROS 1 bag", false, begins_as_bag, open_ros1_bag},
    FormatRow{LogFormat::Ros1Bag, "ros1bag", "", false, begins_as_old_bag, open_old_bag},
    FormatRow{LogFormat::Lcm, "lcm", "LCM event log", true, looks_like_lcm, open_lcm_log},
    FormatRow{LogFormat::Csv, "csv", "CSV with named columns", true, begins_as_csv, open_csv_log, false},
    FormatRow{LogFormat::Merged, "merged", "", true},
};

const FormatRow& row_of(LogFormat format) { return *std::ranges::find(kFormats, format, &FormatRow::format); }

/// "MCAP, ROS 1 bag, …".
std::string known_formats() {
  std::string names;
  for (const FormatRow& row : kFormats)
    if (!row.known.empty()) names += (names.empty() ? "" : ", ") + std::string(row.known);
  return names;
}

}  // namespace

std::string_view to_string(LogFormat format) { return row_of(format).name; }

bool gives_samples(LogFormat format) { return row_of(format).samples; }

bool begins_as_sqlite(ByteSpan head) { return begins_with(head, as_bytes(kSqliteMagic)); }

Result<std::unique_ptr<MessageLog>> open_by_format(std::unique_ptr<ByteSource> source, ByteSpan head,
                                                   const LogOptions& options) {
  const Place place{.source = source->name()};
  std::error_code unknown;  // of a name that is none of a file: then it is no device
  if (head.empty() && std::filesystem::is_character_file(place.source, unknown))
    return fail(ErrorCode::Unreadable, "this is a device, and no recording", place,
                "Name a file or a folder.");
  if (head.empty())
    return fail(ErrorCode::Unreadable, "the file is empty", place,
                "Was the recording interrupted before it began? Record again.");
  const std::uint64_t size = source->size().value_or(0);
  const bool yaml = place.source.ends_with(".yaml") || place.source.ends_with(".yml");
  for (const FormatRow& row : kFormats) {
    if (row.begins == nullptr || !row.begins(head, size) || (yaml && !row.certain)) continue;
    return row.open(std::move(source), options);
  }
  if (yaml)
    return fail(ErrorCode::Unsupported, "this is a YAML file, and no recording", place,
                "A map goes after --map, a robot after --robot or --robot-file, a world after --world.");
  if (place.source.ends_with(".mcap"))
    return fail(ErrorCode::Unsupported, "this does not begin as an MCAP file", place,
                "If its beginning is damaged, `waymark recover FILE` saves what stands behind it.");
  return fail(ErrorCode::Unsupported, "this is no recording of a kind we know", place,
              fmt::format("Known: {}.", known_formats()));
}

bool looks_like_recording(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  const auto source = open_file(path);
  const std::uint64_t size = source ? (*source)->size().value_or(0) : 0;
  Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(size, kHeadBytes)));
  if (head.empty() || !(*source)->read(0, head)) return false;
  return packing_of(head) != Packing::None || std::ranges::any_of(kFormats, [&](const FormatRow& row) {
           return row.certain && row.begins != nullptr && row.begins(head, size);
         });
}

}  // namespace waymark
