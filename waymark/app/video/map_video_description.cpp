#include "waymark/app/video/map_video_description.hpp"

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/landmarks_file.hpp"

namespace waymark {
namespace {

constexpr double kPriorSigma_deg = 2;  // where only the places of a prior were said to be known so well

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, problem] = std::from_chars(text.data(), end, value);
  return problem == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

/// Adds the tags of "3,7" or "tag36h11:3".
Status add_tags(const std::string& text, const char* flag, std::vector<TagId>& tags) {
  for (const std::string& name : split_at_commas(text)) {
    Result<TagId> tag = tag_named(name);
    if (!tag) {
      tag.error().place.key = flag;
      return tl::unexpected(tag.error());
    }
    tags.push_back(*tag);
  }
  return {};
}

/// A tag lies on the floor or hangs on a wall, not both.
Status check_levels(const MapVideoJob& job) {
  for (const TagId& tag : job.floor)
    if (std::ranges::find(job.upright, tag) != job.upright.end())
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("{} is also given with --floor, and a tag cannot both lie on the floor and hang "
                      "upright on a wall",
                      to_string(tag)),
          {.key = "--upright"}, "Leave it out of one of the two.");
  return {};
}

Result<MeasuredDistance> distance_named(const std::string& text) {
  const std::vector<std::string> parts = split_at_commas(text);
  const auto wrong = [&] {
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no distance between two tags", text),
                {.key = "--distance"},
                "Two ids and metres: 3,7,2.41, with a standard deviation 3,7,2.41,0.002.");
  };
  if (parts.size() != 3 && parts.size() != 4) return wrong();
  const Result<TagId> a = tag_named(parts[0]);
  const Result<TagId> b = tag_named(parts[1]);
  MeasuredDistance distance;
  if (!a || !b || *a == *b) return wrong();
  distance.a = *a;
  distance.b = *b;
  const auto length = number_in(parts[2]);
  const auto sigma = parts.size() == 4 ? number_in(parts[3]) : std::optional(distance.sigma_m);
  if (!length || !sigma || !(*length > 0 && *length < 1e4) || !(*sigma > 0 && *sigma < 1e3)) return wrong();
  distance.measured_m = *length;
  distance.sigma_m = *sigma;
  return distance;
}

/// The camera, its uncertainty and its shutter.
Result<MapVideoJob> job_with_camera(const MapVideoDescription& description) {
  Result<DescribedCamera> read = read_camera(description.camera);
  if (!read) return tl::unexpected(read.error());
  return MapVideoJob{.camera = read->camera,
                     .intrinsics_sigma = std::move(read->intrinsics_sigma),
                     .readout_s = read->readout_s};
}

Status read_prior(const MapVideoDescription& description, double tag_size_m, MapVideoJob& job) {
  if (description.prior.empty()) return {};
  job.prior_sigma_m = description.prior_sigma_m;
  if (description.prior_sigma_deg || description.prior_sigma_m)
    job.prior_sigma_rad = to_radians(description.prior_sigma_deg.value_or(kPriorSigma_deg));
  Result<LandmarksFile> prior = read_landmarks(description.prior, tag_size_m);
  if (!prior) return tl::unexpected(prior.error());
  job.prior = std::move(prior->tags);
  job.field = prior->field;
  return {};
}

}  // namespace

Result<MapVideoJob> described_map_video(const MapVideoDescription& description,
                                        std::optional<double> tag_size_m) {
  if (description.camera.file.empty())
    return fail(ErrorCode::InvalidArgument, "a video says nothing about its camera", {.key = "--camera"},
                "Give its calibration: --camera calibration.yaml. `waymark calibrate camera` makes one.");
  if (!tag_size_m)
    return fail(ErrorCode::InvalidArgument, "a video does not say how large its tags are",
                {.key = "--tag-size-m"},
                "Measure the side of the black square, for example --tag-size-m 0.165.");
  Result<MapVideoJob> job = job_with_camera(description);
  if (!job) return job;
  Status status = add_tags(description.anchor, "--anchor", job->anchors);
  const auto add = [&](const std::vector<std::string>& texts, const char* flag, std::vector<TagId>& tags) {
    for (const std::string& text : texts)
      if (status) status = add_tags(text, flag, tags);
  };
  add(description.upright, "--upright", job->upright);
  add(description.floor, "--floor", job->floor);
  for (const std::string& plane : description.planes) add({plane}, "--plane", job->planes.emplace_back());
  if (status) status = check_levels(*job);
  if (!status) return tl::unexpected(status.error());
  for (const std::string& text : description.distances) {
    const Result<MeasuredDistance> distance = distance_named(text);
    if (!distance) return tl::unexpected(distance.error());
    job->distances.push_back(*distance);
  }
  job->sizes.default_size_m = *tag_size_m;
  job->size_sigma = description.tag_size_sigma_m / *tag_size_m;
  job->level_sigma_rad = to_radians(description.level_sigma_deg);
  status = read_prior(description, *tag_size_m, *job);
  return status ? job : tl::unexpected(status.error());
}

Result<MapVideoJob> described_map_video(const MapVideoDescription& description, const MapJob& common) {
  Result<MapVideoJob> job = described_map_video(description, common.overrides.tag_size_m);
  if (!job) return job;
  for (const auto& [tag, size_m] : common.overrides.size_by_tag_m) job->sizes.size_by_tag_m[tag] = size_m;
  job->folder = common.folder;
  job->videos = {common.lap};
  job->videos.insert(job->videos.end(), common.more.begin(), common.more.end());
  job->map_T_anchor = common.overrides.map_T_anchor;
  job->search = common.options.bundle.search;
  return job;
}

Status check_effects(const MapVideoDescription& of, const GivenFlags& given) {
  FlagRefusals refused(given);
  refused.flags(true,
                {"--robot", "--method", "--world", "--extend", "--route-name", "--freeze", "--remove",
                 "--model", "--map-sigma", "--against", "--tagslam", "--base-frame", "--camera-frame",
                 "--camera-topic", "--imu-topic", "--odometry-topic"},
                kNotOfVideos, kNoRobot);
  refused.flags(of.prior.empty(), {"--prior-sigma-m", "--prior-sigma-deg"}, "this is about an older map",
                "Give it with --prior.");
  refused.flags(of.upright.empty() && of.floor.empty() && of.planes.empty(), {"--level-sigma-deg"},
                "no tag is said to be level", "Give it with --upright, --floor or --plane.");
  refused.flags(of.anchor.find(',') != std::string::npos || of.prior_sigma_m || of.prior_sigma_deg,
                {"--anchor-pose"}, "the tags of --prior hold this map",
                "Leave it out, or give one --anchor and neither --prior-sigma-m nor --prior-sigma-deg.");
  return refused.status();
}

Status check_no_video(const GivenFlags& given) {
  FlagRefusals refused(given);
  refused.flags(true, {"--camera", "--camera-name", "--camera-size"}, "a recording brings its camera along",
                "Give --robot for a recording without a calibration; --camera is that of a video.");
  refused.flags(true,
                {"--readout-ms", "--tag-size-sigma-m", "--distance", "--upright", "--floor", "--plane",
                 "--level-sigma-deg", "--prior-sigma-m", "--prior-sigma-deg"},
                "this is about videos", "Leave it out.");
  return refused.status();
}

}  // namespace waymark
