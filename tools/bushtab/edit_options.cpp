#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <memory>
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
void add_changed(CLI::App* command, std::string& table, bool& json) {
  command->add_option("TABLE", table, kTable)->required();
  command->add_flag("--json", json, "Print the changed table as show --json does");
}

struct Codes {
  std::string table;
  std::size_t index = 0;
  std::size_t count = 1;
  std::vector<std::uint16_t> codes;
  bool decel = false;
  bool json = false;

  SideKey side() const { return decel ? SideKey::kDecel : SideKey::kAccel; }
};

constexpr std::int64_t kMaxIndex = tables::kMaxCodes - 1;

std::shared_ptr<Codes> codes_command(CLI::App* command, bool takes_codes) {
  const auto options = std::make_shared<Codes>();
  add_changed(command, options->table, options->json);
  command
      ->add_option("INDEX", options->index,
                   "Index of the first code, from 0 in the order of the file")
      ->required()
      ->check(whole_number(0, kMaxIndex));
  if (takes_codes) {
    command->add_option("CODE", options->codes, "Delays in time units")
        ->required()
        ->check(whole_number(bushd::tables::kCode.least, bushd::tables::kCode.most,
                             "a code has 16 bits. For longer delays take a longer time unit first: "
                             "bushtab resample TABLE --time-unit T"));
  } else {
    command->add_option("COUNT", options->count, "Number of codes (default 1)")
        ->check(whole_number(1, bushd::tables::kMaxCodes));
  }
  command->add_flag("--decel", options->decel, "Change the decelerating side");
  return options;
}

void add_code_commands(CLI::App& app, const Places& places, const Run& run) {
  CLI::App* set = app.add_subcommand("set", "Set codes of a table");
  const auto set_options = codes_command(set, true);
  run(set, [&places, o = set_options] {
    return change(places, o->table, o->json,
                  fmt::format("set {} codes from {}", o->codes.size(), o->index),
                  [&](TableContent content) {
                    return tables::set_codes(std::move(content), o->side(), o->index, o->codes);
                  });
  });
  CLI::App* insert = app.add_subcommand("insert", "Insert codes before an index");
  const auto insert_options = codes_command(insert, true);
  run(insert, [&places, o = insert_options] {
    return change(places, o->table, o->json,
                  fmt::format("insert {} codes at {}", o->codes.size(), o->index),
                  [&](TableContent content) {
                    return tables::insert_codes(std::move(content), o->side(), o->index, o->codes);
                  });
  });
  CLI::App* remove = app.add_subcommand("delete", "Delete codes");
  const auto remove_options = codes_command(remove, false);
  run(remove, [&places, o = remove_options] {
    return change(places, o->table, o->json,
                  fmt::format("delete {} codes from {}", o->count, o->index),
                  [&](TableContent content) {
                    return tables::delete_codes(std::move(content), o->side(), o->index, o->count);
                  });
  });
}

// A change of all codes, which says what has become of the time unit, and how much slower than
// asked rounding up has made it.
int change_speeds(const Places& places, const std::string& table, bool json,
                  const std::string& note, double factor, const Change& change_content) {
  constexpr double kToldFrom = 0.001;
  double shortfall = 0;
  std::uint32_t old_unit_ns = 0;
  std::uint32_t new_unit_ns = 0;
  const int done = change(places, table, json, note, [&](const TableContent& before) {
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

void add_whole_commands(CLI::App& app, const Places& places, const Run& run) {
  struct Options {
    std::string table;
    double speed = 0;
    double acceleration = 0;
    std::uint32_t time_unit_ns = 0;
    std::size_t codes = 0;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* scale = app.add_subcommand("scale", "Multiply speeds or accelerations");
  add_changed(scale, options->table, options->json);
  auto* what = scale->add_option_group("what", "One of")->require_option(1);
  what->add_option("--speed", options->speed,
                   "Multiply all speeds by FACTOR; takes another time unit if codes of 1..65535 "
                   "in the old one do not tell the delays to 1 %")
      ->check(refuse_not_positive)
      ->type_name("FACTOR");
  what->add_option("--acceleration", options->acceleration,
                   "Multiply accelerations by FACTOR: the same speeds in fewer or more codes")
      ->check(refuse_not_positive)
      ->type_name("FACTOR");
  run(scale, [&places, options] {
    if (options->speed > 0) {
      return change_speeds(places, options->table, options->json,
                           fmt::format("speeds times {:.6g}", options->speed), options->speed,
                           [&](TableContent content) {
                             return tables::scale_speed(std::move(content), options->speed);
                           });
    }
    return change(places, options->table, options->json,
                  fmt::format("accelerations times {:.6g}", options->acceleration),
                  [&](TableContent content) {
                    return tables::scale_acceleration(std::move(content), options->acceleration);
                  });
  });

  CLI::App* resample =
      app.add_subcommand("resample", "Change the time unit or the number of codes");
  add_changed(resample, options->table, options->json);
  auto* how = resample->add_option_group("how", "One of")->require_option(1);
  add_quantity(
      how, "--time-unit", Quantity::kTimeUnit,
      [options](double ns) {
        if (ns < 1 || ns > tables::kMaxTimeUnitNs || ns != std::floor(ns)) {
          throw CLI::ValidationError("--time-unit", "allowed: whole ns, 1ns..1s");
        }
        options->time_unit_ns = static_cast<std::uint32_t>(ns);
      },
      "Keep the delays, rounded up to this unit");
  how->add_option("--codes", options->codes, "Keep the speeds, over this number of codes a side")
      ->check(whole_number(1, tables::kMaxCodes))
      ->type_name("N");
  run(resample, [&places, options] {
    if (options->time_unit_ns > 0) {
      return change_speeds(
          places, options->table, options->json,
          fmt::format("time unit {} ns", options->time_unit_ns), 1, [&](TableContent content) {
            return tables::resample_unit(std::move(content), options->time_unit_ns);
          });
    }
    return change(places, options->table, options->json,
                  fmt::format("{} codes a side", options->codes), [&](TableContent content) {
                    return tables::resample_codes(std::move(content), options->codes);
                  });
  });

  CLI::App* reverse = app.add_subcommand("reverse", "Swap acceleration and deceleration");
  add_changed(reverse, options->table, options->json);
  run(reverse, [&places, options] {
    return change(places, options->table, options->json, "reverse",
                  [](TableContent content) { return tables::reverse(std::move(content)); });
  });
  CLI::App* edit = app.add_subcommand("edit", "Edit the file in $VISUAL or $EDITOR");
  add_changed(edit, options->table, options->json);
  edit->footer("A text that is not a valid table is kept aside; the old table stays.");
  run(edit, [&places, options] { return bushtab::edit(places, options->table, options->json); });
}

void add_tui(CLI::App& app, const Places& places, const Run& run) {
  const auto options = std::make_shared<Tui>();
  CLI::App* tui = app.add_subcommand("tui", "Edit a table in a full-screen editor");
  tui->add_option("TABLE", options->table, kTable)->required();
  options->steps = {100, 1000, 10000};
  tui->add_option("--steps", options->steps,
                  "Lengths of the moves whose times are shown (default 100 1000 10000)")
      ->check(whole_number(0, 2147483647))
      ->type_name("N");
  add_limit_options(tui, options->limits);
  tui->footer("? lists the keys. Each save is a new revision.");
  run(tui, [&places, options] { return bushtab::tui(places, *options); });
}

void add_history_commands(CLI::App& app, const Places& places, const Run& run) {
  struct Options {
    std::string table;
    std::string other;
    std::string revision;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* copy = app.add_subcommand("copy", "Copy a table to another name");
  add_changed(copy, options->table, options->json);
  copy->add_option("NEW", options->other, "The new table's name, or a file NAME.toml")->required();
  run(copy, [&places, options] {
    return bushtab::copy(places, options->table, options->other, options->json);
  });
  CLI::App* log = app.add_subcommand("log", "Show the revisions of a table, the newest first");
  log->add_option("TABLE", options->table, kTable)->required();
  log->add_flag("--json", options->json, "Print JSON");
  run(log, [&places, options] { return bushtab::log(places, options->table, options->json); });
  CLI::App* revert = app.add_subcommand("revert", "Make an old revision the newest again");
  add_changed(revert, options->table, options->json);
  revert->add_option("REVISION", options->revision, "Its number or a tag")->required();
  run(revert, [&places, options] {
    return bushtab::revert(places, options->table, options->revision, options->json);
  });
  CLI::App* tag = app.add_subcommand("tag", "Give a revision a name");
  tag->add_option("TABLE", options->table, kTable)->required();
  tag->add_flag("--json", options->json, "Print JSON");
  tag->add_option("TAG", options->other, "Name of the revision")->required();
  tag->add_option("REVISION", options->revision, "Its number or another tag (default: the newest)");
  run(tag, [&places, options] {
    return bushtab::tag(places, options->table, options->other, options->revision, options->json);
  });
}

void add_bushd_commands(CLI::App& app, const Places& places, const Run& run) {
  const auto out = std::make_shared<BushdExport>();
  CLI::App* to = app.add_subcommand("export-bushd", "Write a table into a memory image of BUSHD");
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
  run(to, [&places, out] { return export_bushd(places, *out); });

  const auto in = std::make_shared<BushdImport>();
  CLI::App* from = app.add_subcommand("import-bushd", "Make a table from a memory image of BUSHD");
  from->add_option("IMAGE", in->image, "1024 bytes, or with --bushd1 4 and one a step")->required();
  from->add_option("TABLE", in->table, "The new table's name, or a file NAME.toml")->required();
  from->add_option("--page", in->page, "Page of BUSHD-2, 0..3 (default 0)")
      ->check(CLI::Range(0U, 3U));
  auto* start = add_quantity(
      from, "--start", Quantity::kSpeed, [in](double value) { in->start_hz = value; },
      "F_start that the hardware is set to: 1..100 Hz");
  auto* unit = add_quantity(
      from, "--time-unit", Quantity::kTimeUnit,
      [in](double ns) {
        if (ns < 1 || ns > tables::kMaxTimeUnitNs || ns != std::floor(ns)) {
          throw CLI::ValidationError("--time-unit", "allowed: whole ns, 1ns..1s");
        }
        in->time_unit_ns = static_cast<std::uint32_t>(ns);
      },
      "BUSHD-1: time unit of its codes");
  from->add_flag("--bushd1", in->bushd1, "Read a travel of BUSHD-1");
  from->add_flag("--replace", in->replace, "Make a new revision if the table exists");
  from->add_flag("--json", in->json, "Print steps and positions of the image as JSON");
  run(from, [&places, in, start, unit] {
    if (in->bushd1 ? unit->count() == 0 : start->count() == 0) {
      return refuse(bushd::Error{.message = in->bushd1
                                                ? "--bushd1 needs --time-unit"
                                                : "F_start is not in the image: --start 1..100Hz"});
    }
    return import_bushd(places, *in);
  });
}

}  // namespace

void add_edit_options(CLI::App& app, const Places& places, const Run& run) {
  add_code_commands(app, places, run);
  add_whole_commands(app, places, run);
  add_tui(app, places, run);
  add_history_commands(app, places, run);
  add_bushd_commands(app, places, run);
}

}  // namespace bushtab
