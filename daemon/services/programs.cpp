#include "daemon/services/programs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/services/program_words.h"
#include "engine/program.h"
#include "words/remedy.h"

namespace bushd::daemon {

namespace {

using api::Outcome;

// How its texts are kept.
constexpr const char* kName = "name";
constexpr const char* kText = "text";
constexpr const char* kPoints = "points/";  // and the name of the file

}  // namespace

Programs::Programs(Installation& installation, Interlocks& interlocks, OpenMoves& open_moves,
                   KeptPositions& kept, IdleDrivers& idle_drivers, Outputs& outputs)
    : installation_(installation),
      interlocks_(interlocks),
      open_(open_moves),
      kept_(kept),
      idle_drivers_(idle_drivers),
      outputs_(outputs) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) mcus_.add();
  // An MCU takes no limit inputs while a program runs, and may have those of another configuration.
  interlocks.add([this](MotorId motor) -> Result<void> {
    const Mcu& mcu = installation_.mcu_of(motor);
    const auto& run = mcus_[mcu.id].run;
    if (!run || run->known || installation_[motor].is<motion::InProgram>()) return {};
    return fail(
        "MCU " + mcu.name() +
        " is told its inputs when the program of before, which runs there, has ended; run " +
        words::remedy("stop", stopped_by(mcu.id)) + " first");
  });
}

// -- what is known

const link::ProgramView& Programs::view(McuId id) const {
  const Mcu& mcu = installation_[id];
  return mcu.offers.programs->program(mcu.on_bus());
}

bool Programs::is_loaded(McuId id) const {
  const auto& program = mcus_[id].program;
  if (!program || !installation_[id].can_have_program()) return false;
  const link::ProgramView& its = view(id);
  return its.known && !its.uploading && its.state.stage >= BUSHD_PROGRAM_LOADED &&
         its.state.crc == program->crc;
}

std::optional<McuId> Programs::find(const std::string& name) const {
  for (const McuId id : installation_.mcus()) {
    if (mcus_[id].program && mcus_[id].program->name == name) return id;
  }
  return std::nullopt;
}

// One that was put by another daemon, perhaps for another configuration, has no name.
std::optional<McuId> Programs::find_by_checksum(const std::string& checksum) const {
  for (const McuId id : installation_.mcus()) {
    if (installation_[id].can_have_program() && view(id).known && entry(id).checksum == checksum) {
      return id;
    }
  }
  return std::nullopt;
}

// A motor of the program that is under way, by which that is stopped.
const std::string& Programs::stopped_by(McuId id) const {
  const auto& run = mcus_[id].run;
  const bool known = run && !run->motors.empty();
  return installation_[known ? run->motors.front() : installation_[id].motors().front()].name();
}

// It has one of that name, or is getting it.
bool Programs::has_or_gets(McuId id, const std::string& name) const {
  const OfMcu& its = mcus_[id];
  return (its.program && its.program->name == name) ||
         (its.upload && its.upload->program.name == name);
}

// ", at frame 3 (scan:14), point 2, after 5 repeats"
std::string Programs::where(McuId id) const {
  const bushd_program_state& state = view(id).state;
  const auto& program = mcus_[id].program;
  std::string text = fmt::format(", at frame {}", state.frame + 1);
  if (program && state.crc == program->crc && state.frame < program->text.frames.size()) {
    const programs::Frame& frame = program->text.frames[state.frame];
    text += " (" + frame.place + ")";
    if (std::holds_alternative<programs::Line>(frame.what)) {
      text += fmt::format(", point {}", state.point + 1);
    }
  }
  if (state.repeats != 0) text += fmt::format(", after {} repeats", state.repeats);
  return text;
}

api::ProgramEntry Programs::entry(McuId id) const {
  const Mcu& mcu = installation_[id];
  const link::ProgramView& its = view(id);
  api::ProgramEntry entry{.mcu = mcu.name()};
  if (is_loaded(id)) entry = entry_of(installation_, *mcus_[id].program);
  entry.stage = its.known ? stage_word(its.state.stage) : "unknown";
  if (!its.known) return entry;
  const bushd_program_state& state = its.state;
  const bool whole = state.stage >= BUSHD_PROGRAM_LOADED;
  const bool has_run = state.stage >= BUSHD_PROGRAM_RUNS;
  if (whole) entry.checksum = fmt::format("{:08x}", state.crc);
  if (state.stage == BUSHD_PROGRAM_ENDED) entry.reason = end_of_program(state, mcu).reason;
  entry.without_host = (state.flags & BUSHD_PROGRAM_WITHOUT_HOST) != 0;
  entry.at_power_on = (state.flags & BUSHD_PROGRAM_AT_POWER_ON) != 0;
  entry.kept = (state.flags & BUSHD_PROGRAM_KEPT) != 0;
  entry.stored = entry.kept && (state.flags & BUSHD_PROGRAM_STORED) != 0;
  entry.bytes = its.uploading ? static_cast<std::int32_t>(its.put) : state.size;
  if (its.uploading) entry.stage = "loading";
  entry.memory = state.memory;
  entry.frame = has_run ? state.frame + 1 : 0;
  entry.point = has_run ? state.point + 1 : 0;
  entry.repeats = state.repeats;
  return entry;
}

std::string Programs::text(McuId id) const {
  if (installation_[id].offers.programs == nullptr) return {};
  const link::ProgramView& its = view(id);
  if (!its.known || !its.under_way()) return {};
  const bushd_program_state& state = its.state;
  const auto& program = mcus_[id].program;
  const bool named = program && program->crc == state.crc;
  std::string text = named ? program->name : fmt::format("{:08x}", state.crc);
  text += std::string(" ") + stage_word(state.stage);
  if (state.stage >= BUSHD_PROGRAM_RUNS) text += fmt::format(", frame {}", state.frame + 1);
  if (state.repeats != 0) text += fmt::format(", after {} repeats", state.repeats);
  if ((state.flags & BUSHD_PROGRAM_WITHOUT_HOST) != 0) text += ", without host";
  return text;
}

// -- put, erase, list

void Programs::request(const api::Asker& asker, const api::ListPrograms&) {
  api::ProgramList list;
  for (const McuId id : installation_.mcus()) {
    if (installation_[id].can_have_program()) list.programs.push_back(entry(id));
  }
  asker.answer(api::Completed{.outcome = Outcome::kDone, .reason = "done", .detail = list});
}

Result<void> Programs::may_be_put(const CheckedProgram& program) const {
  const Mcu& mcu = installation_[program.mcu];
  const OfMcu& its = mcus_[program.mcu];
  if (its.run || view(mcu.id).under_way()) {
    return fail("the program of MCU " + mcu.name() + " is under way; run " +
                words::remedy("stop", stopped_by(mcu.id)) + " first");
  }
  if (its.upload || view(mcu.id).uploading) {
    return fail("MCU " + mcu.name() + " is getting " +
                (its.upload ? "program " + its.upload->program.name : "a program") +
                "; wait for its end");
  }
  if (its.erase) return fail("MCU " + mcu.name() + " erases its program; wait for its end");
  for (const McuId other : installation_.mcus()) {
    if (other == mcu.id || !has_or_gets(other, program.name)) continue;
    return fail("MCU " + installation_[other].name() + " has a program of that name; " +
                (installation_[other].online() ? "erase it, or " : "") +
                "give this one another name");
  }
  if (!program.line_table || program.line_table_is_there) return {};
  if (!mcu.uploads() && installation_.rests(mcu)) return {};
  return fail("MCU " + mcu.name() +
              " has to get the table of its lines, which it takes at rest only; wait until its "
              "motors stand");
}

void Programs::request(const api::Asker& asker, const api::PutProgram& request) {
  auto text = parse_program(request);
  if (!text) return asker.answer(api::Refused{text.error().text()});
  auto program = check_program(installation_, request.program, std::move(*text));
  if (!program) return asker.answer(api::Refused{program.error().text()});
  if (request.dry_run) {
    asker.answer(api::Accepted{});
    api::ProgramList list{{entry_of(installation_, *program)}};
    list.programs.front().stage = stage_word(BUSHD_PROGRAM_NONE);  // as far as this text goes
    list.programs.front().memory = view(program->mcu).state.memory;
    return asker.answer(
        api::Completed{.outcome = Outcome::kDone, .reason = "done", .detail = list});
  }
  if (const auto may = may_be_put(*program); !may) {
    return asker.answer(api::Refused{may.error().text()});
  }
  asker.answer(api::Accepted{});
  const McuId id = program->mcu;
  const Mcu& mcu = installation_[id];
  mcus_[id].program.reset();
  keep(id, nullptr);
  for (const McuId other : installation_.mcus()) {
    const auto& kept = mcus_[other].kept;
    if (kept && kept->program == program->name) keep(other, nullptr);
  }
  if (program->line_table && !program->line_table_is_there) {
    mcu.offers.uploads->upload(mcu.on_bus(), program->line_table->view());
  }
  const bool kept = program->text.kept || is_kept(id);
  mcus_[id].upload =
      Upload{.program = std::move(*program), .source = request, .asker = asker, .kept = kept};
  installation_.changed = true;
}

bool Programs::is_kept(McuId id) const {
  return view(id).known && (view(id).state.flags & BUSHD_PROGRAM_KEPT) != 0;
}

// Until a reset would leave what is there now; for a while only, since motors may move for hours.
bool Programs::waits_until_stored(std::int64_t now_us, McuId id,
                                  std::optional<std::int64_t>& by_us) const {
  if ((view(id).state.flags & BUSHD_PROGRAM_STORED) != 0) return false;
  if (!by_us) by_us = now_us + kStoredWithinUs;
  return now_us < *by_us;
}

void Programs::follow_upload(std::int64_t now_us, McuId id) {
  Upload& upload = *mcus_[id].upload;
  const Mcu& mcu = installation_[id];
  if (!upload.began) {
    const tables::TablePtr& table = upload.program.line_table;
    if (table && !mcu.has_table(table->view())) {
      if (mcu.uploads()) return;
      return end_upload(id, fail("MCU " + mcu.name() +
                                 " did not take the table of its lines; put it again when its "
                                 "motors rest"));
    }
    upload.began = true;
    return mcu.offers.programs->put_program(mcu.on_bus(), upload.program.bytes);
  }
  const link::ProgramView& its = view(id);
  if (its.uploading || !its.known || mcu.busy()) return;
  if (its.refused == BUSHD_E_CAPACITY && upload.program.text.kept) {
    return end_upload(id, fail("MCU " + mcu.name() +
                               " keeps no program over a reset; leave kept and at_power_on out"));
  }
  if (its.refused != BUSHD_OK) {
    return end_upload(id,
                      fail("MCU " + mcu.name() + " refused it: " + bushd_status_text(its.refused)));
  }
  if (its.state.stage != BUSHD_PROGRAM_LOADED || its.state.crc != upload.program.crc) {
    return end_upload(id, fail("MCU " + mcu.name() + " has another program: somebody else put it"));
  }
  if (upload.kept && waits_until_stored(now_us, id, upload.stored_by_us)) return;
  end_upload(id, {});
}

void Programs::end_upload(McuId id, const Result<void>& how) {
  Upload upload = *std::exchange(mcus_[id].upload, std::nullopt);
  const Mcu& mcu = installation_[id];
  // It was taken, and its MCU was lost while it wrote.
  const bool there = upload.stored_by_us.has_value();
  if (!how && !there) {
    if (!upload.began && mcu.uploads()) mcu.offers.uploads->end_upload(mcu.on_bus());
    return upload.asker.answer(
        api::Completed{.outcome = mcu.online() ? Outcome::kFault : Outcome::kLink,
                       .reason = "not put: " + how.error().text(),
                       .detail = {}});
  }
  mcus_[id].program = std::move(upload.program);
  keep(id, &upload.source);
  if (!how) {
    return upload.asker.answer(
        api::Completed{.outcome = Outcome::kLink,
                       .reason = how.error().text() +
                                 ": it is put, and may outlive a power cut or not; the list of "
                                 "programs shows it when its MCU is back",
                       .detail = {}});
  }
  upload.asker.answer(api::Completed{
      .outcome = Outcome::kDone, .reason = "done", .detail = api::ProgramList{{entry(id)}}});
}

void Programs::request(const api::Asker& asker, const api::EraseProgram& request) {
  auto id = find(request.program);
  if (!id) id = find_by_checksum(request.program);
  if (!id) {
    return asker.answer(api::Refused{"no MCU has a program \"" + request.program +
                                     "\"; 'bushctl program list' shows those that there are"});
  }
  const Mcu& mcu = installation_[*id];
  if (mcus_[*id].run || view(*id).under_way()) {
    return asker.answer(
        api::Refused{"it is under way; run " + words::remedy("stop", stopped_by(*id)) + " first"});
  }
  if (mcus_[*id].upload || mcus_[*id].erase) {
    return asker.answer(
        api::Refused{"MCU " + mcu.name() + " gets or erases a program; wait for its end"});
  }
  if (const auto online = mcu.must_be_online(); !online) {
    return asker.answer(api::Refused{online.error().text()});
  }
  asker.answer(api::Accepted{});
  mcus_[*id].program.reset();
  keep(*id, nullptr);
  mcus_[*id].erase = Erase{.asker = asker, .kept = is_kept(*id)};
  mcu.offers.programs->erase_program(mcu.on_bus());
}

void Programs::follow_erase(std::int64_t now_us, McuId id) {
  const Mcu& mcu = installation_[id];
  if (mcu.busy() || !view(id).known) return;
  Erase& erase = *mcus_[id].erase;
  const bool gone = view(id).state.stage == BUSHD_PROGRAM_NONE;
  if (gone && erase.kept && waits_until_stored(now_us, id, erase.stored_by_us)) return;
  const bool for_good = !erase.kept || (view(id).state.flags & BUSHD_PROGRAM_STORED) != 0;
  const api::Asker asker = erase.asker;
  mcus_[id].erase.reset();
  if (gone && for_good) return asker.answer(api::done("done"));
  const std::string reason =
      gone ? "MCU " + mcu.name() +
                 " has erased it, and would have it again after a power cut: that is over when its "
                 "motors have rested for 512 ticks, or else after its next reset"
           : "MCU " + mcu.name() + " has a program still";
  asker.answer(api::Completed{.outcome = Outcome::kFault, .reason = reason, .detail = {}});
}

// -- over restarts of the daemon

std::optional<std::uint32_t> Programs::checksum_of(const std::string& name) const {
  const auto id = find(name);
  return id ? std::optional(mcus_[*id].program->crc) : std::nullopt;
}

Programs::Found Programs::found(McuId id, std::uint32_t checksum) const {
  const Mcu& mcu = installation_[id];
  if (mcu.offline() || mcu.busy() || !mcu.can_have_program() || !view(id).known) {
    return mcu.online() && !mcu.can_have_program() ? Found::kNotThere : Found::kUnknown;
  }
  const bushd_program_state& state = view(id).state;
  if (state.crc != checksum || state.stage < BUSHD_PROGRAM_WAITS) return Found::kNotThere;
  if (state.stage != BUSHD_PROGRAM_ENDED || mcus_[id].run) return Found::kRuns;
  return mcu.online() ? Found::kEnded : Found::kUnknown;  // its position is that of the end
}

api::Completed Programs::ending(McuId id) const {
  ProgramEnd ending = end_of_program(view(id).state, installation_[id]);
  return {.outcome = ending.outcome, .reason = ending.reason + where(id), .detail = {}};
}

// Null: there is none.
void Programs::keep(McuId id, const api::PutProgram* source) {
  mcus_[id].kept.reset();
  state::Settings kept;
  if (source != nullptr) {
    kept[kName].value = source->program;
    kept[kText].value = source->text;
    for (const auto& points : source->points) kept[kPoints + points.file].value = points.text;
  }
  kept_.keep("program/" + installation_[id].name(), kept);
}

void Programs::take_kept() {
  for (const McuId id : installation_.mcus()) {
    const state::Settings kept = kept_.settings("program/" + installation_[id].name());
    if (!kept.contains(kName) || !kept.contains(kText)) continue;
    api::PutProgram source{.program = kept.at(kName).value, .text = kept.at(kText).value};
    for (const auto& [key, points] : kept) {
      if (!key.starts_with(kPoints)) continue;
      source.points.push_back({key.substr(std::string_view(kPoints).size()), points.value});
    }
    mcus_[id].kept = std::move(source);
  }
}

// If the MCU has its bytes. It is not told to anybody who might wait for it.
void Programs::know_again(McuId id) {
  const api::PutProgram source = *std::exchange(mcus_[id].kept, std::nullopt);
  auto text = parse_program(source);
  if (!text) return;
  auto program = compile_program(installation_, source.program, std::move(*text));
  if (program && program->mcu == id && program->crc == view(id).state.crc && !find(program->name)) {
    mcus_[id].program = std::move(*program);
  }
}

}  // namespace bushd::daemon
