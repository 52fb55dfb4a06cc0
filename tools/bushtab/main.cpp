// bushtab: makes, shows, edits and checks acceleration tables.
#include <cstdio>
#include <exception>
#include <functional>

#include "base/completion.h"
#include "base/parse_error.h"
#include "base/printable.h"
#include "base/standard_output.h"
#include "open_table.h"
#include "options.h"

namespace {

constexpr int kUsage = 2;

int run(int argc, char** argv) {
  CLI::App app{"bushtab: make, show, edit and check acceleration tables"};
  app.footer("Exit codes: 0 done, 1 refused (reason on stderr), 2 wrong usage.");
  app.set_version_flag("--version", BUSHD_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  bushtab::Places places;
  app.add_option("--dir", places.directory, "Directory of tables (default /etc/bushd/tables)")
      ->type_name("DIRECTORY");
  app.add_option("--history", places.history,
                 "File of the revisions (default: /var/lib/bushd/tables/history.sqlite for the "
                 "default directory, else .history.sqlite beside the table)")
      ->type_name("FILE");

  std::function<int()> chosen;
  bushtab::Commands commands(app, places, chosen);
  bushtab::add_new_options(commands);
  bushtab::add_wizard_options(commands);
  bushtab::add_envelope_options(commands);
  bushtab::add_edit_options(commands);
  bushtab::add_look_options(commands);
  if (const auto words = bushd::completion_asked(argc, argv)) {
    auto completion = bushd::complete(app, *words);
    places.directory = completion.given["--dir"];
    const bool table = completion.value == "TABLE";
    bushd::print_completion(completion, words->back(),
                            table ? bushtab::table_names(places) : std::vector<std::string>());
    return bushtab::kDone;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return bushd::answered(app, error) ? bushtab::kDone : kUsage;
  }
  return chosen();
}

}  // namespace

int main(int argc, char** argv) {
  bushd::expect_closed_output();
  try {
    return bushd::finished_output(run(argc, argv));
  } catch (const std::exception& error) {
    // An output that is closed throws as well; that is told, or not, below.
    if (std::ferror(stdout) == 0)
      std::fprintf(stderr, "bushtab: %s\n", bushd::printable(error.what()).c_str());
    return bushd::finished_output(bushtab::kRefused);
  }
}
