// Any text as a table file: a table that the engine can rely on, or an error that names the file.
#include "tables/table_file.h"

#include <string_view>

#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

void check_side(const bushd_ramp& side) {
  BUSHD_REQUIRE(side.sum != nullptr && side.sum[0] == 0);
  for (std::uint32_t i = 0; i < side.count; ++i) {
    BUSHD_REQUIRE(side.sum[i + 1] - side.sum[i] == side.code[i]);
  }
  for (std::uint32_t b = 0; b < bushd_ramp_bucket_entries(&side); ++b) {
    const std::uint64_t time = std::uint64_t{b} << side.bucket_shift;
    const std::uint32_t i = side.bucket[b];
    BUSHD_REQUIRE(i <= side.count && side.sum[i] <= time);
    BUSHD_REQUIRE(i == side.count || side.sum[i + 1] > time);
  }
}

void run(std::string_view text) {
  const auto table = tables::parse(text, "fuzz.toml");
  if (!table) {
    const Error& error = table.error();
    BUSHD_REQUIRE(error.file == "fuzz.toml");
    BUSHD_REQUIRE(!error.message.empty() && error.line >= 0);
    return;
  }
  const bushd_table& view = (*table)->view();
  BUSHD_REQUIRE(bushd_table_check(&view, nullptr, nullptr) == BUSHD_OK);
  BUSHD_REQUIRE(!(*table)->name().empty() && (*table)->name().size() <= tables::kMaxNameLength);
  check_side(view.accel);
  check_side(view.decel);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
