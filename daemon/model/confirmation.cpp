#include "daemon/model/confirmation.h"

#include <algorithm>
#include <utility>

namespace bushd::daemon {

Confirmation::Confirmation(api::Asker asker, std::vector<McuId> mcus, std::int64_t now_us)
    : asker_(std::move(asker)), awaited_(std::move(mcus)), deadline_us_(now_us + kConfirmUs) {
  asker_.answer(api::Accepted{});
}

bool Confirmation::awaits(McuId mcu) const {
  return std::ranges::find(awaited_, mcu) != awaited_.end();
}

std::optional<Result<void>> Confirmation::follow(std::int64_t now_us, const Mcu* reported,
                                                 const Installation& installation,
                                                 const Check& check) {
  if (reported != nullptr && !reported->busy() && std::erase(awaited_, reported->id) != 0) {
    if (const auto good = check(*reported); !good) {
      return fail("MCU " + reported->name() + " " + good.error().text());
    }
  }
  if (awaited_.empty()) return Result<void>();
  if (now_us <= deadline_us_) return std::nullopt;
  return fail("MCU " + installation[awaited_.front()].name() + " did not confirm it in time");
}

api::Completed Confirmation::result_of(const Result<void>& ended, const std::string& done) {
  if (ended) return api::done(done);
  return {.outcome = api::Outcome::kFault, .reason = ended.error().text(), .detail = {}};
}

void Confirmation::answer(const Result<void>& ended, const std::string& done) const {
  asker_.answer(result_of(ended, done));
}

}  // namespace bushd::daemon
