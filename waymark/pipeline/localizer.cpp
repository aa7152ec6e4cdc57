#include "waymark/pipeline/localizer.hpp"

#include <algorithm>
#include <array>
#include <type_traits>
#include <variant>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/localization/smoother.hpp"

namespace waymark {
namespace {

constexpr std::array<std::string_view, 4> kLocalizationMethods{"riekf", "ekf", "anchor", "smoother"};

Status check(const LocalizerSetup& setup) {
  if (setup.landmarks.size() == 0)
    return fail(ErrorCode::InvalidArgument, "the map contains no tag", {}, "Use a map with tags.");
  if (const auto clash = setup.landmarks.overlapping(); !clash.empty()) {
    const auto& [a, b] = clash.front();
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the map is inconsistent: {} and {} overlap", to_string(setup.landmarks[a].tag),
                            to_string(setup.landmarks[b].tag)),
                {}, "Remove one of the two tags from the map.");
  }
  if (setup.method == LocalizationKind::Anchor && (setup.tags.tags.empty() || !setup.sensor.camera))
    return fail(ErrorCode::InvalidArgument, "the method anchor requires tags with poses and a camera", {},
                "Use `method=riekf`.");
  return check_ranges(setup.filter);
}

}  // namespace

std::vector<std::string> localization_methods() {
  return {kLocalizationMethods.begin(), kLocalizationMethods.end()};
}

std::string_view to_string(LocalizationKind method) {
  return kLocalizationMethods[static_cast<std::size_t>(method)];
}

Result<LocalizationKind> parse_localization_method(std::string_view name) {
  const auto* const found = std::ranges::find(kLocalizationMethods, name);
  if (found != kLocalizationMethods.end())
    return static_cast<LocalizationKind>(found - kLocalizationMethods.begin());
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown method '{}'", name), {.key = "method"},
              suggestion(std::string(name), localization_methods()));
}

Result<std::unique_ptr<LocalizationMethod>> make_localization_method(const LocalizerSetup& setup) {
  if (Status status = check(setup); !status) return tl::unexpected(status.error());
  if (setup.method == LocalizationKind::Anchor)
    return std::unique_ptr<LocalizationMethod>(new AnchorLocalizer(setup.tags, *setup.sensor.camera,
                                                                   setup.sensor.base_T_sensor, setup.anchor,
                                                                   setup.sensor.more_cameras));
  if (setup.method == LocalizationKind::Smoother && setup.filter.lag_s > 0)
    return std::unique_ptr<LocalizationMethod>(
        new FixedLagSmoother(setup.landmarks, setup.sensor, setup.filter));
  const ErrorState error =
      setup.method == LocalizationKind::Ekf ? ErrorState::Coordinates : ErrorState::RightInvariant;
  auto filter = std::make_unique<RiekfLocalizer>(setup.landmarks, setup.sensor, setup.filter, error);
  if (setup.live) {
    filter->estimate_camera_latency();
    filter->tracker().trust_standstill();
  }
  if (setup.method == LocalizationKind::Smoother) filter->tracker().keep_trace();
  return std::unique_ptr<LocalizationMethod>(std::move(filter));
}

Result<Localizer> Localizer::make(const LocalizerSetup& setup) {
  auto method = make_localization_method(setup);
  if (!method) return tl::unexpected(method.error());
  return Localizer(std::move(*method), setup.method == LocalizationKind::Smoother);
}

void Localizer::add(const Sample& sample) {
  const auto receive = [this](const auto& value) {
    using T = std::decay_t<decltype(value)>;
    constexpr bool kUsed = std::is_same_v<T, TagFrame> || std::is_same_v<T, Odometry> ||
                           std::is_same_v<T, ImuSample> || std::is_same_v<T, TagPoseFrame> ||
                           std::is_same_v<T, RangeBearing>;
    if constexpr (kUsed) method_->add(value);
  };
  std::visit(receive, sample);
}

std::vector<LocalizationEstimate> Localizer::smoothed() const {
  if (!smooths_) return {};
  RiekfLocalizer* const filter = method_->filter();
  std::vector<LocalizationEstimate> run = smooth(filter->tracker().trace());
  const bool lags = method_.get() != filter;  // whether the method wraps the filter, as the smoother does
  const auto newest = lags ? estimate() : std::nullopt;
  if (newest)
    std::erase_if(run, [&](const LocalizationEstimate& past) { return past.stamp <= newest->stamp; });
  return run;
}

}  // namespace waymark
