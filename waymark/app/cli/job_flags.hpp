#pragma once

#include <cmath>
#include <type_traits>

#include "waymark/app/cli/flags.hpp"
#include "waymark/app/cli/verb.hpp"
#include "waymark/base/fields.hpp"

/// The flags of a job, made from its fields().
namespace waymark::cli {

/// "-o,--output" for "output", "--tag-size-m" for "tag_size_m"; of an input what it is called.
[[nodiscard]] std::string names_of(const JobField& field);
/// What its value is called.
[[nodiscard]] std::string type_of(const JobField& field);
/// What does not depend on the kind of value: group, what is allowed, what is usual.
void arrange(CLI::Option& option, const JobField& field);

/// What it needs and excludes of other flags, which must be there.
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
    if (value != Value{} && !field.has_no_usual) option->capture_default_str();
    using Number = std::conditional_t<std::is_integral_v<Value>, int, double>;
    if (std::isfinite(field.min) && std::isfinite(field.max))
      between(static_cast<Number>(field.min), static_cast<Number>(field.max))(*option);
  }
  arrange(*option, field);
}

/// A flag or an input for each field, in order. The job must stay where it is while the command line is
/// parsed.
template <HasFields Job>
void add_fields(CLI::App& app, Job& job) {
  Job::fields(job, [&](auto& value, const JobField& field) { add_field(app, value, field); });
  Job::fields(job, [&](auto&, const JobField& field) { link(app, field); });
}

/// The `prepare` of a verb that has the flags of its job alone.
template <HasFields Job>
[[nodiscard]] std::function<Run(CLI::App&)> prepared_job(ExitCode (*run)(const Job&, Console&)) {
  return [run](CLI::App& app) -> Run {
    const auto job = std::make_shared<Job>();
    add_fields(app, *job);
    return [job, run](Console& console) { return run(*job, console); };
  };
}

/// The flags of a verb that has those of its job, and --json.
template <HasFields Job>
struct JobArgs {
  explicit JobArgs(CLI::App& app, const char* of_json = "One JSON object instead of words") {
    add_fields(app, job);
    app.add_flag("--json", json, of_json);
  }

  Job job{};
  bool json = false;
};

}  // namespace waymark::cli
