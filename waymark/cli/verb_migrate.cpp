#include "waymark/cli/parts.hpp"
#include "waymark/jobs/migrate_files.hpp"

namespace waymark::cli {
namespace {

struct MigrateArgs : JobArgs<MigrateJob> {
  explicit MigrateArgs(CLI::App& app) : JobArgs(app, "One JSON object a file instead of words") {}
};

ExitCode migrate(const MigrateArgs& args, Console& console) {
  const Result<std::vector<MigratedFile>> files = migrate_files(args.job);
  if (!files) return fail_with(files.error(), console);
  for (const MigratedFile& file : *files) console.print(args.json ? json_line(to_json(file)) : to_text(file));
  return ExitCode::Ok;
}

}  // namespace

Verb migrate_verb() {
  return {
      .name = "migrate",
      .sentence = "Rewrite maps, routes and calibrations of older versions in today's form",
      .help =
          R"(Files of older versions are read as they are, so this is needed only before another program reads them, or to have the
checks that today's files hold (points and checksum of a route). All other files, also those in folders of the folder,
are copied, and so are files that are in today's form already. Comments of a rewritten file are not kept. Formats:
docs/formats.

Exit code: 0 done, 1 a file was unusable and nothing was written, 2 wrong usage.

Example:
  waymark migrate map -o map-migrated
)",
      .prepare = prepared(migrate)};
}

}  // namespace waymark::cli
