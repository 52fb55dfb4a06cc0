// Files that are replaced whole: whoever reads, or whatever crashes, sees the old or the new text.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bushd::tables::store {

// Writes to a temporary file in the same directory, syncs it, renames it and syncs the directory.
// Keeps the permissions of the file that is replaced, and its owner where that is allowed. Of a
// link the file that it leads to is replaced; a link to nothing is refused. Directories are not
// made.
Result<void> replace_file(const std::filesystem::path& path, std::string_view text);
// Removes the temporary files that crashes have left. Precondition: nobody else replaces that file.
void remove_leftovers(const std::filesystem::path& path);

// Keeps a text that is not saved yet in DIRECTORY/.NAME.edited.toml, or, if something is kept
// there, in .NAME.edited-2.toml and so on: what was kept before is never written over. Where the
// directory takes no file, in that of temporary files. Returns the path.
Result<std::filesystem::path> keep_aside(const std::filesystem::path& directory,
                                         const std::string& name, std::string_view text);
// What is kept for that name, oldest first.
std::vector<std::filesystem::path> kept_aside(const std::filesystem::path& directory,
                                              const std::string& name);

// Only one process at a time holds the lock of a file; waits for the others. Released with the
// object, and when the process dies.
class FileLock {
 public:
  static Result<FileLock> take(const std::filesystem::path& path);
  FileLock(FileLock&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  explicit FileLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace bushd::tables::store
