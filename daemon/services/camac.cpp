#include "daemon/services/camac.h"

#include <algorithm>
#include <string>
#include <utility>

#include "daemon/services/camac_motors.h"
#include "daemon/services/camac_shutter.h"
#include "heritage/camac/block.h"
#include "heritage/camac/memory_text.h"

namespace bushd::daemon {
namespace {

constexpr const char* kMemory = "memory";  // in the store
constexpr const char* kMotion = "motion";
constexpr int kWrites = 16;  // the function

bool writes(const camac::Block& block) {
  return std::ranges::any_of(block.cycles,
                             [](const camac::Naf& cycle) { return cycle.function == kWrites; });
}

std::string name_of(const config::Crate& crate, const config::CamacModule& module) {
  return "camac-" + std::to_string(crate.number) + "-" + std::to_string(module.station);
}

camac::AdjustableDelay adjusts(const config::CamacModule& module) {
  return module.adjustable_delay == config::CamacModule::AdjustableDelay::kOpening
             ? camac::AdjustableDelay::kOpening
             : camac::AdjustableDelay::kReturn;
}

Result<void> in_range(const char* what, std::int64_t value, fields::Range<std::int64_t> allowed) {
  if (allowed.has(value)) return {};
  return fail(std::string(what) + " " + std::to_string(value) + " is out of range; allowed: " +
              std::to_string(allowed.least) + ".." + std::to_string(allowed.most));
}

Result<void> check(const camac::Naf& naf) {
  auto good = in_range("station", naf.station, camac::kStation);
  if (good) good = in_range("subaddress", naf.subaddress, camac::kSubaddress);
  if (good) good = in_range("function", naf.function, camac::kFunction);
  if (good) good = in_range("data", naf.data, camac::kData);
  return good;
}

Result<void> check(const camac::Block& block) {
  const auto cycles = static_cast<std::int64_t>(block.cycles.size());
  auto good = in_range("number of cycles", cycles, camac::Block::kWords);
  if (good) good = in_range("count", block.count, camac::Block::kWords);
  if (good) good = in_range("last station", block.last_station, camac::kModules);
  if (good) good = in_range("last subaddress", block.last_subaddress, camac::kSubaddress);
  for (std::size_t i = 0; good && i < block.cycles.size(); ++i) good = check(block.cycles[i]);
  if (!good) return good;
  const bool words =
      block.mode == camac::BlockMode::kSingle || camac::writes(block.cycles.front().function);
  if (words && block.count != cycles) {
    return fail("the count is " + std::to_string(block.count) + " and " + std::to_string(cycles) +
                " words are given; give as many");
  }
  return {};
}

}  // namespace

class Camac::Station {
 public:
  virtual ~Station() = default;
  // Its name in the store.
  explicit Station(std::string name) : kept_as(std::move(name)) {}
  virtual camac::MotionModule& module() = 0;
  // Whether its memory has changed for good, by a motion that has ended.
  virtual bool step(std::int64_t now_us) = 0;
  virtual void end_overtaken() = 0;
  virtual std::string take_note() = 0;
  virtual std::optional<KeptMotion> to_keep() const = 0;
  virtual void find(const KeptMotion& kept) = 0;

  const std::string kept_as;
  bool keeps_motion = false;  // one that goes on without the daemon is in the store
};

class Camac::Bushd1Station final : public Station {
 public:
  template <class... Args>
  Bushd1Station(std::string place, camac::AdjustableDelay adjusts, Args&&... args)
      : Station(std::move(place)),
        shutter_(std::forward<Args>(args)...),
        module_(shutter_, adjusts) {}
  camac::MotionModule& module() override { return module_; }
  bool step(std::int64_t now_us) override {
    shutter_.follow(now_us, module_);
    return false;
  }
  void end_overtaken() override { shutter_.end_overtaken(); }
  std::string take_note() override { return shutter_.take_note(); }
  std::optional<KeptMotion> to_keep() const override { return shutter_.to_keep(module_); }
  void find(const KeptMotion& kept) override { shutter_.find(kept, module_); }

 private:
  CamacShutter shutter_;
  camac::Bushd1 module_;
};

class Camac::Bushd2Station final : public Station {
 public:
  template <class... Args>
  explicit Bushd2Station(std::string place, Args&&... args)
      : Station(std::move(place)), motors_(std::forward<Args>(args)...), module_(motors_) {}
  camac::MotionModule& module() override { return module_; }
  // Who does not answer is told by the core: his move ends.
  bool step(std::int64_t now_us) override {
    const bool moved = module_.is_moving();
    motors_.step(now_us, module_);
    return moved && !module_.is_moving();
  }
  void end_overtaken() override { motors_.end_overtaken(); }
  std::string take_note() override { return motors_.take_note(); }
  std::optional<KeptMotion> to_keep() const override { return motors_.to_keep(module_); }
  void find(const KeptMotion& kept) override { motors_.find(kept, module_); }

 private:
  CamacMotors motors_;
  camac::Bushd2 module_;
};

Camac::Camac(Installation& installation, const Interlocks& interlocks, const OpenMoves& open_moves,
             TablesInService& tables, Lines& lines, Travels& travels, const Programs& programs,
             KeptPositions& kept, Outputs& outputs, const AskCore& ask)
    : installation_(installation), kept_(kept), outputs_(outputs) {
  const CamacParts parts{installation, interlocks, open_moves.precedence(), turn_, tables, programs,
                         outputs,      ask};
  for (const config::Crate& configured : installation.config().crates) {
    Crate crate{.number = configured.number};
    for (const config::CamacModule& module : configured.modules) {
      const std::string name = name_of(configured, module);
      const std::string kept_as =
          "camac/" + std::to_string(configured.number) + "/" + std::to_string(module.station);
      std::unique_ptr<Station> station;
      if (module.type == config::CamacModule::Type::kBushd1) {
        station =
            std::make_unique<Bushd1Station>(kept_as, adjusts(module), name, module, travels, parts);
      } else {
        station = std::make_unique<Bushd2Station>(kept_as, name, module, lines, parts);
      }
      crate.crate.insert(module.station, station->module());
      crate.stations.push_back(std::move(station));
    }
    crates_.push_back(std::move(crate));
  }
}

Camac::~Camac() = default;

void Camac::request(const api::Asker& asker, const api::Camac& request) {
  const auto crate = std::ranges::find(crates_, request.crate, &Crate::number);
  if (crate == crates_.end()) {
    return asker.answer(api::Refused{"there is no crate " + std::to_string(request.crate) +
                                     "; add a [[crate]] with this number to bushd.toml"});
  }
  if (const auto good = check(request.block); !good) {
    return asker.answer(api::Refused{good.error().text()});
  }
  asker.answer(api::Accepted{});
  turn_.after_stops = asker.after_stops;
  api::CamacResult result{.block = camac::transfer(crate->crate, request.block)};
  result.requests = crate->crate.requests();
  crate->told &= result.requests;  // what is raised again before the next step is told again
  std::string reason = std::to_string(result.block.tally) + " words";
  for (const auto& station : crate->stations) {
    station->end_overtaken();
    if (const std::string note = station->take_note(); !note.empty()) reason += "; " + note;
  }
  // Positions that a motion counts are kept when it ends: each look at them would be a sync of the
  // disk.
  if (writes(request.block)) keep_memories(*crate);
  asker.answer(api::Completed{
      .outcome = api::Outcome::kDone, .reason = std::move(reason), .detail = std::move(result)});
}

void Camac::keep_memories(Crate& crate) {
  if (!kept_.keeps()) return;
  for (const auto& station : crate.stations) {
    state::Settings kept{{kMemory, {.value = camac::to_text(station->module().memory())}}};
    const auto motion = station->to_keep();
    station->keeps_motion = motion.has_value();
    if (motion) kept[kMotion].value = to_text(*motion);
    kept_.keep(station->kept_as, kept);
  }
}

void Camac::end_overtaken(std::int64_t) {
  for (const Crate& crate : crates_) {
    for (const auto& station : crate.stations) station->end_overtaken();
  }
}

void Camac::take_kept() {
  for (const Crate& crate : crates_) {
    for (const auto& station : crate.stations) {
      const state::Settings kept = kept_.settings(station->kept_as);
      const auto memory = kept.find(kMemory);
      if (memory == kept.end()) continue;
      if (const auto bytes = camac::bytes_of(memory->second.value)) {
        station->module().load_memory(*bytes);
      }
      const auto motion = kept.find(kMotion);
      if (motion == kept.end()) continue;
      station->keeps_motion = true;
      if (const auto found = kept_motion_of(motion->second.value)) station->find(*found);
    }
  }
}

void Camac::step(std::int64_t now_us) {
  for (Crate& crate : crates_) {
    bool changed = false;
    for (const auto& station : crate.stations) {
      changed |= station->step(now_us);
      changed |= station->to_keep().has_value() != station->keeps_motion;
    }
    // What goes on without this daemon is for the next one, as it was begun.
    if (changed && !installation_.shutting_down) keep_memories(crate);
    tell_lam(crate);
  }
}

void Camac::tell_lam(Crate& crate) {
  const std::uint32_t requests = crate.crate.requests();
  const std::uint32_t raised = requests & ~crate.told;
  crate.told = requests;
  if (raised == 0) return;
  outputs_.publish_lam({.crate = crate.number,
                        .raised = raised,
                        .requests = requests,
                        .demand = crate.crate.demand_enabled()});
}

}  // namespace bushd::daemon
