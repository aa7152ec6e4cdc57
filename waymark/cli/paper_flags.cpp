#include "waymark/cli/paper_flags.hpp"

namespace waymark::cli {

PaperFlags::PaperFlags(CLI::App& app) {
  app.add_option("-o,--output", output,
                 "File to write; .pdf, .svg or .png says its kind (pages of .svg and .png get numbers)")
      ->required()
      ->type_name("FILE");
  app.add_option("--family", family_, "Tag family")->capture_default_str()->type_name("NAME");
  app.add_option("--paper", paper_, "A6 to A0, Letter, Legal, Tabloid, or WIDTHxHEIGHT in millimetres")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--orientation", orientation_,
                 "Orientation of the page: auto (where more fits), portrait or landscape")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--dpi", dpi, "Pixels an inch of .png, recorded in the file. From 10 to 2400.")
      ->capture_default_str();
  app.add_flag("--json", json, "One JSON object about what was written instead of words");
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

CLI::Option* require_tag_size(CLI::App& app) {
  return app.get_option("--tag-size-m")->required()->default_str("");
}

Status check_tag_size(const CLI::Option& tag_size) { return plot::check_tag_size(tag_size.as<double>()); }

}  // namespace waymark::cli
