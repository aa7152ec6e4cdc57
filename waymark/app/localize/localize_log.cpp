#include "waymark/app/localize/localize_log.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/stopwatch.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/localization/noise_adaptation.hpp"

namespace waymark {
namespace {

Status run(Localizer& localizer, const LocalizeInputs& inputs, bool hindsight, const JobControl& control,
           LocalizeOutput& output) {
  for (const Sample& sample : inputs.samples) {
    if (control.cancelled()) return fail(ErrorCode::Unwritable, "stopped: nothing was written");
    localizer.add(sample);
    Status status = output.on_sample(sample);
    for (const NisRecord& record : localizer.method().comparisons())
      if (status) status = output.on_comparison(record);
    localizer.method().clear_comparisons();
    const auto estimate = localizer.estimate();
    if (status && estimate && !hindsight) status = output.on_estimate(*estimate);
    if (!status) return status;
  }
  for (const LocalizationEstimate& estimate : localizer.smoothed()) {
    if (Status status = output.on_estimate(estimate); !status) return status;
  }
  return {};
}

/// What a first run over the recording shows of the numbers that the filter is given.
struct FirstRun {
  std::optional<SystematicVerdict> suspect{};
  double latency_off_s = 0;                 ///< by the innovations
  bool corners = false;                     ///< of tags were seen
  bool noise_inconsistent = false;          ///< of single observations …
  bool lasting_noise_inconsistent = false;  ///< … or of their means alone
};

/// NIS of all observations, outliers capped, but for those of the few tags that are not where the map says.
class NisSums {
 public:
  explicit NisSums(const Landmarks& landmarks)
      : landmarks_(landmarks), all_(static_cast<std::size_t>(landmarks.size())) {}

  void add(const NisRecord& record) {
    constexpr double kCapPerRow = 16;
    const int landmark =
        landmarks_.find(record.tag) >= 0 ? landmarks_.find(record.tag) : landmarks_.find(record.tag.number);
    if (landmark < 0) return;
    Sums& sums = all_[static_cast<std::size_t>(landmark)];
    sums.nis += std::min(record.nis, kCapPerRow * record.rows);
    sums.rows += record.rows;
  }
  [[nodiscard]] std::optional<double> per_row(const TagWatch& watch) const {
    constexpr double kMost = 0.5;  // where more tags contradict it is not the tags
    Sums total;
    Sums usable;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      total.nis += all_[i].nis;
      total.rows += all_[i].rows;
      if (!watch.usable(static_cast<int>(i))) continue;
      usable.nis += all_[i].nis;
      usable.rows += all_[i].rows;
    }
    const Sums& counted = usable.rows > kMost * total.rows ? usable : total;
    return counted.rows > 0 ? std::optional(counted.nis / counted.rows) : std::nullopt;
  }

 private:
  struct Sums {
    double nis = 0;
    double rows = 0;
  };
  const Landmarks& landmarks_;
  std::vector<Sums> all_;
};

FirstRun first_run(const LocalizerSetup& setup, const std::vector<Sample>& samples,
                   const JobControl& control) {
  LocalizerSetup plain = setup;
  if (setup.method != LocalizationKind::Ekf) plain.method = LocalizationKind::Riekf;
  Result<Localizer> localizer = Localizer::make(plain);
  if (!localizer) return {};
  NisSums nis(setup.landmarks);
  for (const Sample& sample : samples) {
    if (control.cancelled()) return {};
    localizer->add(sample);
    for (const NisRecord& record : localizer->method().comparisons()) nis.add(record);
    localizer->method().clear_comparisons();
  }
  const Tracker& tracker = localizer->filter()->tracker();
  const auto per_row = nis.per_row(tracker.watch());
  FirstRun found{.suspect = tracker.suspect(),
                 .noise_inconsistent = per_row && noise_is_inconsistent(*per_row, {}),
                 .lasting_noise_inconsistent = noise_is_inconsistent(0, tracker.lasting_nis())};
  const auto fit = tracker.systematic().fit(SystematicVector::Constant(0.1));  // nothing is known before
  constexpr Eigen::Index kLatency = 7;
  if (fit) found.latency_off_s = fit->value[kLatency];
  found.corners = tracker.sees_corners();
  return found;
}

/// A latency that the innovations show to be another than was told is estimated: Gauss-Newton steps, each a
/// run. Nothing when it does not settle.
std::optional<double> find_latency(LocalizerSetup setup, const std::vector<Sample>& samples, FirstRun& first,
                                   const JobControl& control) {
  constexpr int kRuns = 6;
  constexpr double kSettled_s = 0.001;
  constexpr double kFarthest_s = 0.3;
  const double given_s = setup.filter.camera_latency_s;
  FirstRun last = first;
  for (int i = 0; i < kRuns && std::abs(last.latency_off_s) > kSettled_s; ++i) {
    setup.filter.camera_latency_s += last.latency_off_s;
    if (std::abs(setup.filter.camera_latency_s - given_s) > kFarthest_s) return std::nullopt;
    last = first_run(setup, samples, control);
  }
  if (last.suspect && last.suspect->suspect == Suspect::Latency) return std::nullopt;
  first = last;
  return setup.filter.camera_latency_s;
}

/// Of a camera: coarse ranges hardly tell it from the noise of turning.
bool is_camera_latency(const FirstRun& first) {
  return first.suspect && first.suspect->suspect == Suspect::Latency && first.corners;
}

std::string words_of_latency(double found_s, double given_s) {
  return fmt::format(
      "the camera latency is {:.3f} s by the innovations, not {:.3f} s: {:.3f} s is used. Set it with "
      "--camera-latency-s, or run `waymark calibrate robot` and give the result with --calibration "
      "(--no-adapt keeps what is given)",
      found_s, given_s, found_s);
}

std::string words_of(const NoiseFit& fit) {
  return fmt::format(
      "noise estimated from the recording: of distances {:.2g} times, of headings {:.2g} times and of "
      "observations {:.2g} times what is assumed, tags within {:.3g} m (--no-adapt keeps what is assumed)",
      fit.motion_ratio, fit.turn_ratio, fit.sensor_ratio, fit.tag_sigma_m);
}

/// Noise and latency as the recording tells them; what was changed, in words. Noise first where single
/// observations show it to be wrong: all else is judged by it. A number that is wrong makes errors that last,
/// too.
std::vector<std::string> adapt(const std::vector<Sample>& samples, LocalizerSetup& setup, FirstRun& first,
                               const JobControl& control) {
  std::vector<std::string> words;
  if (first.noise_inconsistent || (first.lasting_noise_inconsistent && !first.suspect)) {
    const NoiseFit noise = adapt_noise(samples, setup.landmarks, setup.sensor, setup.filter,
                                       [&] { return !control.cancelled(); });
    if (noise.adapted) {
      setup.filter = noise.options;
      words.push_back(words_of(noise));
      first = first_run(setup, samples, control);
    }
  }
  if (!is_camera_latency(first)) return words;
  if (const auto found_s = find_latency(setup, samples, first, control)) {
    words.push_back(words_of_latency(*found_s, setup.filter.camera_latency_s));
    setup.filter.camera_latency_s = *found_s;
  }
  return words;
}

}  // namespace

void start_localizer(const LocalizeJob& job, Localizer& localizer) {
  if (job.start.size() != 3) return;
  const SE2 map_T_base(job.start[0], job.start[1], to_radians(job.start[2]));
  localizer.method().start_from(map_T_base, 0.05, 0.05);
}

Result<LocalizeReport> localize(const LocalizeJob& job, const LocalizeInputs& inputs,
                                const JobControl& control) {
  const Stopwatch watch;
  if (Status status = check_localize_output(job); !status) return tl::unexpected(status.error());
  LocalizerSetup setup = inputs.setup;
  FirstRun first =
      setup.method == LocalizationKind::Anchor ? FirstRun{} : first_run(setup, inputs.samples, control);
  const std::vector<std::string> adapted =
      job.adapt ? adapt(inputs.samples, setup, first, control) : std::vector<std::string>{};
  Result<Localizer> localizer = Localizer::make(setup);
  if (!localizer) return tl::unexpected(localizer.error());
  if (first.suspect && localizer->filter() != nullptr) localizer->filter()->tracker().suspect(*first.suspect);
  start_localizer(job, *localizer);
  Result<LocalizeOutput> output =
      LocalizeOutput::open(job, setup, {.name = std::filesystem::path(job.logs.front()).filename().string()});
  if (!output) return tl::unexpected(output.error());
  const bool hindsight = job.method == LocalizationKind::Smoother && job.filter.lag_s <= 0;
  const Status status = run(*localizer, inputs, hindsight, control, *output);
  Result<LocalizeReport> report = output->close(!status);
  if (!status) {
    std::error_code ignored;  // the part of a drive would look like all of it
    if (control.cancelled() && std::filesystem::is_regular_file(job.output, ignored))
      std::filesystem::remove(job.output, ignored);
    return tl::unexpected(status.error());
  }
  if (!report) return report;
  report->problems = localizer->method().problems();
  if (first.suspect)
    report->problems.emplace_back("the stated covariance covers what is wrong by the innovations");
  for (const std::string& words : adapted) report->problems.push_back(words);
  if (const RiekfLocalizer* filter = localizer->filter())
    report->lasting_nis = filter->tracker().lasting_nis();
  report->wall_s = watch.seconds();
  return report;
}

nlohmann::ordered_json to_json(const LocalizeJob& job, const LocalizeReport& report) {
  using Json = nlohmann::ordered_json;
  Json last = nullptr;
  if (report.last)
    last = {{"x_m", report.last->map_T_base.x()},
            {"y_m", report.last->map_T_base.y()},
            {"yaw_rad", report.last->map_T_base.yaw()},
            {"certain", report.last->certain}};
  return {{"method", to_string(job.method)},
          {"estimates", report.estimates},
          {"certain", report.certain},
          {"first_fix_s", report.first_fix_s ? Json(*report.first_fix_s) : Json(nullptr)},
          {"observations", report.compared},
          {"accepted", report.accepted},
          {"nis_mean", report.nis_mean},
          {"lasting_nis", report.lasting_nis ? Json(*report.lasting_nis) : Json(nullptr)},
          {"duration_s", report.duration_s},
          {"wall_s", report.wall_s},
          {"last", last},
          {"problems", report.problems}};
}

}  // namespace waymark
