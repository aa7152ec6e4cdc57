#include "waymark/app/cli/program.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <regex>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "waymark/app/cli/flags.hpp"
#include "waymark/app/cli/help_text.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/message_text.hpp"

#ifndef WAYMARK_VERSION
#define WAYMARK_VERSION "unknown"
#endif

namespace waymark::cli {
namespace {

/// A verb and its part of the parser.
struct Node {
  const Verb* verb = nullptr;
  CLI::App* app = nullptr;
  Run run;
  std::vector<Node> children;
};

bool names_word(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::count(words, word) > 0;
}

/// Adds flags only for the verbs named on the command line, because adding all flags takes longer than
/// running many verbs.
Node grow(const Verb& verb, CLI::App& app, const std::vector<std::string>& words) {
  Node node{&verb, &app, {}, {}};
  app.set_help_flag("-h,--help", "Print this and stop");
  app.set_help_all_flag("--help-all", "Print all flags, including rarely used ones, and stop");
  app.footer(verb.help);
  if (verb.report)
    app.formatter(
        std::static_pointer_cast<WrappingFormatter>(app.get_formatter())->with_report(verb.report()));
  if (verb.prepare) node.run = verb.prepare(app);
  for (const Verb& child : verb.verbs) {
    CLI::App* sub = app.add_subcommand(child.name, child.sentence)->group("Verbs");
    const bool named = names_word(words, child.name);
    node.children.push_back(named ? grow(child, *sub, words) : Node{&child, sub, {}, {}});
  }
  if (!node.children.empty()) app.require_subcommand(node.run ? 0 : 1, 1);
  return node;
}

const Verb* find_verb(const std::vector<Verb>& verbs, std::string_view name) {
  const auto found = std::ranges::find(verbs, name, &Verb::name);
  return found == verbs.end() ? nullptr : &*found;
}

bool asks_for_help(std::string_view word) { return word == "-h" || word == "--help" || word == "--help-all"; }

/// Number of values that a flag takes, and their name.
struct FlagValues {
  int least = 0;
  int most = 0;
  std::string name{};
};
using FlagTable = std::map<std::string, FlagValues, std::less<>>;

void add_flags(const CLI::App& app, FlagTable& table) {
  for (const CLI::Option* option : app.get_options()) {
    const int least = option->get_items_expected_min();
    const int most = option->get_allow_extra_args() ? option->get_items_expected_max() : least;
    for (const std::string& name : option->get_lnames())
      table["--" + name] = {least, most, option->get_type_name()};
    for (const std::string& name : option->get_snames())
      table["-" + name] = {least, most, option->get_type_name()};
  }
}

/// Adds the flags of a verb and of all its subverbs.
void add_flags(const Verb& verb, FlagTable& table) {
  CLI::App app;
  if (verb.prepare) static_cast<void>(verb.prepare(app));
  add_flags(app, table);
  for (const Verb& child : verb.verbs) add_flags(child, table);
}

/// Returns the positions of the words that are neither flags nor values of flags.
std::vector<std::size_t> input_places(const std::vector<std::string>& words, const FlagTable& flags) {
  std::vector<std::size_t> places;
  int values = 0;  // number of words that may still belong to the last flag
  bool inputs_only = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto flag = flags.find(std::string_view(words[i]).substr(0, words[i].find('=')));
    if (inputs_only)
      places.push_back(i);
    else if (words[i] == "--")
      inputs_only = true;
    else if (flag != flags.end())
      values = flag->first == words[i] ? flag->second.most : 0;
    else if (values > 0)
      --values;
    else if (!words[i].starts_with('-'))
      places.push_back(i);
  }
  return places;
}

/// The index of the first word after `verb` that is neither a flag nor the value of a flag, if any.
std::optional<std::size_t> first_input(const Verb& verb, const std::vector<std::string>& words) {
  if (words.empty()) return std::nullopt;
  if (!words.front().starts_with('-')) return 0;  // avoids building the table of flags
  FlagTable flags;
  add_flags(verb, flags);
  const std::vector<std::size_t> places = input_places(words, flags);
  return places.empty() ? std::nullopt : std::optional(places.front());
}

bool is_file(const std::string& word) {
  std::error_code ignored;
  return std::filesystem::exists(word, ignored);
}

/// Whether a verb does nothing by itself, so that a command line must name one of its subverbs.
bool only_leads_on(const Verb& verb) { return !verb.prepare && !verb.usual_verb; }

/// Moves a verb that follows flags to their front: "map -o m lap lap.mcap" becomes "map lap -o m lap.mcap".
/// If `verb` takes inputs and a file with that name exists, the word is treated as an input.
void put_verb_first(const Verb& verb, const std::vector<std::string>::iterator from,
                    const std::vector<std::string>::iterator end) {
  const std::vector<std::string> rest(from, end);
  if (verb.verbs.empty() || rest.empty() || !rest.front().starts_with('-')) return;
  const auto place = first_input(verb, rest);
  if (!place) return;
  const std::string& word = rest[*place];
  if (!only_leads_on(verb) && (find_verb(verb.verbs, word) == nullptr || is_file(word))) return;
  const auto at = from + static_cast<std::ptrdiff_t>(*place);
  std::rotate(from, at, at + 1);
}

/// The verb whose misspelt name is the first input: "lap" for "lapp" if no such file exists. Empty if there
/// is no such verb.
std::string misspelt_verb(const Verb& verb, const std::string& input) {
  if (input.find_first_of("./:*") != std::string::npos || is_file(input)) return {};
  std::vector<std::string> names;
  for (const Verb& child : verb.verbs) names.push_back(child.name);
  return nearest_word(input, names);
}

/// The verb that a command line implies.
struct MeantVerb {
  const Verb* verb = nullptr;  ///< nullptr if the command line names all its verbs
  std::string typed{};         ///< the word that it replaces; empty if there is none
  std::string misspelt{};      ///< an input that is neither a verb nor a file, and is similar to `nearest`
  std::string nearest{};
};

/// Inserts the implied verb, so that "map lap.mcap" becomes "map lap lap.mcap", and "calibrate camera
/// v4l2:/dev/video0" becomes "calibrate guided v4l2:/dev/video0".
MeantVerb complete(const Verb& program, std::vector<std::string>& words) {
  const Verb* parent = nullptr;
  const Verb* verb = &program;
  auto word = words.begin();
  const auto named = [&] { return word == words.end() ? nullptr : find_verb(verb->verbs, *word); };
  for (const Verb* next = named(); next != nullptr; next = named()) {
    parent = std::exchange(verb, next);
    ++word;
    put_verb_first(*verb, word, words.end());
  }
  const std::vector<std::string> rest(word, words.end());
  if (only_leads_on(*verb) || (!rest.empty() && std::ranges::all_of(rest, asks_for_help))) return {};
  const bool leads_on = !verb->verbs.empty() && std::ranges::none_of(rest, asks_for_help);
  const auto input = leads_on ? first_input(*verb, rest) : std::nullopt;
  if (std::string nearest = input ? misspelt_verb(*verb, rest[*input]) : ""; !nearest.empty())
    return {.misspelt = rest[*input], .nearest = std::move(nearest)};
  if (!verb->usual_verb) return {};
  const std::string name = verb->usual_verb(rest);
  if (const Verb* meant = find_verb(verb->verbs, name)) {
    words.insert(word, name);
    return {meant, {}};
  }
  const Verb* beside = parent == nullptr ? nullptr : find_verb(parent->verbs, name);
  if (beside == nullptr || beside == verb) return {};
  *std::prev(word) = name;
  return {beside, verb->name};
}

/// The node in the verb tree to which the words lead.
struct Chosen {
  const Node* node = nullptr;
  const Node* parent = nullptr;
  std::string name;          ///< such as "waymark evaluate detections", as typed by the user
  std::string full_name;     ///< includes the implied verb
  std::string unknown_verb;  ///< an unknown word where a verb is expected; empty if there is none
  std::size_t verbs = 0;     ///< number of verbs at the beginning of the command line
};

Chosen choose(const Node& root, const std::vector<std::string>& words, const MeantVerb& meant) {
  Chosen chosen{&root, nullptr, root.verb->name, root.verb->name, {}, 0};
  for (const std::string& word : words) {
    if (chosen.node->children.empty() || word.starts_with('-')) break;
    const auto& children = chosen.node->children;
    const auto found =
        std::find_if(children.begin(), children.end(), [&](const Node& n) { return n.verb->name == word; });
    if (found == children.end()) {
      if (!chosen.node->run) chosen.unknown_verb = word;
      break;
    }
    chosen.parent = chosen.node;
    chosen.node = &*found;
    ++chosen.verbs;
    chosen.full_name += " " + word;
    const std::string& typed = found->verb == meant.verb ? meant.typed : word;
    if (!typed.empty()) chosen.name += " " + typed;
  }
  return chosen;
}

/// Whether any verb of the program has the flag. The first call lists all flags.
HasFlag has_flag_of(const Verb& program) {
  return [&program, flags = std::make_shared<FlagTable>()](std::string_view flag) {
    if (flags->empty()) add_flags(program, *flags);
    return flags->contains(flag);
  };
}

std::vector<std::string> flags_of(const CLI::App& app) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  }
  return flags;
}

/// The first unknown flag; empty if there is none.
std::string unknown_flag(const CLI::App& root) {
  for (const std::string& word : root.remaining(true)) {
    if (word.size() > 1 && word.starts_with('-') && word != "--") return word.substr(0, word.find('='));
  }
  return {};
}

/// Returns "0.01" for the parser's "0.010000".
std::string short_number(const std::string& number) {
  if (number.find('.') == std::string::npos) return number;
  const std::string shorter = number.substr(0, number.find_last_not_of('0') + 1);
  return shorter.ends_with('.') ? shorter.substr(0, shorter.size() - 1) : shorter;
}

/// The first of several comma-separated values that is not a number; a single value is returned unchanged.
std::string first_not_number(const std::string& values) {
  for (const std::string& value : CLI::detail::split(values, ',')) {
    double number = 0;
    if (!CLI::detail::lexical_cast(value, number)) return value;
  }
  return values;
}

/// Rewords messages from the parser. "--seed: Value abc not in range 0 to 9" becomes "(--seed): 'abc' is not
/// a number from 0 to 9". "Could not convert: --laps = 1e" becomes "(--laps): '1e' is not a number". "--seed:
/// At Most 1 required but received 2" becomes "(--seed): given more than once". "--kind: imus not in
/// {imu,odometry}" becomes "(--kind): unknown value 'imus'. Did you mean 'imu'?".
std::string plain_words(const std::string& words) {
  static const std::regex kRange("(--[a-z0-9-]+): Value (.*) not in range (.*) to (.*)");
  static const std::regex kConversion("Could not convert: (--[a-z0-9-]+) = (.*)");
  static const std::regex kChoice("(--[a-z0-9-]+): (.*) not in \\{(.*)\\}");
  static const std::regex kRefused("(--[a-z0-9-]+): ([^0-9].*)");
  static const std::regex kRepeated("(--[a-z0-9-]+): At Most [0-9]+ required but received [0-9]+");
  std::smatch match;
  if (std::regex_match(words, match, kRange))
    return fmt::format("({}): '{}' is not a number from {} to {}", match[1].str(), match[2].str(),
                       short_number(match[3].str()), short_number(match[4].str()));
  if (std::regex_match(words, match, kConversion))
    return fmt::format("({}): '{}' is not a number", match[1].str(), first_not_number(match[2].str()));
  if (std::regex_match(words, match, kRepeated))
    return fmt::format("({}): given more than once", match[1].str());
  if (std::regex_match(words, match, kChoice))
    return fmt::format("({}): unknown value '{}'. {}", match[1].str(), match[2].str(),
                       suggestion(match[2].str(), CLI::detail::split(match[3].str(), ',')));
  if (std::regex_match(words, match, kRefused))
    return fmt::format("({}): {}", match[1].str(), match[2].str());
  return words;
}

/// Whether a command line that contains one of these verbs may imply another one.
bool any_usual_verb(const std::vector<Verb>& verbs) {
  return std::ranges::any_of(verbs, [](const Verb& verb) { return verb.verbs.empty() && verb.usual_verb; });
}

/// A sibling of the chosen verb that has the flag, if the chosen verb may have been implied.
std::string verb_with(const std::string& flag, const Chosen& chosen) {
  if (chosen.parent == nullptr) return {};
  const Verb& parent = *chosen.parent->verb;
  if (!parent.usual_verb && !any_usual_verb(parent.verbs)) return {};
  for (const Verb& verb : parent.verbs) {
    if (&verb == chosen.node->verb) continue;
    FlagTable flags;
    add_flags(verb, flags);
    if (flags.contains(flag)) return chosen.full_name.substr(0, chosen.full_name.rfind(' ') + 1) + verb.name;
  }
  return {};
}

std::vector<std::string> names_of(const std::vector<Node>& nodes) {
  std::vector<std::string> names;
  names.reserve(nodes.size());
  for (const Node& node : nodes) names.push_back(node.verb->name);
  return names;
}

/// The message for a ParseError. For an unknown flag, it names the verb that has it, or the most similar
/// valid flag.
std::string explain(const CLI::ParseError& error, const CLI::App& root, const Chosen& chosen) {
  if (chosen.parent != nullptr && !chosen.node->children.empty() && !chosen.node->run)
    return fmt::format("no verb given. Verbs: {}.", fmt::join(names_of(chosen.node->children), ", "));
  const std::string flag = unknown_flag(root);
  if (flag.empty()) return plain_words(error.what());
  const std::vector<std::string> own = flags_of(*chosen.node->app);
  if (const std::string verb = verb_with(flag, chosen); !verb.empty())
    return fmt::format("unknown flag '{}' of `{}`: it is one of `{}`.", flag, chosen.full_name, verb);
  const std::string nearest = nearest_word(flag, own);
  return fmt::format("unknown flag '{}'.{}", flag,
                     nearest.empty() ? "" : fmt::format(" Did you mean '{}'?", nearest));
}

ExitCode misused(Console& console, const std::string& name, const std::string& what) {
  console.note(fmt::format("{}{} See `{} --help`.", what,
                           what.ends_with('?') || what.ends_with('.') ? "" : ".", name));
  return ExitCode::Usage;
}

/// The flag with the value "nan", which would pass any range check; empty if there is none.
std::string flag_without_number(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty()) continue;
    for (const std::string& word : option->results()) {
      if (word.size() <= 4 && CLI::detail::to_lower(word).ends_with("nan")) return option->get_name();
    }
  }
  return {};
}

/// The message for a flag whose values are missing (it is followed by a flag, an empty word or nothing), or
/// for an empty input. Empty if no value is missing.
std::string missing_value(std::span<const std::string> words, const CLI::App& app) {
  FlagTable flags;
  add_flags(app, flags);
  const auto is_value = [&flags](const std::string& word) {
    return !word.empty() && !word.starts_with("--") && !flags.contains(word.substr(0, word.find('=')));
  };
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--") break;
    if (words[i].empty()) return "an input is empty: give a file name.";
    const std::size_t end = std::min(words[i].find('='), words[i].size());
    const auto flag = flags.find(std::string_view(words[i]).substr(0, end));
    if (flag == flags.end() || flag->second.least == 0) continue;
    int given = words[i].size() > end + 1 ? 1 : 0;
    const bool whole = end == words[i].size();
    while (whole && given < flag->second.least && i + 1 < words.size() && is_value(words[i + 1]))
      ++given, ++i;
    const int least = flag->second.least;
    const std::string name = app.get_formatter()->get_label(flag->second.name);
    if (given == 0 && least == 1) return fmt::format("{} needs a value ({}).", flag->first, name);
    if (given < least && whole) return fmt::format("{} needs {} values ({}).", flag->first, least, name);
  }
  return {};
}

/// The message for a flag that precedes its verb; empty if the words begin with a verb or ask for help.
std::string flag_before_verb(const Verb& program, const std::vector<std::string>& words) {
  if (words.empty() || !words.front().starts_with('-') || asks_for_help(words.front()) ||
      words.front() == "--version")
    return {};
  for (const std::string& word : words)
    if (find_verb(program.verbs, word) != nullptr)
      return fmt::format("the flag '{}' must follow `{} {}`.", words.front(), program.name, word);
  return {};
}

ExitCode parse_and_run(const Verb& program, std::vector<std::string> words, std::FILE* out, std::FILE* err) {
  CLI::App app(program.sentence, program.name);
  app.formatter(std::make_shared<WrappingFormatter>(has_flag_of(program)));
  const bool verbose = names_word(words, "--version") && std::erase(words, "--verbose") > 0;
  app.set_version_flag("--version", program.name + " " WAYMARK_VERSION,
                       "Print the version (with --verbose also compiler, features and libraries) and stop");
  if (!words.empty() && words.front() == "help") {  // `waymark help detect`
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const bool no_words = words.empty();
  const std::string misplaced = flag_before_verb(program, words);
  const MeantVerb meant = complete(program, words);
  const Node root = grow(program, app, words);
  const Chosen chosen = choose(root, words, meant);
  Console console(chosen.name, out, err, has_flag_of(program),
                  [app = chosen.node->app](std::string_view flag) {
                    return std::ranges::count(flags_of(*app), flag) > 0;
                  });
  if (no_words) {
    console.note("no verb given.\n\n" + app.help());
    return ExitCode::Usage;
  }
  if (!misplaced.empty()) return misused(console, chosen.name, misplaced);
  if (!meant.misspelt.empty()) {
    return misused(console, chosen.name,
                   fmt::format("'{}' is neither a verb nor a file. Did you mean `{} {}`?", meant.misspelt,
                               chosen.full_name, meant.nearest));
  }
  if (!chosen.unknown_verb.empty()) {
    const std::string file = described_kind(chosen.unknown_verb);
    return misused(
        console, chosen.name,
        fmt::format("unknown verb '{}'. {}", chosen.unknown_verb,
                    file.empty() ? suggestion(chosen.unknown_verb, names_of(chosen.node->children)) : file));
  }
  const std::span<const std::string> given = std::span(words).subspan(chosen.verbs);
  if (const std::string missing = missing_value(given, *chosen.node->app);
      chosen.node->run && !missing.empty())
    return misused(console, chosen.full_name, missing);
  try {
    std::reverse(words.begin(), words.end());  // CLI11 expects the words in reverse order
    app.parse(std::move(words));
  } catch (const CLI::CallForAllHelp&) {
    console.print_help(app.help("", CLI::AppFormatMode::All));
    return console.finish(ExitCode::Ok);
  } catch (const CLI::CallForHelp&) {
    console.print_help(app.help());
    return console.finish(ExitCode::Ok);
  } catch (const CLI::CallForVersion& version) {
    console.print(std::string(version.what()) + "\n" + (verbose ? build_details() : ""));
    return console.finish(ExitCode::Ok);
  } catch (const SettingsError& failed) {
    if (exit_code_of(failed.error) == ExitCode::Usage)
      return misused(console, chosen.full_name, to_string(failed.error));
    return console.finish(console.failed(failed.error, ExitCode::SomeFailed));
  } catch (const CLI::ParseError& error) {
    const std::string flag = unknown_flag(app);
    const std::string owner = flag.empty() ? "" : verb_with(flag, chosen);
    return misused(console, owner.empty() ? chosen.full_name : owner, explain(error, app, chosen));
  }
  if (const std::string flag = flag_without_number(*chosen.node->app); !flag.empty())
    return misused(console, chosen.full_name, fmt::format("({}): 'nan' is not a number.", flag));
  return console.finish(chosen.node->run(console));
}

}  // namespace

bool has_word(const std::vector<std::string>& words, const std::string& flag) {
  return std::ranges::any_of(
      words, [&](const std::string& word) { return word == flag || word.starts_with(flag + "="); });
}

std::vector<std::string> inputs_of(const std::vector<std::string>& words, const std::vector<Verb>& verbs) {
  FlagTable flags;
  for (const Verb& verb : verbs) add_flags(verb, flags);
  std::vector<std::string> inputs;
  for (const std::size_t place : input_places(words, flags)) inputs.push_back(words[place]);
  return inputs;
}

int run_program(const Verb& program, std::vector<std::string> words, std::FILE* out, std::FILE* err) {
  ExitCode code = ExitCode::SomeFailed;
  try {
    code = parse_and_run(program, std::move(words), out, err);
  } catch (const std::bad_alloc&) {
    std::fputs(fmt::format("{}: out of memory\n", program.name).c_str(), err);
  } catch (const std::exception& error) {  // thrown by a library; Waymark itself does not throw exceptions

    std::fputs(fmt::format("{}: internal error: {}. Please report it.\n", program.name, error.what()).c_str(),
               err);
  }
  return static_cast<int>(code);
}

}  // namespace waymark::cli
