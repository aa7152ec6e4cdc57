#include "waymark/cli/paper_flags.hpp"

#include "waymark/cli/failure.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/interrupt.hpp"

namespace waymark::cli {

PaperFlags::PaperFlags(CLI::App& verb) : app_(verb) {
  CLI::App& app = verb;
  add_option(app, "-o,--output FILE", files_.path,
             "File to write; .pdf, .svg or .png says its kind (pages of .svg and .png get numbers)",
             kRequired);
  add_option(app, "--family NAME", family_, "Tag family", kShown);
  add_option(app, "--paper NAME", paper_, "A6 to A0, Letter, Legal, Tabloid, or WIDTHxHEIGHT in millimetres",
             kShown);
  add_option(app, "--orientation NAME", orientation_,
             "Orientation of the page: auto (where more fits), portrait or landscape", kShown);
  app.add_option("--dpi", files_.dpi, "Pixels an inch of .png, recorded in the file. From 10 to 2400.")
      ->capture_default_str();
  add_flag(app, "--force", files_.replace, "Replace a file that is there", kMore);
  app.add_flag("--json", json_, "One JSON object about what was written instead of words");
}

Result<FamilyId> PaperFlags::family() const {
  auto id = parse_family(family_);
  if (!id) {
    Error error = id.error();
    error.place.key = "family";
    return tl::unexpected(error);
  }
  return id;
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
  return console.failed(naming_flag(error),
                        error.code == ErrorCode::Unwritable ? ExitCode::SomeFailed : ExitCode::Usage);
}

}  // namespace waymark::cli
