// What a shell offers while somebody types a command line: asked of the program itself, so it
// cannot differ from what the program takes. The shells ask
//
//     PROGRAM --complete WORD...
//
// where the last word, perhaps empty, is the one that is being typed. The answer is a line for each
// word that may stand there; ":files" or ":files .toml" means files as well.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace bushd {

struct Completion {
  std::set<std::string> words{};
  std::string value{};                         // what is wanted here in the help's words: "FILE"
  std::map<std::string, std::string> given{};  // options before it that have values
};

// What stands behind --complete; nothing if the program is run for another purpose.
inline std::optional<std::vector<std::string>> completion_asked(int argc, char** argv) {
  if (argc < 3 || std::string(argv[1]) != "--complete") return std::nullopt;
  return std::vector<std::string>(argv + 2, argv + argc);
}

// `App` is CLI::App, which takes long to compile. Precondition: !words.empty().
template <class App>
Completion complete(const App& app, std::span<const std::string> words) {
  Completion out;
  std::vector<const App*> apps;  // the innermost subcommand last, groups of options after each
  std::vector<const App*> subcommands;  // of that one
  const auto enter = [&apps, &subcommands](const App* entered) {
    apps.push_back(entered);
    subcommands.clear();
    for (const App* each : entered->get_subcommands({})) {
      (each->get_name().empty() ? apps : subcommands).push_back(each);
    }
  };
  const App* innermost = &app;
  enter(innermost);
  std::size_t positionals = 0;
  const auto find = [&apps](const std::string& name) {
    decltype(app.get_option_no_throw(name)) option = nullptr;
    for (const App* each : apps) {
      if (const auto* found = each->get_option_no_throw(name)) option = found;
    }
    return option;
  };
  const auto takes_value = [](const auto* option) {
    return option != nullptr && option->get_items_expected_max() > 0;
  };

  const auto before = words.first(words.size() - 1);
  decltype(find("")) pending = nullptr;
  for (const std::string& word : before) {
    const auto named =
        std::ranges::find(subcommands, word, [](const App* a) { return a->get_name(); });
    if (pending != nullptr) {
      out.given[pending->get_name()] = word;
      pending = nullptr;
    } else if (word.starts_with('-')) {
      pending = takes_value(find(word)) ? find(word) : nullptr;
    } else if (named != subcommands.end()) {
      innermost = *named;
      enter(innermost);
    } else {
      ++positionals;
    }
  }

  const auto want = [&out](const auto* option, const std::string& value) {
    const std::string type = option->get_type_name();  // "TEXT:{rising,falling}"
    const std::size_t begin = type.find('{');
    const std::size_t end = type.find('}', begin);
    if (end == std::string::npos) {
      out.value = value;
      return;
    }
    std::string word;
    for (const char c : type.substr(begin + 1, end - begin)) {
      if (c != ',' && c != '}') {
        word += c;
        continue;
      }
      out.words.insert(word);
      word.clear();
    }
  };
  if (pending != nullptr) {
    want(pending, pending->get_type_name());
  } else if (words.back().starts_with('-')) {
    for (const App* each : apps) {
      for (const auto* option : each->get_options()) {
        for (const std::string& name : option->get_lnames()) out.words.insert("--" + name);
      }
    }
  } else if (!subcommands.empty()) {
    for (const App* each : subcommands) out.words.insert(each->get_name());
  } else {
    // The last one takes all that follow. One that sorts its words by itself begins with names.
    if (innermost->get_allow_extras()) out.value = "NAME";
    std::size_t place = 0;
    for (const auto* option : innermost->get_options()) {
      if (option->get_positional() && place++ <= positionals) want(option, option->get_name());
    }
  }
  std::erase_if(out.words, [&](const auto& word) { return !word.starts_with(words.back()); });
  return out;
}

// Prints the answer. `names`: more words, of which those count that begin as `word` does.
inline void print_completion(const Completion& completion, const std::string& word = {},
                             const std::vector<std::string>& names = {}) {
  for (const std::string& each : completion.words) std::printf("%s\n", each.c_str());
  for (const std::string& name : names) {
    if (name.starts_with(word)) std::printf("%s\n", name.c_str());
  }
  const std::string& value = completion.value;
  if (value == "TABLE") std::printf(":files .toml\n");
  if (value == "FILE" || value == "DIRECTORY" || value == "PATH" || value == "IMAGE") {
    std::printf(":files\n");
  }
}

}  // namespace bushd
