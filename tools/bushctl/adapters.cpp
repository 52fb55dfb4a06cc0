#include "adapters.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>

namespace bushctl {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) out.push_back(entry.path());
  std::ranges::sort(out);
  return out;
}

bool is_adapter(const fs::path& device) {
  const std::string name = device.filename().string();
  const auto begins = [&](const char* with) { return name.starts_with(with); };
  return begins("ttyUSB") || begins("ttyACM") || begins("ttyAMA") || begins("ttyXRUSB");
}

}  // namespace

std::vector<std::string> serial_adapters() {
  std::set<fs::path> devices;  // that have a name already
  std::vector<std::string> out;
  const auto add = [&](const fs::path& path) {
    std::error_code error;
    const fs::path device = fs::canonical(path, error);
    if (!error && devices.insert(device).second) out.push_back(path.string());
  };
  for (const fs::path& path : sorted_entries("/dev/serial/by-id")) add(path);
  for (const fs::path& path : sorted_entries("/dev/bushd")) add(path);
  for (const fs::path& path : sorted_entries("/dev")) {
    if (is_adapter(path)) add(path);
  }
  return out;
}

}  // namespace bushctl
