#include "waymark/recording/recorded_lap.hpp"

namespace waymark {
namespace {

Status read_attachments(const ByteSource& source, RecordedLap& lap) {
  const Result<mcap::Index> index = mcap::read_index(source);
  if (!index) return tl::unexpected(index.error());
  for (const mcap::AttachmentIndex& entry : index->attachments) {
    Bytes bytes;
    const Result<mcap::Attachment> attachment = mcap::read_attachment(source, entry, bytes);
    if (!attachment) return tl::unexpected(attachment.error());
    const ByteSpan data = attachment->data.bytes;
    lap.attachments[attachment->name] = std::string(data.begin(), data.end());
  }
  return {};
}

}  // namespace

Result<RecordedLap> read_lap(const ByteSource& source) {
  Result<RecordingSetup> setup = read_setup(source);
  if (!setup) return tl::unexpected(setup.error());
  RecordedLap lap{.setup = std::move(*setup)};
  if (Status status = read_attachments(source, lap); !status) return tl::unexpected(status.error());
  const Status status = visit_samples(source, [&](const Sample& sample) -> Status {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) lap.frames.push_back(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.odometry.push_back(*odometry);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      lap.truth.push_back({truth->stamp, truth->map_T_base});
    return {};
  });
  if (!status) return tl::unexpected(status.error());
  return lap;
}

}  // namespace waymark
