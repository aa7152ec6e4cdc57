#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/app/cli/verb.hpp"
#include "waymark/app/common/field_refusals.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/option_layers.hpp"

/// Converts options to flags: those in a struct (OptionFlags), those of a job (add_fields) and individual
/// ones (add_option). Values from --config and --set have lower precedence (Settings).
namespace waymark::cli {

/// The group of flags that are shown only by --help-all.
inline constexpr const char* kMoreGroup = "More";
/// The group of flags that --help shows.
inline constexpr const char* kFirstGroup = "Options";

/// A key of --set and --config that has no flag.
struct SettingOnlyKey {
  std::string key;       ///< such as "camera.exposure_ms"
  std::string usual;     ///< default value, as YAML
  std::string sentence;  ///< description with the range
};

/// Thrown by Settings while the command line is parsed.
struct SettingsError : CLI::ValidationError {
  explicit SettingsError(waymark::Error why) : CLI::ValidationError(to_string(why)), error(std::move(why)) {}

  waymark::Error error;
};

/// The options of a verb by name, set by --config FILE.yaml and --set SECTION.KEY=VALUE. Flags take
/// precedence over both. Unknown sections and keys are rejected while the command line is parsed, with their
/// location. Must not move while the command line is parsed.
class Settings : public OptionLayers {
 public:
  explicit Settings(CLI::App& app);
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  /// The verb that these options belong to.
  [[nodiscard]] CLI::App& app() const { return app_; }
  /// Sets the example shown in the help for --set; only the first call has an effect.
  void name_example(const std::string& assignment);
  /// Adds a key to the list that --help-all prints.
  void add_key(SettingOnlyKey key) { keys_.push_back(std::move(key)); }

 private:
  [[nodiscard]] std::string keys_text() const;

  CLI::App& app_;
  CLI::Option* set_ = nullptr;
  bool named_example_ = false;
  std::string config_path_;
  std::vector<std::string> sets_;
  std::vector<SettingOnlyKey> keys_;
};

/// Returns "--quad-decimate" for "quad_decimate".
[[nodiscard]] inline std::string flag_name(std::string_view field_name) {
  std::string flag = "--" + std::string(field_name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

/// The description of the field, including its range or default: "Look for quads in a smaller image. From 1
/// to 8.".
template <class Value>
[[nodiscard]] std::string flag_help(const Value& usual, const Field& field) {
  std::string range;
  if constexpr (std::is_same_v<Value, bool>) {
    range = usual ? " On by default." : " Off by default.";
  } else if constexpr (std::is_arithmetic_v<Value> || kIsOptionalNumber<Value>) {
    if (std::isfinite(field.min) && std::isfinite(field.max))
      range = fmt::format(" From {} to {}.", field.min, field.max);
    if (std::isfinite(field.min) && !std::isfinite(field.max))
      range = fmt::format(" At least {}.", field.min);
    if (!std::isfinite(field.min) && std::isfinite(field.max)) range = fmt::format(" At most {}.", field.max);
  }
  return std::string(field.sentence) + range;
}

/// How the options in a struct can be set.
enum class Reach : std::uint8_t {
  Flags,        ///< settable by flags, --set and --config
  SettingsOnly  ///< settable only by --set and --config
};

/// An option struct on the command line, generated from its fields(). Each field, including those of nested
/// structs, is a key in a section of --set and --config. Unless SettingsOnly is specified, it is also a flag,
/// with dashes in its name, description, range and default. Must not move while the command line is parsed.
template <HasFields Options>
class OptionFlags {
 public:
  /// `title` is the group of the flags in the help; the name of the section is added to it, unless it is
  /// "Options".
  OptionFlags(Settings& settings, std::string section, const std::string& title, Reach reach = Reach::Flags)
      : settings_(settings), section_(std::move(section)) {
    settings_.add_section(section_, [](const YamlCursor& cursor) {
      Options read;
      return update_fields(cursor, read);
    });
    std::string key = section_;
    visit_leaves(
        given_,
        [&](auto& value, const Field& field) {
          keys_.push_back(key.substr(std::min(key.size(), section_.size() + 1)) +
                          (key == section_ ? "" : ".") + std::string(field.name));
          if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>>)
            settings_.name_example(key + "." + std::string(field.name) + "=" + usual_text(value));
          flags_.push_back(
              reach == Reach::Flags ? add_flag(settings.app(), value, field, group_of(title, key)) : nullptr);
          if (flags_.back() == nullptr)
            settings_.add_key(
                {key + "." + std::string(field.name), usual_text(value), flag_help(value, field)});
        },
        [&](const Field& field) { key += "." + std::string(field.name); },
        [&] { key.resize(key.rfind('.')); });
  }
  OptionFlags(const OptionFlags&) = delete;
  OptionFlags& operator=(const OptionFlags&) = delete;

  /// Whether any of the options was set by a flag, --set or --config.
  [[nodiscard]] bool given() const { return settings_.given(section_) || !first_argument().empty(); }
  /// Whether this field was set, such as "lag_s" or "motion.slide_m_s".
  [[nodiscard]] bool given(std::string_view key) const {
    return settings_.given(section_ + "." + std::string(key)) || !first_argument(key).empty();
  }
  /// The first of these options on the command line as typed, such as "--reach-m" or "--set
  /// follower.reach_m=0.4"; empty if there is none. If `key` is set, only this field counts, such as "lag_s"
  /// or "motion.slide_m_s".
  [[nodiscard]] std::string first_argument(std::string_view key = {}) const {
    for (std::size_t i = 0; i < flags_.size(); ++i) {
      if (flags_[i] != nullptr && flags_[i]->count() > 0 && (key.empty() || keys_[i] == key))
        return flags_[i]->get_name();
    }
    return settings_.first_assignment(section_, std::string(key));
  }
  /// Overwrites `options` with the values from the file, then from --set, then from flags. Fails if a value
  /// is out of range.
  [[nodiscard]] Status apply(Options& options) const {
    if (Status status = check_leaf_ranges(given_); !status) {
      status.error().place.key = flag_name(status.error().place.key);
      return status;
    }
    if (Status status = settings_.read(section_, options); !status) return status;
    std::vector<const void*> sources;
    const auto nothing = [](const auto&...) {};
    visit_leaves(
        given_, [&](const auto& value, const Field&) { sources.push_back(&value); }, nothing, nothing);
    std::size_t next = 0;
    visit_leaves(
        options,
        [&](auto& value, const Field&) {
          using Value = std::remove_cvref_t<decltype(value)>;
          if (flags_[next] != nullptr && flags_[next]->count() > 0)
            value = *static_cast<const Value*>(sources[next]);
          ++next;
        },
        nothing, nothing);
    return {};
  }

 private:
  static std::string group_of(const std::string& title, const std::string& key) {
    return title == kFirstGroup ? title : fmt::format("{} (--set {}.KEY=VALUE)", title, key);
  }
  /// nullptr for lists and structs, whose flags the verb adds itself.
  template <class Value>
  static CLI::Option* add_flag(CLI::App& app, Value& value, const Field& field, const std::string& group) {
    const std::string flag = flag_name(field.name);
    CLI::Option* option = nullptr;
    if constexpr (std::is_same_v<Value, bool>) {
      option = app.add_flag(flag + ",!--no-" + flag.substr(2), value, flag_help(value, field));
    } else if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string>) {
      option = app.add_option(flag, value, flag_help(value, field))->capture_default_str();
    } else if constexpr (kIsOptionalNumber<Value>) {
      option = app.add_option(flag, value, flag_help(value, field));
    }
    if (option != nullptr) option->group(group);
    return option;
  }
  template <class Value>
  static std::string usual_text(const Value& value) {
    std::string text = internal::write_value(value, 0);  // for example " 8" and a newline
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text.substr(std::min(text.find_first_not_of(' '), text.size()));
  }
  Settings& settings_;
  std::string section_;
  Options given_{};
  std::vector<CLI::Option*> flags_;
  std::vector<std::string> keys_;  ///< keys of the fields, such as "motion.slide_m_s"
};

/// Fails if any of the options is on the command line. Use this for options without effect; a --config file
/// may still contain them, because several verbs can share it.
template <HasFields Options>
[[nodiscard]] Status refuse(const OptionFlags<Options>& flags, const std::string& why,
                            const std::string& hint, std::string_view key = {}) {
  const std::string argument = flags.first_argument(key);
  if (argument.empty()) return {};
  return fail(ErrorCode::InvalidArgument, why, {.key = argument}, hint);
}

/// Why lag_s is rejected for filters other than the smoother.
inline constexpr const char* kNoDelay = "only the smoother of `waymark localize` has a delay";

/// Returns a predicate for whether a flag ("--tag-size-m" or "tag_size_m") is on the command line. `app` must
/// outlive the result.
[[nodiscard]] GivenFields given_on(const CLI::App& app);

/// Refuses fields and options that have no effect in this run. status() returns the error for the first of
/// them that is on the command line.
class Refusals : public FieldRefusals {
 public:
  explicit Refusals(const CLI::App& app) : FieldRefusals(given_on(app)) {}

  /// Refuses all options in a struct or, if `key` is set, only one of them.
  template <HasFields Options>
  void options(bool when, const OptionFlags<Options>& flags, const std::string& why, const std::string& hint,
               std::string_view key = {}) {
    if (when && status_) status_ = refuse(flags, why, hint, key);
  }
  /// Refuses all options in a group that has refuse_all(), such as DetectorFlags or PoseFlags.
  template <class Group>
  void all(bool when, const Group& group, const std::string& why, const std::string& hint) {
    if (when && status_) status_ = group.refuse_all(why, hint);
  }
};

// Add a flag in a single call: add_option(app, "--speed-m-s FLOAT", speed, "Cruising speed", kShown,
// between(0.01, 5)).

/// The help shows the value that the variable has before parsing as the default.
inline constexpr auto kShown = [](CLI::Option& option) { option.capture_default_str(); };
inline constexpr auto kRequired = [](CLI::Option& option) { option.required(); };
/// Shown only by --help-all.
inline constexpr auto kMore = [](CLI::Option& option) { option.group(kMoreGroup); };
/// Accepts exactly `count` values, so that the next word is an input.
[[nodiscard]] inline auto exactly(int count) {
  return [count](CLI::Option& option) { option.expected(count)->allow_extra_args(false); };
}
/// Accepts several comma-separated values in one word.
inline constexpr auto kByCommas = [](CLI::Option& option) { option.delimiter(','); };

/// Puts the flag in a separate group in --help-all.
[[nodiscard]] inline auto in_group(std::string name) {
  return [name = std::move(name)](CLI::Option& option) { option.group(name); };
}
template <class Number>
[[nodiscard]] auto between(Number least, Number most) {
  return [least, most](CLI::Option& option) { option.check(CLI::Range(least, most)); };
}
[[nodiscard]] inline auto one_of(std::vector<std::string> words) {
  return [words = std::move(words)](CLI::Option& option) { option.check(CLI::IsMember(words)); };
}

/// `names` lists the names on the command line, followed by the name of the value: "-o,--output FILE". A name
/// without a dash denotes an input.
template <class Value, class... Trait>
CLI::Option* add_option(CLI::App& app, const std::string& names, Value& value, const std::string& sentence,
                        const Trait&... traits) {
  const std::size_t space = names.find(' ');
  CLI::Option* option = app.add_option(names.substr(0, space), value, sentence);
  option->type_name(space == std::string::npos ? "" : names.substr(space + 1));
  (traits(*option), ...);
  return option;
}

/// The same for a flag without a value.
template <class... Trait>
CLI::Option* add_flag(CLI::App& app, const std::string& name, bool& value, const std::string& sentence,
                      const Trait&... traits) {
  CLI::Option* option = app.add_flag(name, value, sentence);
  (traits(*option), ...);
  return option;
}

/// A flag whose only effect is to select this verb in a command line that does not name it ("--ros2").
void add_choice(CLI::App& app, const std::string& name);

// The flags of a job, generated from its fields().

/// Returns "-o,--output" for "output" and "--tag-size-m" for "tag_size_m". For an input, returns its name and
/// the alternative flag.
[[nodiscard]] std::string names_of(const JobField& field);
/// The name of the value as shown in the help.
[[nodiscard]] std::string type_of(const JobField& field);
/// Sets everything that does not depend on the type of the value: group, allowed values, default.
void arrange(CLI::Option& option, const JobField& field);

/// Sets which flags this one needs or excludes; those flags must already have been added.
void link(CLI::App& app, const JobField& field);

template <class Value>
void add_field(CLI::App& app, Value& value, const JobField& field) {
  const std::string sentence(field.sentence);
  CLI::Option* option = nullptr;
  if constexpr (std::is_same_v<Value, bool>) {
    option = app.add_flag(names_of(field), value, sentence);
  } else {
    option = app.add_option(names_of(field), value, sentence);
    option->type_name(type_of(field));
    if (value != Value{} && !field.has_no_default) option->capture_default_str();
    using Number = std::conditional_t<std::is_integral_v<Value>, int, double>;
    if (std::isfinite(field.min) && std::isfinite(field.max))
      between(static_cast<Number>(field.min), static_cast<Number>(field.max))(*option);
  }
  arrange(*option, field);
}

/// Adds a flag or an input for each field, in order. The job must not move while the command line is parsed.
template <HasFields Job>
void add_fields(CLI::App& app, Job& job) {
  Job::fields(job, [&](auto& value, const JobField& field) { add_field(app, value, field); });
  Job::fields(job, [&](auto&, const JobField& field) { link(app, field); });
}

/// A `prepare` function for a verb that has only the flags of its job.
template <HasFields Job>
[[nodiscard]] std::function<Run(CLI::App&)> prepared_job(ExitCode (*run)(const Job&, Console&)) {
  return [run](CLI::App& app) -> Run {
    const auto job = std::make_shared<Job>();
    add_fields(app, *job);
    return [job, run](Console& console) { return run(*job, console); };
  };
}

/// The flags of a verb: those of its job, and --json.
template <HasFields Job>
struct JobArgs {
  explicit JobArgs(CLI::App& app, const char* of_json = "Print one JSON object instead of text") {
    add_fields(app, job);
    app.add_flag("--json", json, of_json);
  }

  Job job{};
  bool json = false;
};

// Validate the names of output files, whose extensions must match the format to be written.

/// For CLI11's transform(): the name of a recording to be written. The format is MCAP, so a name without an
/// extension gets .mcap, and other extensions are rejected.
[[nodiscard]] CLI::Validator recording_name();

/// For CLI11's check(): the name of a YAML file to be written must end in .yaml or .yml, or be a device.
[[nodiscard]] CLI::Validator yaml_name();

}  // namespace waymark::cli
