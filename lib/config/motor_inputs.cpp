#include "config/motor_inputs.h"

#include <fmt/format.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::int64_t kLastInput = BUSHD_MOTORS_PER_MCU - 1;
constexpr std::string_view kInputRule =
    "the number of an input, or { input = N, active = \"closed\" or \"open\" }";

// What an input is to a motor.
struct Use {
  std::string_view key;  // of `inputs`
  std::string_view name;
  std::optional<Input> MotorInputs::* input;
};
constexpr std::array<Use, 4> kUses = {{{"positive", "positive limit", &MotorInputs::positive},
                                       {"negative", "negative limit", &MotorInputs::negative},
                                       {"home", "home switch", &MotorInputs::home},
                                       {"step", "step sensor", &MotorInputs::step}}};

bool is_limit(const Use& use) {
  return use.input == &MotorInputs::positive || use.input == &MotorInputs::negative;
}

std::string_view level(const Input& input) {
  return input.active_open ? "open" : "closed";
}

Result<Input> read_input(const TomlReader& inputs, std::string_view key) {
  Input input;
  if (inputs.table(key) == nullptr) {
    const auto number = inputs.integer(key, 0, kLastInput);
    if (!number) {
      Error error = number.error();
      error.message += fmt::format("; or {}", kInputRule.substr(kInputRule.find('{')));
      return fail(std::move(error));
    }
    input.number = static_cast<std::uint8_t>(*number);
    return input;
  }
  const auto reader = inputs.section(key, kInputRule);
  if (!reader) return fail(reader.error());
  const Keys keys = Keys(*reader)
                        .only({"input", "active"})
                        .needed_whole("input", &input.number, 0, kLastInput)
                        .word("active", &input.active_open, {"closed", "open"});
  if (!keys.result()) return fail(keys.result().error());
  return input;
}

Result<void> read_named(const TomlReader& motor_reader, MotorInputs* inputs) {
  constexpr std::string_view kAllowed = "a table such as { positive = 3, negative = 4, home = 5 }";
  const auto reader = motor_reader.section("inputs", kAllowed);
  if (!reader) return fail(reader.error());
  if (auto known = reader->only({"positive", "negative", "home", "step"}); !known) return known;
  bool any = false;
  for (const Use& use : kUses) {
    if (!reader->has(use.key)) continue;
    any = true;
    const auto input = read_input(*reader, use.key);
    if (!input) return fail(input.error());
    inputs->*use.input = *input;
  }
  if (any) return {};
  return fail(motor_reader.error("inputs", fmt::format("is empty; allowed: {}", kAllowed)));
}

// Where the error of that use is to be seen: in `inputs`, or at the older key.
Error error_at(const TomlReader& motor, const Use& use, std::string message) {
  if (motor.table("inputs") != nullptr) {
    const auto inputs = motor.section("inputs", "a table");
    if (inputs && inputs->has(use.key)) return inputs->error(use.key, std::move(message));
  }
  return motor.error(is_limit(use) ? "limit" : use.key, std::move(message));
}

// Within one motor.
Result<void> check_own(const TomlReader& reader, const Motor& motor) {
  for (const Use& one : kUses) {
    const auto& input = motor.inputs.*one.input;
    if (!input) continue;
    for (const Use& other : kUses) {
      const auto& others = motor.inputs.*other.input;
      if (&one == &other || !others || others->number != input->number) continue;
      if (one.input == &MotorInputs::step) {
        return fail(error_at(
            reader, one,
            fmt::format("is input {}, the {} of motor \"{}\"; allowed: an input of its own. "
                        "Connect the sensor to another input",
                        input->number, other.name, motor.name)));
      }
      if (input->active_open == others->active_open) continue;
      return fail(error_at(
          reader, one,
          fmt::format("is input {}, active when {}, but as {} of motor \"{}\" it is active when "
                      "{}; allowed: one level an input",
                      input->number, level(*input), other.name, motor.name, level(*others))));
    }
  }
  return {};
}

// `limit` names the ends at which the motor's one input is a switch.
Result<void> read_limit(const TomlReader& reader, Motor* motor) {
  if (!reader.has("limit")) return {};
  const auto ends = read_word(reader, "limit", {"positive", "negative", "both"});
  if (!ends) return fail(ends.error());
  for (const Use& use : kUses) {
    if (!is_limit(use) || *ends == (use.input == &MotorInputs::positive ? 1 : 0)) continue;
    auto& input = motor->inputs.*use.input;
    if (input) {
      return fail(error_at(
          reader, use,
          fmt::format("is input {}, but `limit` says that the {} of motor \"{}\" is input {}, the "
                      "number of its output; allowed: one of the two keys",
                      input->number, use.name, motor->name, motor->output.value)));
    }
    input = motor->inputs.own;
  }
  return {};
}

// What `inputs` says of it, where nothing else does.
bool named_active_open(const MotorInputs& inputs, std::uint8_t number) {
  for (const Use& use : kUses) {
    const auto& input = inputs.*use.input;
    if (input && input->number == number && input->active_open) return true;
  }
  return false;
}

}  // namespace

Result<void> read_motor_inputs(const TomlReader& reader, std::optional<bool> own_open,
                               Motor* motor) {
  MotorInputs& inputs = motor->inputs;
  if (reader.has("inputs")) {
    if (auto read = read_named(reader, &inputs); !read) return read;
  }
  const std::uint8_t own = motor->output.value;
  inputs.own =
      Input{.number = own, .active_open = own_open.value_or(named_active_open(inputs, own))};
  if (auto read = read_limit(reader, motor); !read) return read;
  const bool homes_there = motor->home && !inputs.home;
  if (homes_there) inputs.home = inputs.own;
  const bool by_older_keys = reader.has("limit") || homes_there || own_open;
  if (reader.has("inputs") && !by_older_keys) inputs.own.reset();
  return check_own(reader, *motor);
}

namespace {

// Checks the inputs of two motors of one MCU against each other.
Result<void> check_pair(const Loading& loading, std::size_t index, std::size_t before) {
  const Motor& motor = loading.config.motors[index];
  const Motor& other = loading.config.motors[before];
  for (const Use& use : kUses) {
    const auto& input = motor.inputs.*use.input;
    if (!input) continue;
    for (const Use& others : kUses) {
      const auto& its = other.inputs.*others.input;
      if (!its || its->number != input->number) continue;
      const std::string what =
          fmt::format("is input {} of MCU \"{}\", the {} of motor \"{}\"", input->number,
                      loading.config.mcu_of(motor).id, others.name, other.name);
      if (!is_limit(use) || !is_limit(others)) {
        return fail(error_at(
            loading.motors[index], use,
            fmt::format("{}; as {} of motor \"{}\" it cannot be shared; allowed: an input that no "
                        "other motor has (limits of several motors may share one). Connect it to "
                        "another input",
                        what, use.name, motor.name)));
      }
      if (its->active_open == input->active_open) continue;
      return fail(error_at(
          loading.motors[index], use,
          fmt::format("{}, which is active when {}; as {} of motor \"{}\" it is active when {}; "
                      "allowed: one level an input",
                      what, level(*its), use.name, motor.name, level(*input))));
    }
  }
  return {};
}

// The level that `input_active` gives an input counts for another motor that has it as a switch.
Result<void> check_level(const Loading& loading, std::size_t index, std::size_t with) {
  const Motor& motor = loading.config.motors[index];
  const Motor& other = loading.config.motors[with];
  const auto& own = motor.inputs.own;
  if (!own || !own->active_open) return {};
  for (const Use& use : kUses) {
    const auto& its = other.inputs.*use.input;
    if (!its || its->number != own->number || its->active_open) continue;
    return fail(loading.motors[index].error(
        loading.motors[index].has("input_active") ? "input_active" : "inputs",
        fmt::format(
            "makes input {} of MCU \"{}\" active when open, but as {} of motor \"{}\" it is "
            "active when closed; allowed: one level an input",
            own->number, loading.config.mcu_of(motor).id, use.name, other.name)));
  }
  return {};
}

}  // namespace

Result<void> check_motor_inputs(const Loading& loading) {
  const std::vector<Motor>& motors = loading.config.motors;
  std::vector<std::vector<std::size_t>> of_mcu(loading.config.mcus.size());
  for (std::size_t i = 0; i < motors.size(); ++i) {
    std::vector<std::size_t>& others = of_mcu[motors[i].mcu.value];
    for (const std::size_t before : others) {
      if (auto checked = check_pair(loading, i, before); !checked) return checked;
      if (auto checked = check_level(loading, i, before); !checked) return checked;
      if (auto checked = check_level(loading, before, i); !checked) return checked;
    }
    others.push_back(i);
  }
  return {};
}

}  // namespace bushd::config
