#include "waymark/app/cli/paper_flags.hpp"

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"

namespace waymark::cli {

PaperFlags::PaperFlags(CLI::App& verb) : app_(verb) {
  add_fields(verb, request_);
  verb.add_flag("--json", json_, "Print one JSON object about the written files instead of text");
}

CLI::Option* name_tag_size(CLI::App& app) {
  return app.get_option("--tag-size-m")->default_str("")->type_name("NUMBER (required)");
}

Status check_tag_size(const CLI::Option& tag_size, bool given) {
  if (!given) return fail(ErrorCode::InvalidArgument, "--tag-size-m is required", {}, "For example 0.16.");
  return tag_size.count() > 0 ? plot::check_tag_size(tag_size.as<double>()) : Status();
}

ExitCode PaperFlags::fail_writing(const Error& error, Console& console) {
  if (interrupted()) return ExitCode::Interrupted;
  return console.failed(error, error.code == ErrorCode::Unwritable ? ExitCode::SomeFailed : ExitCode::Usage);
}

}  // namespace waymark::cli
