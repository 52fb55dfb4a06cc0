#include "daemon/model/name_patterns.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "api/name_pattern.h"

namespace bushd::daemon {
namespace {

const std::string& name_of(const std::string& name) {
  return name;
}
const std::string& name_of(const api::MotorAmount& motor) {
  return motor.motor;
}
std::string renamed(const std::string&, const std::string& motor) {
  return motor;
}
api::MotorAmount renamed(const api::MotorAmount& amount, const std::string& motor) {
  return {motor, amount.amount};
}

template <class Named>
bool has_pattern(const std::vector<Named>& names) {
  return std::ranges::any_of(
      names, [](const Named& named) { return api::is_name_pattern(name_of(named)); });
}

// A motor for which several of the names stand is meant once. With an amount it would have two,
// which is refused as of names.
template <class Named>
std::vector<Named> with_motors(const Installation& installation, const std::vector<Named>& names) {
  std::vector<Named> out;
  const auto add = [&out](Named named) {
    const bool once = std::is_same_v<Named, std::string>;
    const auto same = [&](const Named& other) { return name_of(other) == name_of(named); };
    if (!once || std::ranges::none_of(out, same)) out.push_back(std::move(named));
  };
  const config::Config& config = installation.config();
  for (const Named& named : names) {
    bool found = false;
    for (const MotorId id : installation.motors()) {
      const std::string& motor = installation[id].name();
      const std::string& group = config[config[id].group].name;
      if (!api::is_name_pattern(name_of(named)) ||
          !api::names_motor(name_of(named), motor, group)) {
        continue;
      }
      found = true;
      add(renamed(named, motor));
    }
    if (!found) add(named);
  }
  return out;
}

template <class Asked>
constexpr bool kHasColumns =
    std::is_same_v<Asked, api::MovePath> || std::is_same_v<Asked, api::Follow>;

}  // namespace

std::optional<api::Request> with_motors_of_patterns(const Installation& installation,
                                                    const api::Request& request) {
  return std::visit(
      [&](const auto& asked) -> std::optional<api::Request> {
        using Asked = std::remove_cvref_t<decltype(asked)>;
        if constexpr (requires { asked.motors; } && !kHasColumns<Asked>) {
          if (!has_pattern(asked.motors)) return std::nullopt;
          Asked of_motors = asked;
          of_motors.motors = with_motors(installation, asked.motors);
          return api::Request(std::move(of_motors));
        } else {
          return std::nullopt;
        }
      },
      request);
}

}  // namespace bushd::daemon
