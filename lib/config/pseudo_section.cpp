#include "config/pseudo_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>
#include <utility>

#include "base/csv/number_csv.h"
#include "config/coordinates.h"
#include "config/words.h"
#include "tables/toml_file.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::size_t kMostOfPseudo = 32;
constexpr std::size_t kMostPoints = 10'000;
constexpr std::string_view kNames = "a name, or a list of names, one for each axis";

// A key that has one value for one axis, and a list of them for several.
Result<std::vector<std::string>> read_texts(const TomlReader& reader, std::string_view key,
                                            std::string_view allowed) {
  if (reader.is_string(key)) return std::vector<std::string>{*reader.string(key, allowed)};
  const auto array = reader.array(key, allowed);
  if (!array) return fail(array.error());
  std::vector<std::string> texts;
  for (const toml::node& node : **array) {
    const auto text = node.value_exact<std::string>();
    if (!text) {
      return fail(reader.error(key, texts.size(),
                               fmt::format("is {}; allowed: {}", tables::describe(node), allowed)));
    }
    texts.push_back(*text);
  }
  if (texts.empty()) return fail(reader.error(key, fmt::format("is empty; allowed: {}", allowed)));
  return texts;
}

Result<std::vector<double>> read_numbers(const TomlReader& reader, std::string_view key,
                                         const toml::array& array) {
  std::vector<double> numbers;
  for (std::size_t i = 0; i < array.size(); ++i) {
    const auto number = reader.number(key, i, *array.get(i), "a number");
    if (!number) return fail(number.error());
    numbers.push_back(*number);
  }
  return numbers;
}

Result<std::vector<std::vector<double>>> read_rows(const TomlReader& reader, std::string_view key,
                                                   std::string_view allowed) {
  const auto array = reader.array(key, allowed);
  if (!array) return fail(array.error());
  std::vector<std::vector<double>> rows;
  for (const toml::node& node : **array) {
    const toml::array* row = node.as_array();
    if (row == nullptr) {
      return fail(reader.error(key, rows.size(),
                               fmt::format("is {}; allowed: {}", tables::describe(node), allowed)));
    }
    auto numbers = read_numbers(reader, key, *row);
    if (!numbers) return fail(numbers.error());
    rows.push_back(std::move(*numbers));
  }
  return rows;
}

Result<std::vector<PseudoAxis>> read_axes(const TomlReader& reader) {
  const auto names = read_texts(reader, "name", kNames);
  if (!names) return fail(names.error());
  std::vector<PseudoAxis> axes;
  for (const std::string& name : *names) {
    if (!is_name(name, kLongestName)) return refuse(reader, "name", name, kNameRule);
    axes.push_back({.name = name});
  }
  const std::string allowed = fmt::format("1..{} bytes of text, or a list of them", kLongestUnit);
  const auto units = read_texts(reader, "unit", allowed);
  if (!units) return fail(units.error());
  if (units->size() != 1 && units->size() != axes.size()) {
    return fail(reader.error("unit", fmt::format("has {} elements; allowed: one, or {}, as `name`",
                                                 units->size(), axes.size())));
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::string& unit = (*units)[units->size() == 1 ? 0 : i];
    const bool steers =
        std::ranges::any_of(unit, [](char c) { return (c >= 0 && c < ' ') || c == 0x7F; });
    if (unit == units::Coordinates::kSteps) {
      return fail(
          reader.error("unit", "is \"steps\", which only motors make; allowed: " + allowed));
    }
    if (unit.empty() || unit.size() > kLongestUnit || steers) {
      return fail(reader.error("unit", "is not allowed; allowed: " + allowed));
    }
    axes[i].unit = unit;
  }
  return axes;
}

Result<std::vector<MotorId>> read_motors(const TomlReader& reader, const Config& config) {
  constexpr std::string_view kAllowed = "a list of motors";
  const auto names = read_texts(reader, "motors", kAllowed);
  if (!names) return fail(names.error());
  if (names->size() > kMostOfPseudo) {
    return fail(reader.error(
        "motors", fmt::format("has {} elements; allowed: up to {}", names->size(), kMostOfPseudo)));
  }
  std::vector<MotorId> motors;
  for (const std::string& name : *names) {
    const auto found = std::ranges::find(config.motors, name, &Motor::name);
    if (found == config.motors.end()) {
      return refuse(reader, "motors", name, "motors that are defined");
    }
    const MotorId id{static_cast<std::size_t>(found - config.motors.begin())};
    if (std::ranges::find(motors, id) != motors.end()) {
      return refuse(reader, "motors", name, "each motor once");
    }
    if (!motors.empty() && config.mcu_of(*found).bus != config.mcu_of(config[motors[0]]).bus) {
      return fail(reader.error(
          "motors", fmt::format("\"{}\" and \"{}\" are on different buses; allowed: motors of one "
                                "bus, which move along lines",
                                config[motors[0]].name, name)));
    }
    motors.push_back(id);
  }
  return motors;
}

Result<std::vector<double>> read_offset(const TomlReader& reader, std::size_t axes) {
  if (!reader.has("offset")) return std::vector<double>(axes, 0.0);
  if (axes == 1 && !reader.is_array("offset")) {
    const auto offset = reader.number("offset", "a number");
    if (!offset) return fail(offset.error());
    return std::vector<double>{*offset};
  }
  const auto array = reader.array("offset", "a number for each axis");
  if (!array) return fail(array.error());
  auto offsets = read_numbers(reader, "offset", **array);
  if (offsets && offsets->size() != axes) {
    return fail(reader.error(
        "offset", fmt::format("has {} elements; allowed: {}, as `name`", offsets->size(), axes)));
  }
  return offsets;
}

Result<void> read_limits(const TomlReader& reader, std::vector<PseudoAxis>* axes) {
  if (!reader.has("soft_limits")) return {};
  constexpr std::string_view kAllowed = "[lowest, highest] position, or a list of them";
  const auto array = reader.array("soft_limits", kAllowed);
  if (!array) return fail(array.error());
  const bool of_one = axes->size() == 1 && (*array)->size() == 2 && !(*array)->get(0)->is_array();
  std::vector<std::vector<double>> rows;
  if (of_one) {
    auto row = read_numbers(reader, "soft_limits", **array);
    if (!row) return fail(row.error());
    rows.push_back(std::move(*row));
  } else {
    auto read = read_rows(reader, "soft_limits", kAllowed);
    if (!read) return fail(read.error());
    rows = std::move(*read);
  }
  if (rows.size() != axes->size()) {
    return fail(reader.error("soft_limits", fmt::format("has {} elements; allowed: {}, as `name`",
                                                        rows.size(), axes->size())));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != 2 || !(rows[i][0] < rows[i][1])) {
      return fail(reader.error("soft_limits", i, fmt::format("allowed: {}", kAllowed)));
    }
    (*axes)[i].soft_limits = units::SoftLimits{rows[i][0], rows[i][1]};
  }
  return {};
}

Result<PseudoLaw> read_linear(const TomlReader& reader, const Pseudo& pseudo) {
  std::vector<std::vector<double>> matrix{{-1, 1}, {0.5, 0.5}};  // of a slit
  std::string_view key = "kind";
  if (reader.has("kind")) {
    if (auto kind = read_word(reader, "kind", {"slit"}); !kind) return fail(kind.error());
    if (reader.has("matrix")) {
      return fail(reader.error("matrix", "does not go with `kind`; allowed: one of the two keys"));
    }
    if (pseudo.axes.size() != 2 || pseudo.motors.size() != 2) {
      return fail(
          reader.error("kind",
                       "is \"slit\", which has two axes, gap and centre, and two motors, of "
                       "which the second opens it towards larger positions; allowed: two "
                       "names in `name` and two in `motors`"));
    }
  } else {
    key = "matrix";
    auto rows = read_rows(reader, key, "a row of numbers for each axis, a number for each motor");
    if (!rows) return fail(rows.error());
    matrix = std::move(*rows);
  }
  const bool fits =
      matrix.size() == pseudo.axes.size() && std::ranges::all_of(matrix, [&](const auto& row) {
        return row.size() == pseudo.motors.size();
      });
  if (!fits) {
    return fail(reader.error(key, fmt::format("allowed: {} rows, as `name`, of {} numbers, as "
                                              "`motors`",
                                              pseudo.axes.size(), pseudo.motors.size())));
  }
  auto offset = read_offset(reader, pseudo.axes.size());
  if (!offset) return fail(offset.error());
  auto axes = pseudo::LinearAxes::make(matrix, std::move(*offset));
  if (!axes) return fail(reader.error(key, axes.error().message));
  return PseudoLaw(std::move(*axes));
}

Result<PseudoLaw> read_curved(const TomlReader& reader, const Pseudo& pseudo,
                              const Config& config) {
  constexpr std::string_view kKey = "calibration";
  for (const std::string_view other : {"offset", "kind", "matrix"}) {
    if (!reader.has(other)) continue;
    return fail(
        reader.error(other, "does not go with `calibration`; allowed: one of the two keys"));
  }
  if (pseudo.axes.size() != 1) {
    return fail(
        reader.error(kKey, fmt::format("is for one axis, and `name` has {}", pseudo.axes.size())));
  }
  const auto name = reader.string(kKey, "the path of a CSV file");
  if (!name) return fail(name.error());
  const std::filesystem::path path = std::filesystem::path(config.path).parent_path() / *name;
  const auto told = [&](Error error) {
    const Error user = reader.error(kKey, "");
    error.message += fmt::format(" (the calibration in {}:{})", user.file, user.line);
    return fail(std::move(error));
  };
  const auto text = tables::read_text(path, "a calibration needs a hundredth of that");
  if (!text) return told(text.error());
  const auto table = csv::parse_numbers(*text, path.string(), kMostPoints);
  if (!table) return told(table.error());
  std::vector<std::string> motors;
  for (const MotorId motor : pseudo.motors) motors.push_back(config[motor].name);
  auto axis = pseudo::CurvedAxis::make(*table, pseudo.axes[0].name, motors);
  if (!axis) return told(axis.error());
  return PseudoLaw(std::move(*axis));
}

}  // namespace

Result<Pseudo> read_pseudo(const TomlReader& reader, const Config& config) {
  if (auto known = reader.only({"name", "unit", "motors", "kind", "matrix", "calibration", "offset",
                                "soft_limits", "precision"});
      !known) {
    return fail(known.error());
  }
  auto axes = read_axes(reader);
  if (!axes) return fail(axes.error());
  if (auto read = read_limits(reader, &*axes); !read) return fail(read.error());
  for (PseudoAxis& axis : *axes) {
    const Keys keys = Keys(reader).whole("precision", &axis.decimals, 0,
                                         units::Coordinates::kMostDecimals, "decimals");
    if (!keys.result()) return fail(keys.result().error());
  }
  auto motors = read_motors(reader, config);
  if (!motors) return fail(motors.error());
  Pseudo pseudo{.axes = std::move(*axes), .motors = std::move(*motors), .law = {}};
  auto law =
      reader.has("calibration") ? read_curved(reader, pseudo, config) : read_linear(reader, pseudo);
  if (!law) return fail(law.error());
  pseudo.law = std::move(*law);
  return pseudo;
}

}  // namespace bushd::config
