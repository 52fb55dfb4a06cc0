// Subcommands and their options. A thin layer over CLI11, which only command_line.cpp includes: it
// is slow to compile.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/completion.h"
#include "base/fields.h"
#include "client/client.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace bushctl {

// How to reach the daemon, as all subcommands take it.
struct Connection {
  std::string socket;
  bool lcm = false;
  std::string url;
  std::string prefix = bushd::client::kDefaultPrefix;
  bool lcm_options = false;  // --url or --prefix was given, so LCM is meant

  bushd::client::ClientOptions options() const;
};

// One subcommand. What is pointed to outlives the command line.
class Command {
 public:
  Command(CLI::App* app, const Connection& connection) : app_(app), connection_(&connection) {}

  // Below the options in the help; "": what stands there for all commands.
  Command& footer(const std::string& text);
  Command& flag(const std::string& name, bool* value, const std::string& text);
  // Only together with the option `with`.
  Command& flag_with(const std::string& with, const std::string& name, bool* value,
                     const std::string& text);
  Command& option_with(const std::string& with, const std::string& name, std::string* value,
                       const std::string& text);
  // `name` without dashes: in its place among the words, and needed.
  Command& option(const std::string& name, std::string* value, const std::string& text);
  // In its place among the words, and not needed.
  Command& word(const std::string& name, std::string* value, const std::string& text);
  // The path of a file.
  Command& file(const std::string& name, std::string* value, const std::string& text);
  Command& choice(const std::string& name, std::string* value,
                  const std::vector<std::string>& allowed, const std::string& text);
  // The same, of what only an option or a flag makes sense of.
  Command& choice_with(const std::string& with, const std::string& name, std::string* value,
                       const std::vector<std::string>& allowed, const std::string& text);
  enum class Needed { kNo, kYes };
  template <class Number>
  Command& number(const std::string& name, Number* value, Number least, Number most,
                  const std::string& text, Needed needed = Needed::kNo);
  // As a field declares it.
  template <class Number, class Told>
  Command& number(const std::string& name, Number* value, bushd::fields::Range<Told> range,
                  const std::string& text, Needed needed = Needed::kNo) {
    return number(name, value, static_cast<Number>(range.least), static_cast<Number>(range.most),
                  text, needed);
  }
  // All words that are left.
  Command& words(const std::string& name, std::vector<std::string>* value, const std::string& text,
                 Needed needed);
  // The same, with options of their own among them.
  // `usage`: how --help names them.
  Command& raw_words(std::vector<std::string>* value, const std::string& usage);

  // What it does; the result is the exit code.
  void run(std::function<int()> action);
  // The same with a client (with_client()).
  void run_with_client(std::function<int(bushd::client::Client&)> action);

 private:
  CLI::App* app_;
  const Connection* connection_;
  std::vector<std::string>* raw_words_ = nullptr;
};

class CommandLine {
 public:
  explicit CommandLine(const std::string& version);
  ~CommandLine();

  // `group`: of a command that has commands of its own; "": none.
  Command add(const std::string& name, const std::string& text, const std::string& group = {});
  void add_group(const std::string& name, const std::string& text);
  // Without a daemon.
  Command add_local(const std::string& name, const std::string& text);

  const Connection& connection() const { return connection_; }
  // What may follow; also tells connection() what these words say of it.
  bushd::Completion complete(const std::vector<std::string>& words);
  // The exit code of the subcommand that was chosen.
  int run(int argc, char** argv);

 private:
  void add_connection(CLI::App* app);

  std::unique_ptr<CLI::App> app_;
  Connection connection_;
};

}  // namespace bushctl
