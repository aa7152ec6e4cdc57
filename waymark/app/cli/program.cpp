#include "waymark/app/cli/program.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <map>
#include <memory>
#include <new>
#include <regex>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "waymark/app/cli/help_text.hpp"
#include "waymark/base/message_text.hpp"

#ifndef WAYMARK_VERSION
#define WAYMARK_VERSION "unknown"
#endif

namespace waymark::cli {
namespace {

/// A verb with its part of the parser.
struct Node {
  const Verb* verb = nullptr;
  CLI::App* app = nullptr;
  Run run;
  std::vector<Node> children;
};

bool says(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::count(words, word) > 0;
}

/// Only verbs that the words name get their flags: all of them take longer than many a verb runs.
Node grow(const Verb& verb, CLI::App& app, const std::vector<std::string>& words) {
  Node node{&verb, &app, {}, {}};
  app.set_help_flag("-h,--help", "Print this and stop");
  app.set_help_all_flag("--help-all", "Print all flags, also those used less, and stop");
  app.footer(verb.help);
  if (verb.report)
    app.formatter(
        std::static_pointer_cast<WrappingFormatter>(app.get_formatter())->with_report(verb.report()));
  if (verb.prepare) node.run = verb.prepare(app);
  for (const Verb& child : verb.verbs) {
    CLI::App* sub = app.add_subcommand(child.name, child.sentence)->group("Verbs");
    node.children.push_back(says(words, child.name) ? grow(child, *sub, words) : Node{&child, sub, {}, {}});
  }
  if (!node.children.empty()) app.require_subcommand(node.run ? 0 : 1, 1);
  return node;
}

const Verb* find_verb(const std::vector<Verb>& verbs, std::string_view name) {
  const auto found = std::ranges::find(verbs, name, &Verb::name);
  return found == verbs.end() ? nullptr : &*found;
}

bool asks_for_help(std::string_view word) { return word == "-h" || word == "--help" || word == "--help-all"; }

/// The verb that a line means and does not name.
struct MeantVerb {
  const Verb* verb = nullptr;  ///< nullptr: the line names all its verbs
  std::string typed{};         ///< what the line has in its place; empty: nothing
};

/// Puts the verb that the words mean where it belongs: "map lap.mcap" becomes "map lap lap.mcap", and
/// "calibrate camera v4l2:/dev/video0" becomes "calibrate guided v4l2:/dev/video0".
MeantVerb complete(const Verb& program, std::vector<std::string>& words) {
  const Verb* parent = nullptr;
  const Verb* verb = &program;
  auto word = words.begin();
  const auto named = [&] { return word == words.end() ? nullptr : find_verb(verb->verbs, *word); };
  for (const Verb* next = named(); next != nullptr; next = named()) {
    parent = std::exchange(verb, next);
    ++word;
  }
  const std::vector<std::string> rest(word, words.end());
  if (!verb->usual_verb || (!rest.empty() && std::ranges::all_of(rest, asks_for_help))) return {};
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

/// How far the words lead into the tree of verbs.
struct Chosen {
  const Node* node = nullptr;
  const Node* parent = nullptr;
  std::string name;          ///< "waymark evaluate detections", as the user named it
  std::string full_name;     ///< with the verb that is meant
  std::string unknown_verb;  ///< the word that should have been a verb; empty when there is none
};

Chosen choose(const Node& root, const std::vector<std::string>& words, const MeantVerb& meant) {
  Chosen chosen{&root, nullptr, root.verb->name, root.verb->name, {}};
  for (const std::string& word : words) {
    if (chosen.node->children.empty()) break;
    if (word.starts_with('-')) continue;
    const auto& children = chosen.node->children;
    const auto found =
        std::find_if(children.begin(), children.end(), [&](const Node& n) { return n.verb->name == word; });
    if (found == children.end()) {
      if (!chosen.node->run) chosen.unknown_verb = word;
      break;
    }
    chosen.parent = chosen.node;
    chosen.node = &*found;
    chosen.full_name += " " + word;
    const std::string& typed = found->verb == meant.verb ? meant.typed : word;
    if (!typed.empty()) chosen.name += " " + typed;
  }
  return chosen;
}

/// The flags of a verb and of all verbs below it.
void collect_flags(const Verb& verb, std::set<std::string, std::less<>>& flags) {
  CLI::App app;
  if (verb.prepare) static_cast<void>(verb.prepare(app));
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) flags.insert("--" + name);
  for (const Verb& child : verb.verbs) collect_flags(child, flags);
}

/// Whether a verb of the program has the flag; asked for the first time, all of them are listed.
HasFlag has_flag_of(const Verb& program) {
  return [&program, flags = std::make_shared<std::set<std::string, std::less<>>>()](std::string_view flag) {
    if (flags->empty()) collect_flags(program, *flags);
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

/// The first word that looks like a flag and is none; empty when there is none.
std::string unknown_flag(const CLI::App& root) {
  for (const std::string& word : root.remaining(true)) {
    if (word.size() > 1 && word.starts_with('-') && word != "--") return word.substr(0, word.find('='));
  }
  return {};
}

/// "0.01" for the parser's "0.010000".
std::string short_number(const std::string& number) {
  if (number.find('.') == std::string::npos) return number;
  const std::string shorter = number.substr(0, number.find_last_not_of('0') + 1);
  return shorter.ends_with('.') ? shorter.substr(0, shorter.size() - 1) : shorter;
}

/// "(--seed): 'abc' is not a number from 0 to 9" for the parser's "--seed: Value abc not in range 0 to 9",
/// and
/// "(--laps): '1e' is not a number" for its "Could not convert: --laps = 1e".
std::string plain_words(const std::string& words) {
  static const std::regex kRange("(--[a-z0-9-]+): Value (.*) not in range (.*) to (.*)");
  static const std::regex kConversion("Could not convert: (--[a-z0-9-]+) = (.*)");
  std::smatch match;
  if (std::regex_match(words, match, kRange))
    return fmt::format("({}): '{}' is not a number from {} to {}", match[1].str(), match[2].str(),
                       short_number(match[3].str()), short_number(match[4].str()));
  if (std::regex_match(words, match, kConversion))
    return fmt::format("({}): '{}' is not a number", match[1].str(), match[2].str());
  return words;
}

/// Whether a line may mean one of these verbs by the name of another.
bool stand_in(const std::vector<Verb>& verbs) {
  return std::ranges::any_of(verbs, [](const Verb& verb) { return verb.verbs.empty() && verb.usual_verb; });
}

/// The verb beside the chosen one that has the flag, where a line need not name which is meant.
std::string verb_with(const std::string& flag, const Chosen& chosen) {
  if (chosen.parent == nullptr) return {};
  const Verb& parent = *chosen.parent->verb;
  if (!parent.usual_verb && !stand_in(parent.verbs)) return {};
  for (const Verb& verb : parent.verbs) {
    if (&verb == chosen.node->verb) continue;
    std::set<std::string, std::less<>> flags;
    collect_flags(verb, flags);
    if (flags.contains(flag)) return chosen.full_name.substr(0, chosen.full_name.rfind(' ') + 1) + verb.name;
  }
  return {};
}

/// What a ParseError means, with the verb that has an unknown flag, or the nearest known flag.
std::string explain(const CLI::ParseError& error, const CLI::App& root, const Chosen& chosen) {
  const std::string flag = unknown_flag(root);
  if (flag.empty()) return plain_words(error.what());
  const std::vector<std::string> own = flags_of(*chosen.node->app);
  if (std::ranges::find(own, flag) != own.end())
    return fmt::format("the flag '{}' belongs after `{}`.", flag, chosen.full_name);
  if (const std::string verb = verb_with(flag, chosen); !verb.empty())
    return fmt::format("unknown flag '{}' of `{}`: it is one of `{}`.", flag, chosen.full_name, verb);
  const std::string nearest = nearest_word(flag, own);
  return fmt::format("unknown flag '{}'.{}", flag,
                     nearest.empty() ? "" : fmt::format(" Did you mean '{}'?", nearest));
}

std::vector<std::string> names_of(const std::vector<Node>& nodes) {
  std::vector<std::string> names;
  names.reserve(nodes.size());
  for (const Node& node : nodes) names.push_back(node.verb->name);
  return names;
}

ExitCode misused(Console& console, const std::string& name, const std::string& what) {
  console.say(fmt::format("{}{} See `{} --help`.", what,
                          what.ends_with('?') || what.ends_with('.') ? "" : ".", name));
  return ExitCode::Usage;
}

/// The flag that was given "nan", which passes every test of a range; empty when none was.
std::string flag_without_number(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty()) continue;
    for (const std::string& word : option->results()) {
      if (word.size() <= 4 && CLI::detail::to_lower(word).ends_with("nan")) return option->get_name();
    }
  }
  return {};
}

ExitCode parse_and_run(const Verb& program, std::vector<std::string> words, std::FILE* out, std::FILE* err) {
  CLI::App app(program.sentence, program.name);
  app.formatter(std::make_shared<WrappingFormatter>(has_flag_of(program)));
  const bool verbose = says(words, "--version") && std::erase(words, "--verbose") > 0;
  app.set_version_flag("--version", program.name + " " WAYMARK_VERSION,
                       "Print the version and stop; with --verbose also compiler, features and libraries");
  if (!words.empty() && words.front() == "help") {  // `waymark help detect`
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const bool no_words = words.empty();
  const MeantVerb meant = complete(program, words);
  const Node root = grow(program, app, words);
  const Chosen chosen = choose(root, words, meant);
  Console console(chosen.name, out, err, has_flag_of(program));
  if (no_words) {
    console.say("no verb given.\n\n" + app.help());
    return ExitCode::Usage;
  }
  if (!chosen.unknown_verb.empty()) {
    return misused(console, chosen.name,
                   fmt::format("unknown verb '{}'. {}", chosen.unknown_verb,
                               suggestion(chosen.unknown_verb, names_of(chosen.node->children))));
  }
  try {
    std::reverse(words.begin(), words.end());  // CLI11 wants the last word first
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
  } catch (const CLI::ParseError& error) {
    return misused(console, chosen.full_name, explain(error, app, chosen));
  }
  if (const std::string flag = flag_without_number(*chosen.node->app); !flag.empty())
    return misused(console, chosen.full_name, fmt::format("({}): nan is not a number.", flag));
  return console.finish(chosen.node->run(console));
}

}  // namespace

bool has_word(const std::vector<std::string>& words, const std::string& flag) {
  return std::ranges::any_of(
      words, [&](const std::string& word) { return word == flag || word.starts_with(flag + "="); });
}

std::vector<std::string> inputs_of(const std::vector<std::string>& words, const std::vector<Verb>& verbs) {
  std::map<std::string, int> most_values;
  for (const Verb& verb : verbs) {
    CLI::App app;
    if (verb.prepare) static_cast<void>(verb.prepare(app));
    for (const CLI::Option* option : app.get_options()) {
      const int most = option->get_allow_extra_args() ? option->get_items_expected_max()
                                                      : option->get_items_expected_min();
      for (const std::string& name : option->get_lnames()) most_values["--" + name] = most;
      for (const std::string& name : option->get_snames()) most_values["-" + name] = most;
    }
  }
  std::vector<std::string> inputs;
  int values = 0;  // that may follow
  for (auto word = words.begin(); word != words.end(); ++word) {
    if (*word == "--") return inputs.insert(inputs.end(), word + 1, words.end()), inputs;
    const auto flag = most_values.find(word->substr(0, word->find('=')));
    if (flag != most_values.end())
      values = flag->first == *word ? flag->second : 0;
    else if (values > 0)
      --values;
    else if (!word->starts_with('-'))
      inputs.push_back(*word);
  }
  return inputs;
}

int run_program(const Verb& program, std::vector<std::string> words, std::FILE* out, std::FILE* err) {
  ExitCode code = ExitCode::SomeFailed;
  try {
    code = parse_and_run(program, std::move(words), out, err);
  } catch (const std::bad_alloc&) {
    std::fputs(fmt::format("{}: out of memory\n", program.name).c_str(), err);
  } catch (const std::exception& error) {  // from a library; ours do not throw
    std::fputs(fmt::format("{}: internal error: {}. Please report it.\n", program.name, error.what()).c_str(),
               err);
  }
  return static_cast<int>(code);
}

}  // namespace waymark::cli
