#pragma once

#include "waymark/base/fields.hpp"

namespace waymark {

/// A field of a job: a Field with what a command line needs beyond it. A job lists its fields as option
/// structs do; its flags are made from them, and `--help` says the sentence:
///
///     visit(self.output, JobField("output FILE", "Recording to write (.mcap)").required());
struct JobField : Field {
  /// `named`: the key, which is the flag with dashes, and what its value is called: "tag_size_m NUMBER";
  /// of a switch the key alone. A range is checked where both of its ends are given.
  constexpr JobField(std::string_view named, std::string_view what,
                     double least = -std::numeric_limits<double>::infinity(),
                     double most = std::numeric_limits<double>::infinity())
      : Field{named.substr(0, named.find(' ')), what, least, most},
        value_name(named.substr(name.size() + (name.size() < named.size() ? 1 : 0))) {}

  /// An input, not a flag: a word by itself, called as its value is ("RUN", or "RUN ...").
  [[nodiscard]] constexpr JobField input() const { return with(&JobField::is_input, true); }
  [[nodiscard]] constexpr JobField required() const { return with(&JobField::is_required, true); }
  /// Needed less: only --help-all shows it.
  [[nodiscard]] constexpr JobField less() const { return with(&JobField::is_less, true); }
  /// One of these words, between commas: "jpeg,raw".
  [[nodiscard]] constexpr JobField one_of(std::string_view all) const { return with(&JobField::words, all); }
  /// What is said to be usual, where that is not the value before anything is given, or where that is zero.
  [[nodiscard]] constexpr JobField usually(std::string_view text) const {
    return with(&JobField::usual, text);
  }
  /// Its value before anything is given says nothing, and is not shown.
  [[nodiscard]] constexpr JobField without_usual() const { return with(&JobField::has_no_usual, true); }
  /// In a group of that name, which only --help-all shows.
  [[nodiscard]] constexpr JobField grouped(std::string_view title) const {
    return with(&JobField::group, title);
  }
  /// Means nothing without these other fields, or not beside those: "limo,mbot".
  [[nodiscard]] constexpr JobField needs(std::string_view keys) const {
    return with(&JobField::needed, keys);
  }
  [[nodiscard]] constexpr JobField excludes(std::string_view keys) const {
    return with(&JobField::excluded, keys);
  }
  /// Another name for it.
  [[nodiscard]] constexpr JobField also(std::string_view other) const {
    return with(&JobField::alias, other);
  }
  /// A list that is given in one word, with commas between its parts.
  [[nodiscard]] constexpr JobField by_commas() const { return with(&JobField::has_commas, true); }
  /// A list of which each part is given by a flag of its own.
  [[nodiscard]] constexpr JobField repeated() const { return with(&JobField::is_repeated, true); }
  /// A list of so many parts.
  [[nodiscard]] constexpr JobField parts(int number) const { return with(&JobField::count, number); }

  std::string_view value_name;
  std::string_view words = {};
  std::string_view usual = {};
  std::string_view group = {};
  std::string_view alias = {};
  std::string_view needed = {};
  std::string_view excluded = {};
  bool is_input = false;
  bool is_required = false;
  bool is_less = false;
  bool has_no_usual = false;
  bool has_commas = false;
  bool is_repeated = false;
  int count = 0;  ///< of the parts of a list; 0: any

 private:
  template <class Value>
  [[nodiscard]] constexpr JobField with(Value JobField::*member, const Value& given) const {
    JobField changed = *this;
    changed.*member = given;
    return changed;
  }
};

}  // namespace waymark
