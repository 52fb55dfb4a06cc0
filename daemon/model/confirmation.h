// An accepted request that is done when MCUs have answered it and reported since.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "api/session.h"
#include "base/result.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

// For an answer, beyond what the line needs.
inline constexpr std::int64_t kConfirmUs = 5'000'000;

class Confirmation {
 public:
  // The request is accepted, and told so.
  Confirmation(api::Asker asker, std::vector<McuId> mcus, std::int64_t now_us);

  bool awaits(McuId mcu) const;
  // `reported`: an MCU that has just done so. `check` is what its report shows against the request
  // ("did not ..."). Returns whether it has ended, and how.
  using Check = std::function<Result<void>(const Mcu&)>;
  std::optional<Result<void>> follow(std::int64_t now_us, const Mcu* reported,
                                     const Installation& installation, const Check& check);
  const api::Asker& asker() const { return asker_; }
  static api::Completed result_of(const Result<void>& ended, const std::string& done = "done");
  // Tells who asked; `done` is the reason when all is well.
  void answer(const Result<void>& ended, const std::string& done = "done") const;

 private:
  api::Asker asker_;
  std::vector<McuId> awaited_;
  std::int64_t deadline_us_;
};

}  // namespace bushd::daemon
