// A disk of the simulation: what was not synced may be lost, kept or torn when the power goes, each
// write by itself. SQLite uses it through a VFS.
#pragma once

#include <sqlite3.h>

#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "state/disk.h"

namespace bushd::sim {

class SimDisk final : public state::Disk {
 public:
  explicit SimDisk(std::uint64_t seed);
  ~SimDisk() override;
  SimDisk(const SimDisk&) = delete;
  SimDisk& operator=(const SimDisk&) = delete;

  Result<void> make_folder(const std::filesystem::path&) override { return {}; }
  Result<std::unique_ptr<state::File>> open(const std::filesystem::path& path) override;
  bool exists(const std::filesystem::path& path) override { return nodes_.contains(path.string()); }
  Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) override;
  Result<void> remove(const std::filesystem::path& path) override;
  Result<void> sync_folder(const std::filesystem::path& folder) override;
  const char* vfs() const override { return name_.c_str(); }

  // The PC loses power after so many more writes and syncs: the next ones fail, and change nothing.
  void lose_power_after(std::uint64_t operations) { left_ = operations; }
  bool has_power() const { return left_ > 0; }
  // Power is back. Files that are open stay without it.
  void boot();
  // The process that had files open is gone: nothing more comes of them, what was written stays.
  void end_process();
  // Every write and sync fails, or none does.
  void set_broken(bool broken) { broken_ = broken; }
  std::uint64_t operations() const { return operations_; }
  std::uint64_t syncs() const { return syncs_; }

  std::vector<std::string> names() const;
  std::vector<std::uint8_t>& content(const std::string& path);  // as it is on the medium as well

  // A write to a file, SQLite's included.
  struct Write {
    std::uint64_t offset;
    std::vector<std::uint8_t> bytes;
    bool truncates = false;  // to offset
  };
  struct Node {
    std::vector<std::uint8_t> medium;
    std::vector<std::uint8_t> cached;
    std::vector<Write> pending;
    bool name_synced = false;
    bool edited = false;  // by content()
    bool gone = false;    // who has it open can do nothing with it any more
  };
  std::shared_ptr<Node> node(const std::string& path);
  bool write(const std::shared_ptr<Node>& node, Write write);
  bool sync(const std::shared_ptr<Node>& node);
  std::mt19937_64& random() { return random_; }

 private:
  bool operate();

  std::string name_;
  sqlite3_vfs vfs_{};
  std::mt19937_64 random_;
  std::map<std::string, std::shared_ptr<Node>> nodes_;
  std::uint64_t left_ = UINT64_MAX;
  std::uint64_t operations_ = 0;
  std::uint64_t syncs_ = 0;
  bool broken_ = false;
};

}  // namespace bushd::sim
