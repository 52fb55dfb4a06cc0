// What the store needs of a file system, so that tests can have one that loses power.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "base/result.h"

namespace bushd::state {

class File {
 public:
  virtual ~File() = default;
  virtual Result<std::uint64_t> size() = 0;
  // All of these bytes; beyond the end of the file they are 0.
  virtual Result<void> read(std::uint64_t offset, std::span<std::uint8_t> bytes) = 0;
  virtual Result<void> write(std::uint64_t offset, std::span<const std::uint8_t> bytes) = 0;
  // What was written stays, whatever happens to the power.
  virtual Result<void> sync() = 0;
};

class Disk {
 public:
  virtual ~Disk() = default;
  // With those above it.
  virtual Result<void> make_folder(const std::filesystem::path& folder) = 0;
  // Made if it is not there.
  virtual Result<std::unique_ptr<File>> open(const std::filesystem::path& path) = 0;
  virtual bool exists(const std::filesystem::path& path) = 0;
  virtual Result<void> rename(const std::filesystem::path& from,
                              const std::filesystem::path& to) = 0;
  virtual Result<void> remove(const std::filesystem::path& path) = 0;
  // Names of new and renamed files stay.
  virtual Result<void> sync_folder(const std::filesystem::path& folder) = 0;
  // SQLite's name of the same file system; null: its default.
  virtual const char* vfs() const = 0;
};

// That of the PC.
Disk& real_disk();

}  // namespace bushd::state
