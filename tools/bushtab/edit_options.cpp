#include <fmt/core.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "options.h"
#include "tables/bushd/image.h"
#include "tables/edit.h"

namespace bushtab {
namespace {

namespace tables = bushd::tables;
using tables::SideKey;
using tables::TableContent;
using tables::profiles::Quantity;

// A table that is changed, and how what it is then is told.
void add_changed(CLI::App* command, TableOptions& options) {
  add_table_options(command, options, "Print the changed table as show --json does");
}

struct Codes : TableOptions {
  std::size_t index = 0;
  std::size_t count = 1;
  std::vector<std::uint16_t> codes;
  bool decel = false;

  SideKey side() const { return decel ? SideKey::kDecel : SideKey::kAccel; }
};

constexpr std::int64_t kMaxIndex = tables::kMaxCodes - 1;

struct CodesCommand {
  const char* name;
  const char* help;
  const char* where;  // for the note
  bool takes_codes;
  bushd::Result<TableContent> (*make)(TableContent, const Codes&);
};

constexpr CodesCommand kCodesCommands[] = {
    {"set", "Set codes of a table", "from", true,
     [](TableContent content, const Codes& codes) {
       return tables::set_codes(std::move(content), codes.side(), codes.index, codes.codes);
     }},
    {"insert", "Insert codes before an index", "at", true,
     [](TableContent content, const Codes& codes) {
       return tables::insert_codes(std::move(content), codes.side(), codes.index, codes.codes);
     }},
    {"delete", "Delete codes", "from", false,
     [](TableContent content, const Codes& codes) {
       return tables::delete_codes(std::move(content), codes.side(), codes.index, codes.count);
     }},
};

void add_codes_command(Commands& commands, const CodesCommand& row) {
  const auto [command, options] =
      commands.add<Codes>(row.name, row.help, [&row](const Places& places, const Codes& codes) {
        const std::size_t count = row.takes_codes ? codes.codes.size() : codes.count;
        const std::string note =
            fmt::format("{} {} codes {} {}", row.name, count, row.where, codes.index);
        return change(places, codes, note,
                      [&](TableContent content) { return row.make(std::move(content), codes); });
      });
  add_changed(command, *options);
  command
      ->add_option("INDEX", options->index,
                   "Index of the first code, from 0 in the order of the file")
      ->required()
      ->check(whole_number(0, kMaxIndex));
  if (row.takes_codes) {
    command->add_option("CODE", options->codes, "Delays in time units")
        ->required()
        ->check(whole_number(tables::kCode.least, tables::kCode.most,
                             "a code has 16 bits. For longer delays take a longer time unit first: "
                             "bushtab resample TABLE --time-unit T"));
  } else {
    command->add_option("COUNT", options->count, "Number of codes (default 1)")
        ->check(whole_number(1, tables::kMaxCodes));
  }
  command->add_flag("--decel", options->decel, "Change the decelerating side");
}

// A change of all codes, which says what has become of the time unit, and how much slower than
// asked rounding up has made it.
int change_speeds(const Places& places, const TableOptions& options, const std::string& note,
                  double factor, const Change& change_content) {
  constexpr double kToldFrom = 0.001;
  double shortfall = 0;
  std::uint32_t old_unit_ns = 0;
  std::uint32_t new_unit_ns = 0;
  const int done = change(places, options, note, [&](const TableContent& before) {
    auto after = change_content(before);
    if (after) {
      shortfall = tables::greatest_shortfall(before, *after, factor);
      old_unit_ns = before.time_unit_ns;
      new_unit_ns = after->time_unit_ns;
    }
    return after;
  });
  if (done == kDone && factor != 1 && new_unit_ns != old_unit_ns) {
    fmt::print(stderr,
               "the time unit is {} ns now, as whole numbers of {} ns do not tell these delays "
               "well; all codes are in the new unit\n",
               new_unit_ns, old_unit_ns);
  }
  if (done == kDone && shortfall >= kToldFrom) {
    fmt::print(stderr,
               "delays are rounded up to whole time units: speeds are up to {:.3g} % lower than "
               "asked\n",
               100 * shortfall);
  }
  return done;
}

struct Scale : TableOptions {
  double speed = 0;
  double acceleration = 0;
};

int scale(const Places& places, const Scale& wanted) {
  if (wanted.speed > 0) {
    return change_speeds(places, wanted, fmt::format("speeds times {:.6g}", wanted.speed),
                         wanted.speed, [&](TableContent content) {
                           return tables::scale_speed(std::move(content), wanted.speed);
                         });
  }
  return change(places, wanted, fmt::format("accelerations times {:.6g}", wanted.acceleration),
                [&](TableContent content) {
                  return tables::scale_acceleration(std::move(content), wanted.acceleration);
                });
}

void add_scale(Commands& commands) {
  const auto [command, options] =
      commands.add<Scale>("scale", "Multiply speeds or accelerations", scale);
  add_changed(command, *options);
  auto* what = command->add_option_group("what", "One of")->require_option(1);
  add_value(what, "--speed", options->speed, "FACTOR",
            "Multiply all speeds by FACTOR; takes another time unit if codes of 1..65535 "
            "in the old one do not tell the delays to 1 %")
      ->check(refuse_not_positive);
  add_value(what, "--acceleration", options->acceleration, "FACTOR",
            "Multiply accelerations by FACTOR: the same speeds in fewer or more codes")
      ->check(refuse_not_positive);
}

struct Resampling : TableOptions {
  std::optional<std::uint32_t> time_unit_ns;
  std::size_t codes = 0;
};

int resample(const Places& places, const Resampling& wanted) {
  if (wanted.time_unit_ns) {
    return change_speeds(places, wanted, fmt::format("time unit {} ns", *wanted.time_unit_ns), 1,
                         [&](TableContent content) {
                           return tables::resample_unit(std::move(content), *wanted.time_unit_ns);
                         });
  }
  return change(places, wanted, fmt::format("{} codes a side", wanted.codes),
                [&](TableContent content) {
                  return tables::resample_codes(std::move(content), wanted.codes);
                });
}

void add_resample(Commands& commands) {
  const auto [command, options] =
      commands.add<Resampling>("resample", "Change the time unit or the number of codes", resample);
  add_changed(command, *options);
  auto* how = command->add_option_group("how", "One of")->require_option(1);
  add_time_unit(how, options->time_unit_ns, "Keep the delays, rounded up to this unit");
  add_value(how, "--codes", options->codes, "N",
            "Keep the speeds, over this number of codes a side")
      ->check(whole_number(1, tables::kMaxCodes));
}

int reverse(const Places& places, const TableOptions& options) {
  return change(places, options, "reverse",
                [](TableContent content) { return tables::reverse(std::move(content)); });
}

void add_whole_commands(Commands& commands) {
  add_scale(commands);
  add_resample(commands);
  const auto [reversed, reverse_options] =
      commands.add<TableOptions>("reverse", "Swap acceleration and deceleration", reverse);
  add_changed(reversed, *reverse_options);
  const auto [edited, edit_options] =
      commands.add<TableOptions>("edit", "Edit the file in $VISUAL or $EDITOR", edit);
  add_changed(edited, *edit_options);
  edited->footer("A text that is not a valid table is kept aside; the old table stays.");
}

void add_tui(Commands& commands) {
  const auto [command, options] =
      commands.add<Tui>("tui", "Edit a table in a full-screen editor", tui);
  command->add_option("TABLE", options->table, kTable)->required();
  options->steps = {100, 1000, 10000};
  add_value(command, "--steps", options->steps, "N",
            "Lengths of the moves whose times are shown (default 100 1000 10000)")
      ->check(whole_number(0, 2147483647));
  add_limit_options(command, options->limits);
  command->footer("? lists the keys. Each save is a new revision.");
}

void add_history_commands(Commands& commands) {
  const auto [copied, copy_options] =
      commands.add<Copy>("copy", "Copy a table to another name", copy);
  add_changed(copied, *copy_options);
  add_new_table(copied, "NEW", copy_options->to);
  const auto [logged, log_options] = commands.add<TableOptions>(
      "log", "Show the revisions of a table, the newest first", bushtab::log);
  add_table_options(logged, *log_options);
  const auto [reverted, revert_options] =
      commands.add<Revert>("revert", "Make an old revision the newest again", revert);
  add_changed(reverted, *revert_options);
  reverted->add_option("REVISION", revert_options->revision, "Its number or a tag")->required();
  const auto [tagged, tag_options] = commands.add<Tag>("tag", "Give a revision a name", tag);
  add_table_options(tagged, *tag_options);
  tagged->add_option("TAG", tag_options->tag, "Name of the revision")->required();
  tagged->add_option("REVISION", tag_options->revision,
                     "Its number or another tag (default: the newest)");
}

void add_export(Commands& commands) {
  const auto [to, out] = commands.add<BushdExport>(
      "export-bushd", "Write a table into a memory image of BUSHD", export_bushd);
  to->add_option("TABLE", out->table, kTable)->required();
  to->add_option("IMAGE", out->image, "1024 bytes; other pages of an image that is there stay")
      ->required();
  to->add_option("--page", out->page, "Page of BUSHD-2, 0..3 (default 0)")
      ->check(CLI::Range(0U, 3U));
  to->add_option("--steps", out->steps,
                 "Number of steps of the program, 0..65535 (BUSHD-1: 1..126)")
      ->required()
      ->check(whole_number(0, std::numeric_limits<std::uint32_t>::max()));
  to->add_option("--positions", out->positions, "The position area, 32 hexadecimal digits");
  to->add_flag("--resample", out->resample,
               "Round up to codes of 8 bits, cut the top speed at 238 codes, and print the error");
  to->add_flag("--json", out->json, "Print what was written as JSON");
  auto* bushd1 = to->add_flag("--bushd1", out->bushd1,
                              "Write a travel of BUSHD-1 instead, 4 bytes and one a step");
  to->add_option("--reactor-delay", out->reactor_delay,
                 "BUSHD-1: code of the delay from reactor start")
      ->needs(bushd1)
      ->check(whole_number(0, 65535));
}

int import_checked(const Places& places, const BushdImport& wanted) {
  if (wanted.bushd1 && !wanted.time_unit_ns) {
    return refuse(bushd::Error{.message = "--bushd1 needs --time-unit"});
  }
  if (!wanted.bushd1 && !wanted.start_hz) {
    return refuse(bushd::Error{.message = "F_start is not in the image: --start 1..100Hz"});
  }
  return import_bushd(places, wanted);
}

void add_import(Commands& commands) {
  const auto [from, in] = commands.add<BushdImport>(
      "import-bushd", "Make a table from a memory image of BUSHD", import_checked);
  from->add_option("IMAGE", in->image, "1024 bytes, or with --bushd1 4 and one a step")->required();
  add_new_table(from, "TABLE", in->table);
  from->add_option("--page", in->page, "Page of BUSHD-2, 0..3 (default 0)")
      ->check(CLI::Range(0U, 3U));
  add_quantity(from, "--start", Quantity::kSpeed, in->start_hz,
               "F_start that the hardware is set to: 1..100 Hz");
  add_time_unit(from, in->time_unit_ns, "BUSHD-1: time unit of its codes");
  from->add_flag("--bushd1", in->bushd1, "Read a travel of BUSHD-1");
  from->add_flag("--replace", in->replace, "Make a new revision if the table exists");
  from->add_flag("--json", in->json, "Print steps and positions of the image as JSON");
}

}  // namespace

void add_edit_options(Commands& commands) {
  for (const CodesCommand& row : kCodesCommands) add_codes_command(commands, row);
  add_whole_commands(commands);
  add_tui(commands);
  add_history_commands(commands);
  add_export(commands);
  add_import(commands);
}

}  // namespace bushtab
