#include "daemon/table_library.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "tables/store/atomic_file.h"
#include "tables/toml_file.h"

namespace bushd::daemon {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMachineConfig = "/etc/bushd";
constexpr const char* kMachineInService = "/var/lib/bushd/tables-in-service.json";
constexpr const char* kInServiceBeside = ".tables-in-service.json";

}  // namespace

TableLibrary::TableLibrary(const config::Config& config, fs::path in_service)
    : config_(config),
      in_service_(in_service.empty() ? in_service_file(config.path) : std::move(in_service)) {
  for (const fs::path& directory : config::table_directories(config.path)) {
    places_.push_back(tables::store::place_of(directory));
  }
}

fs::path TableLibrary::in_service_file(const fs::path& config) {
  const fs::path directory = config.has_parent_path() ? config.parent_path() : ".";
  std::error_code error;
  const bool machine =
      directory == kMachineConfig || fs::equivalent(directory, kMachineConfig, error);
  return machine ? fs::path(kMachineInService) : directory / kInServiceBeside;
}

Result<tables::TablePtr> TableLibrary::open(const std::string& wanted) const {
  return tables::store::open(wanted, places_);
}

Result<std::map<std::string, std::string>> TableLibrary::kept() const {
  std::map<std::string, std::string> kept;
  std::error_code error;
  if (!fs::exists(in_service_, error)) return kept;
  const auto text = tables::read_text(in_service_);
  if (!text) return fail(text.error());
  const auto bad = [this] {
    return fail(Error{.message =
                          "is not what bushd has written: it tells by group which table is in "
                          "service. Remove it, and all groups have those of the configuration",
                      .file = in_service_.string()});
  };
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object()) return bad();
  for (const config::Group& group : config_.groups) {
    const auto entry = json.find(group.name);
    if (entry == json.end()) continue;
    if (!entry->is_object() || !entry->contains("table") || !entry->at("table").is_string() ||
        !entry->contains("configured") || !entry->at("configured").is_string()) {
      return bad();
    }
    if (entry->at("configured") != group.table_name) continue;
    kept.emplace(group.name, entry->at("table").get<std::string>());
  }
  return kept;
}

Result<void> TableLibrary::keep(const std::vector<std::string>& wanted) const {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const config::Group& group = config_.groups[i];
    if (wanted[i] == group.table_name) continue;
    json[group.name] = {{"table", wanted[i]}, {"configured", group.table_name}};
  }
  std::error_code error;
  if (json.empty() && !fs::exists(in_service_, error)) return {};
  fs::create_directories(in_service_.parent_path(), error);  // writing tells
  return tables::store::replace_file(
      in_service_,
      json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace bushd::daemon
