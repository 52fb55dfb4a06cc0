#include "daemon/shell/table_library.h"

#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "base/json_text.h"
#include "tables/store/atomic_file.h"
#include "tables/store/store.h"
#include "tables/table_file.h"
#include "tables/table_text.h"
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

Result<tables::TableContent> TableLibrary::content(const std::string& wanted) const {
  const auto found = tables::store::find(wanted, places_);
  if (!found) return fail(found.error());
  return found->content;
}

std::vector<std::string> TableLibrary::names() const {
  std::set<std::string> names;
  std::error_code error;
  for (const tables::store::Place& place : places_) {
    // Nothing may throw here: a directory that cannot be read to its end has the names seen so far.
    fs::directory_iterator file(place.directory, error);
    for (; !error && file != fs::directory_iterator(); file.increment(error)) {
      const fs::path& path = file->path();
      const std::string name = path.stem().string();
      std::error_code ignored;
      const bool configuration = fs::equivalent(path, config_.path, ignored);
      if (path.extension() == ".toml" && tables::is_table_name(name) && !configuration) {
        names.insert(name);
      }
    }
  }
  return {names.begin(), names.end()};
}

// Shipped tables belong to the installation: they are not changed.
Result<tables::store::Place> TableLibrary::home_of(const std::string& name) const {
  if (!tables::is_table_name(name))
    return fail("\"" + name.substr(0, 64) + "\" is not a table's name");
  const tables::store::Place& beside = places_[0];
  const tables::store::Place& own = places_[1];
  std::error_code error;
  const std::string file = name + ".toml";
  if (fs::equivalent(beside.directory / file, config_.path, error)) {
    return fail("\"" + name + "\" is the configuration; use another name");
  }
  if (fs::exists(beside.directory / file, error)) return beside;
  if (fs::exists(own.directory / file, error)) return own;
  for (const tables::store::Place& place : places_) {
    if (!fs::exists(place.directory / file, error)) continue;
    return fail(Error{.message = "is a shipped table and cannot be changed; use another name",
                      .file = (place.directory / file).string()});
  }
  fs::create_directories(own.directory, error);  // writing tells
  return own;
}

Result<std::uint32_t> TableLibrary::set(const std::string& name, tables::TableContent content,
                                        const std::string& expected_hash,
                                        const std::string& note) const {
  const auto home = home_of(name);
  if (!home) return fail(home.error());
  tables::store::Store store(home->directory, home->history);
  const std::string path = store.path_of(name).string();
  if (const auto fault = tables::check(content)) {
    const std::string place = fault->index ? "[" + std::to_string(*fault->index) + "]" : "";
    return fail(name + ": " + fault->key + place + ": " + fault->message);
  }
  std::error_code error;
  if (!fs::exists(path, error)) {
    if (expected_hash.empty()) return store.create(name, tables::to_text(content), note);
    return fail(Error{.message = "is not there any more; nothing was written", .file = path});
  }
  const auto now = store.read(name);
  if (!now) return fail(now.error());
  const std::uint32_t made_from = std::exchange(content.revision, now->content.revision);
  if (content == now->content) return now->content.revision;
  if (made_from != content.revision || expected_hash != tables::content_hash(now->content)) {
    return fail(Error{.message = "is another table by now, revision " +
                                 std::to_string(content.revision) +
                                 "; nothing was written. Get it and make your change again",
                      .file = path});
  }
  const auto text = tables::rewrite(now->text, content, path);
  if (!text) return fail(text.error());
  return store.save(name, now->text, *text, note);
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
  return tables::store::replace_file(in_service_, json_text(json, {.indent = 2}) + "\n");
}

}  // namespace bushd::daemon
