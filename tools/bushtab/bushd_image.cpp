// export-bushd and import-bushd.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <vector>

#include "base/printable.h"
#include "commands.h"
#include "json.h"
#include "open_table.h"
#include "tables/bushd/image.h"
#include "tables/store/atomic_file.h"
#include "tables/table_text.h"

namespace bushtab {
namespace {

namespace tables = bushd::tables;
namespace image = bushd::tables::image;
using bushd::fail;
using bushd::Result;
using nlohmann::ordered_json;

constexpr std::size_t kImageBytes = image::kPages * image::kPageBytes;

Result<std::vector<std::uint8_t>> read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(kImageBytes + 1);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (file.gcount() == 0) return fail(bushd::Error{.message = "cannot be read", .file = path});
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

Result<image::Image> read_image(const std::string& path) {
  const auto bytes = read_bytes(path);
  if (!bytes) return fail(bytes.error());
  if (bytes->size() != kImageBytes) {
    return fail(bushd::Error{
        .message = fmt::format("is not {} bytes long, as a memory of BUSHD-2 is", kImageBytes),
        .file = path});
  }
  image::Image memory;
  for (std::size_t i = 0; i < kImageBytes; ++i) {
    memory[i / image::kPageBytes][i % image::kPageBytes] = (*bytes)[i];
  }
  return memory;
}

Result<void> write_bytes(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  return tables::store::replace_file(path,
                                     {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string hex(const std::array<std::uint8_t, image::kPositionBytes>& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

Result<void> set_positions(image::Program& program, const std::string& text) {
  if (text.empty()) return {};
  if (text.size() != 2 * image::kPositionBytes ||
      text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) {
    return fail(
        fmt::format("--positions; allowed: {} hexadecimal digits", 2 * image::kPositionBytes));
  }
  for (std::size_t i = 0; i < image::kPositionBytes; ++i) {
    program.positions[i] = static_cast<std::uint8_t>(std::stoi(text.substr(2 * i, 2), nullptr, 16));
  }
  return {};
}

Result<tables::TableContent> content_of(const Places& places, const std::string& name) {
  const auto table = open_table(places, name);
  if (!table) return fail(table.error());
  const bushd_table& view = (*table)->view();
  tables::TableContent content{.name = (*table)->name(), .time_unit_ns = view.time_unit_ns};
  content.accel.assign(view.accel.code, view.accel.code + view.accel.count);
  content.cruise = view.cruise;
  if (!(*table)->symmetric()) {
    content.decel.emplace(view.decel.code, view.decel.code + view.decel.count);
    std::reverse(content.decel->begin(), content.decel->end());
  }
  return content;
}

Result<void> export_travel(const BushdExport& wanted, const tables::TableContent& content) {
  const auto travel = image::travel_of(content, wanted.steps, wanted.reactor_delay);
  if (!travel) return fail(travel.error());
  const auto written = write_bytes(wanted.image, image::write_travel(*travel));
  if (!written) return fail(written.error());
  if (wanted.json) {
    print_json({{"image", wanted.image},
                {"steps", wanted.steps},
                {"time_unit_ns", content.time_unit_ns},
                {"reactor_delay_code", wanted.reactor_delay}});
  } else {
    fmt::print("{}: {} steps of {} ns a code\n", bushd::printable(wanted.image), wanted.steps,
               content.time_unit_ns);
  }
  return {};
}

Result<void> export_page(const BushdExport& wanted, tables::TableContent content) {
  if (wanted.steps > image::kMaxSteps) {
    return fail(fmt::format("{} steps; a page counts up to {}", wanted.steps, image::kMaxSteps));
  }
  ordered_json resampling;
  if (wanted.resample) {
    auto resampled = image::resample(content);
    if (!resampled) return fail(resampled.error());
    resampling = {{"worst_speed_error", resampled->worst_speed_error},
                  {"top_steps_per_s_before", resampled->top_hz_before},
                  {"top_steps_per_s_after", resampled->top_hz_after}};
    if (!wanted.json) {
      fmt::print(
          "resampled: steps up to {:.1f} % slower, top speed {:.6g} instead of {:.6g} steps/s\n",
          100 * resampled->worst_speed_error, resampled->top_hz_after, resampled->top_hz_before);
    }
    content = std::move(resampled->content);
  }
  const auto start_hz = image::start_hz_of(content);
  if (!start_hz) return fail(start_hz.error());
  auto codes = image::codes_of(content);
  if (!codes) return fail(codes.error());
  image::Image memory{};
  std::error_code error;
  if (std::filesystem::exists(wanted.image, error)) {
    auto old = read_image(wanted.image);
    if (!old) return fail(old.error());
    memory = *old;
  }
  image::Program program = image::read_page(memory[wanted.page]);
  program.steps = wanted.steps;
  program.codes = std::move(*codes);
  if (auto set = set_positions(program, wanted.positions); !set) return fail(set.error());
  memory[wanted.page] = image::write_page(program);
  std::vector<std::uint8_t> bytes;
  for (const image::Page& page : memory) bytes.insert(bytes.end(), page.begin(), page.end());
  if (auto written = write_bytes(wanted.image, bytes); !written) return fail(written.error());
  if (wanted.json) {
    print_json({{"image", wanted.image},
                {"page", wanted.page},
                {"steps", wanted.steps},
                {"positions", hex(program.positions)},
                {"start_hz", *start_hz},
                {"resampled", resampling}});
  } else {
    fmt::print("{}: page {}, {} steps; set F_start to {:.6g} Hz\n", bushd::printable(wanted.image),
               wanted.page, wanted.steps, *start_hz);
  }
  return {};
}

}  // namespace

int export_bushd(const Places& places, const BushdExport& wanted) {
  auto content = content_of(places, wanted.table);
  if (!content) return refuse(content.error());
  const auto done =
      wanted.bushd1 ? export_travel(wanted, *content) : export_page(wanted, std::move(*content));
  return done ? kDone : refuse(done.error());
}

int import_bushd(const Places& places, const BushdImport& wanted) {
  auto home = home_of(places, wanted.table);
  if (!home) return refuse(home.error());
  Result<tables::TableContent> content = fail("");
  std::uint32_t steps = 0;
  ordered_json json;
  if (wanted.bushd1) {
    const auto bytes = read_bytes(wanted.image);
    if (!bytes) return refuse(bytes.error());
    const auto travel = image::read_travel(*bytes);
    if (!travel) return refuse(travel.error());
    content = image::table_of(*travel, wanted.time_unit_ns.value_or(0));
    steps = static_cast<std::uint32_t>(travel->codes.size());
    json = {{"steps", steps}, {"reactor_delay_code", travel->reactor_delay}};
  } else {
    const auto memory = read_image(wanted.image);
    if (!memory) return refuse(memory.error());
    const image::Program program = image::read_page((*memory)[wanted.page]);
    content = image::table_of(program.codes, wanted.start_hz.value_or(0));
    steps = program.steps;
    json = {{"steps", steps}, {"positions", hex(program.positions)}};
  }
  if (!content) return refuse(content.error());
  content->name = home->name;
  const std::string note = "import of " + wanted.image;
  const std::string text = tables::to_text(*content);
  const auto old = home->store.read(home->name);
  const auto revision = old && wanted.replace ? home->store.save(home->name, old->text, text, note)
                                              : create_in(*home, text, note);
  if (!revision) return refuse(revision.error());
  const std::string path = home->store.path_of(home->name).string();
  if (wanted.json) {
    json["path"] = path;
    json["revision"] = *revision;
    print_json(json);
  } else {
    fmt::print("{}: revision {}, for {} steps\n", bushd::printable(path), *revision, steps);
  }
  return kDone;
}

}  // namespace bushtab
