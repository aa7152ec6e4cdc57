#include "waymark/recording/sample_reader.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

std::string_view type_of(const mcap::Index& index, const mcap::Channel& channel) {
  const auto schema = index.schemas.find(channel.schema_id);
  return schema == index.schemas.end() ? std::string_view() : schema->second.name;
}

/// The first of several becomes the chosen one; what none of them needs is not read.
void use_all(std::vector<ChosenCamera> cameras, RecordingSetup& setup) {
  setup.chosen = cameras.front();
  std::vector<std::string> frames;
  for (const ChosenCamera& camera : cameras) {
    std::set<std::string> unused;
    std::ranges::set_intersection(setup.chosen.unused, camera.unused, std::inserter(unused, unused.end()));
    setup.chosen.unused = std::move(unused);
    frames.push_back(camera.camera_frame);
  }
  for (auto camera = cameras.begin() + 1; camera != cameras.end(); ++camera)
    setup.more_cameras.push_back(
        {ros2::camera_of_frame(camera->camera_frame), *camera->camera, *camera->base_T_cam});
  setup.chosen.notes = {fmt::format("all {} cameras are used: {} (--camera-frame chooses one)", frames.size(),
                                    fmt::join(frames, ", "))};
}

}  // namespace

const CameraModel* lens_of(const RecordingSetup& setup, std::string_view camera) {
  const auto found = std::ranges::find(setup.more_cameras, camera, &MountedCamera::name);
  if (found != setup.more_cameras.end()) return &found->camera;
  return setup.camera ? &*setup.camera : nullptr;
}

void choose(RecordingSetup& setup, const CameraChoice& choice) {
  setup.more_cameras.clear();
  if (auto all = choose_all_cameras(setup.facts, choice); !all.empty())
    use_all(std::move(all), setup);
  else
    setup.chosen = choose_camera(setup.facts, choice);
  setup.camera = setup.chosen.camera;
  setup.base_T_cam = setup.chosen.base_T_cam;
}

void turn_into_base(Sample& sample, const ChosenCamera& chosen) {
  auto* imu = std::get_if<ImuSample>(&sample);
  if (imu == nullptr || !chosen.base_R_imu) return;
  imu->angular_velocity_rad_s = *chosen.base_R_imu * imu->angular_velocity_rad_s;
  imu->linear_acceleration_m_s2 = *chosen.base_R_imu * imu->linear_acceleration_m_s2;
}

Result<RecordingSetup> read_setup(const ByteSource& source) {
  const Result<mcap::Index> index = mcap::read_index(source);
  if (!index) return tl::unexpected(index.error());
  RecordingSetup setup{.problems = index->problems};
  for (const auto& entry : index->metadata) {
    const auto metadata = mcap::read_metadata(source, entry);
    if (!metadata) return tl::unexpected(metadata.error());
    setup.metadata[metadata->name] = metadata->metadata;
  }
  const mcap::Selection selection{.topics = {topics::kCameraInfo, topics::kTfStatic}};
  Status status = mcap::visit_messages(
      source, *index, selection, [&](const mcap::Channel& channel, const mcap::Message& message) {
        return add_fact(setup.facts, channel.topic, type_of(*index, channel), message.data.bytes);
      });
  if (!status) return tl::unexpected(status.error());
  choose(setup);
  return setup;
}

Status visit_samples(const ByteSource& source, const std::function<Status(const Sample&)>& visit) {
  const Result<mcap::Index> index = mcap::read_index(source);
  if (!index) return tl::unexpected(index.error());
  SampleDecoder decoder(visit);
  Status status = mcap::visit_messages(
      source, *index, {}, [&](const mcap::Channel& channel, const mcap::Message& message) {
        return decoder.add(channel.topic, type_of(*index, channel), message.log_time, message.data.bytes);
      });
  return status ? decoder.finish() : status;
}

}  // namespace waymark
