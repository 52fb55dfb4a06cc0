#include "sim/disk/sim_disk.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <new>
#include <utility>

namespace bushd::sim {
namespace {

constexpr std::size_t kSector = 512;

void put_into(std::vector<std::uint8_t>& content, const SimDisk::Write& write) {
  if (write.truncates) return content.resize(write.offset);
  const std::size_t end = write.offset + write.bytes.size();
  if (content.size() < end) content.resize(end);
  std::copy(write.bytes.begin(), write.bytes.end(),
            content.begin() + static_cast<std::ptrdiff_t>(write.offset));
}

tl::unexpected<Error> failed() {
  return fail("input/output error");
}

class SimFile final : public state::File {
 public:
  SimFile(SimDisk& disk, std::shared_ptr<SimDisk::Node> node)
      : disk_(disk), node_(std::move(node)) {}
  Result<std::uint64_t> size() override { return node_->cached.size(); }
  Result<void> read(std::uint64_t offset, std::span<std::uint8_t> bytes) override {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = offset + i < node_->cached.size() ? node_->cached[offset + i] : std::uint8_t{0};
    }
    return {};
  }
  Result<void> write(std::uint64_t offset, std::span<const std::uint8_t> bytes) override {
    if (disk_.write(node_, {offset, {bytes.begin(), bytes.end()}})) return {};
    return failed();
  }
  Result<void> sync() override {
    if (disk_.sync(node_)) return {};
    return failed();
  }

 private:
  SimDisk& disk_;
  std::shared_ptr<SimDisk::Node> node_;
};

// What SQLite has of an open file.
struct SqliteFile {
  sqlite3_file base;
  SimDisk* disk;
  std::shared_ptr<SimDisk::Node> node;
  int lock;
};

SqliteFile& of(sqlite3_file* file) {
  return *reinterpret_cast<SqliteFile*>(file);
}

int close_file(sqlite3_file* file) {
  of(file).node.~shared_ptr();
  return SQLITE_OK;
}

int read_file(sqlite3_file* file, void* to, int count, sqlite3_int64 offset) {
  const auto& content = of(file).node->cached;
  std::memset(to, 0, static_cast<std::size_t>(count));
  const auto from = static_cast<std::size_t>(offset);
  if (from >= content.size()) return SQLITE_IOERR_SHORT_READ;
  const std::size_t there = std::min(static_cast<std::size_t>(count), content.size() - from);
  std::memcpy(to, content.data() + from, there);
  return there == static_cast<std::size_t>(count) ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}

int write_file(sqlite3_file* file, const void* from, int count, sqlite3_int64 offset) {
  const auto* bytes = static_cast<const std::uint8_t*>(from);
  SimDisk::Write write{static_cast<std::uint64_t>(offset), {bytes, bytes + count}};
  return of(file).disk->write(of(file).node, std::move(write)) ? SQLITE_OK : SQLITE_IOERR_WRITE;
}

int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
  SimDisk::Write write{static_cast<std::uint64_t>(size), {}, true};
  return of(file).disk->write(of(file).node, std::move(write)) ? SQLITE_OK : SQLITE_IOERR_TRUNCATE;
}

int sync_file(sqlite3_file* file, int) {
  return of(file).disk->sync(of(file).node) ? SQLITE_OK : SQLITE_IOERR_FSYNC;
}

int size_of_file(sqlite3_file* file, sqlite3_int64* size) {
  *size = static_cast<sqlite3_int64>(of(file).node->cached.size());
  return SQLITE_OK;
}

int lock_file(sqlite3_file* file, int level) {
  of(file).lock = std::max(of(file).lock, level);
  return SQLITE_OK;
}

int unlock_file(sqlite3_file* file, int level) {
  of(file).lock = std::min(of(file).lock, level);
  return SQLITE_OK;
}

int check_lock(sqlite3_file*, int* reserved) {
  *reserved = 0;
  return SQLITE_OK;
}

int control_file(sqlite3_file*, int, void*) {
  return SQLITE_NOTFOUND;
}

int sector_size(sqlite3_file*) {
  return kSector;
}

int characteristics(sqlite3_file*) {
  return SQLITE_IOCAP_POWERSAFE_OVERWRITE;
}

const sqlite3_io_methods kMethods = {.iVersion = 1,
                                     .xClose = close_file,
                                     .xRead = read_file,
                                     .xWrite = write_file,
                                     .xTruncate = truncate_file,
                                     .xSync = sync_file,
                                     .xFileSize = size_of_file,
                                     .xLock = lock_file,
                                     .xUnlock = unlock_file,
                                     .xCheckReservedLock = check_lock,
                                     .xFileControl = control_file,
                                     .xSectorSize = sector_size,
                                     .xDeviceCharacteristics = characteristics,
                                     .xShmMap = nullptr,
                                     .xShmLock = nullptr,
                                     .xShmBarrier = nullptr,
                                     .xShmUnmap = nullptr,
                                     .xFetch = nullptr,
                                     .xUnfetch = nullptr};

SimDisk& disk_of(sqlite3_vfs* vfs) {
  return *static_cast<SimDisk*>(vfs->pAppData);
}

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  SimDisk& disk = disk_of(vfs);
  file->pMethods = nullptr;
  if (!disk.has_power()) return SQLITE_IOERR;
  if (name != nullptr && (flags & SQLITE_OPEN_CREATE) == 0 && !disk.exists(name)) {
    return SQLITE_CANTOPEN;
  }
  auto node = name == nullptr ? std::make_shared<SimDisk::Node>() : disk.node(name);
  new (file) SqliteFile{{&kMethods}, &disk, std::move(node), 0};
  if (out_flags != nullptr) *out_flags = flags;
  return SQLITE_OK;
}

int delete_file(sqlite3_vfs* vfs, const char* name, int) {
  if (!disk_of(vfs).exists(name)) return SQLITE_IOERR_DELETE_NOENT;
  return disk_of(vfs).remove(name) ? SQLITE_OK : SQLITE_IOERR_DELETE;
}

int access_file(sqlite3_vfs* vfs, const char* name, int, int* there) {
  *there = disk_of(vfs).exists(name) ? 1 : 0;
  return SQLITE_OK;
}

int full_name(sqlite3_vfs*, const char* name, int size, char* out) {
  std::snprintf(out, static_cast<std::size_t>(size), "%s", name);
  return SQLITE_OK;
}

int randomness(sqlite3_vfs* vfs, int count, char* out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<char>(disk_of(vfs).random()());
  return count;
}

int sleep_for(sqlite3_vfs*, int us) {
  return us;
}

int current_time(sqlite3_vfs*, double* days) {
  *days = 2460000.5;
  return SQLITE_OK;
}

int last_error(sqlite3_vfs*, int, char*) {
  return 0;
}

}  // namespace

SimDisk::SimDisk(std::uint64_t seed) : random_(seed) {
  static std::atomic<int> count = 0;
  name_ = "sim" + std::to_string(++count);
  vfs_.iVersion = 1;
  vfs_.szOsFile = sizeof(SqliteFile);
  vfs_.mxPathname = 512;
  vfs_.zName = name_.c_str();
  vfs_.pAppData = this;
  vfs_.xOpen = open_file;
  vfs_.xDelete = delete_file;
  vfs_.xAccess = access_file;
  vfs_.xFullPathname = full_name;
  vfs_.xRandomness = randomness;
  vfs_.xSleep = sleep_for;
  vfs_.xCurrentTime = current_time;
  vfs_.xGetLastError = last_error;
  sqlite3_vfs_register(&vfs_, 0);
}

SimDisk::~SimDisk() {
  sqlite3_vfs_unregister(&vfs_);
}

bool SimDisk::operate() {
  ++operations_;
  if (left_ > 0 && left_ != UINT64_MAX) --left_;
  return left_ > 0 && !broken_;
}

std::shared_ptr<SimDisk::Node> SimDisk::node(const std::string& path) {
  auto& found = nodes_[path];
  if (!found) found = std::make_shared<Node>();
  return found;
}

bool SimDisk::write(const std::shared_ptr<Node>& node, Write write) {
  if (!operate() || node->gone) return false;
  put_into(node->cached, write);
  node->pending.push_back(std::move(write));
  return true;
}

bool SimDisk::sync(const std::shared_ptr<Node>& node) {
  ++syncs_;
  if (!operate() || node->gone) return false;
  // Not all of it each time: a database grows.
  if (std::exchange(node->edited, false)) node->medium = node->cached;
  for (const Write& write : node->pending) put_into(node->medium, write);
  node->pending.clear();
  node->name_synced = true;
  return true;
}

Result<std::unique_ptr<state::File>> SimDisk::open(const std::filesystem::path& path) {
  if (!has_power()) return failed();
  return std::make_unique<SimFile>(*this, node(path.string()));
}

Result<void> SimDisk::rename(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (!operate() || !exists(from)) return failed();
  nodes_[to.string()] = nodes_[from.string()];
  nodes_.erase(from.string());
  return {};
}

Result<void> SimDisk::remove(const std::filesystem::path& path) {
  if (!operate() || !exists(path)) return failed();
  nodes_.erase(path.string());
  return {};
}

Result<void> SimDisk::sync_folder(const std::filesystem::path&) {
  if (!operate()) return failed();
  for (const auto& [name, node] : nodes_) node->name_synced = true;
  return {};
}

void SimDisk::boot() {
  std::map<std::string, std::shared_ptr<Node>> after;
  for (const auto& [name, node] : nodes_) {
    node->gone = true;
    if (!node->name_synced && random_() % 2 == 0) continue;
    auto image = std::make_shared<Node>();
    image->name_synced = true;
    image->medium = node->medium;
    for (const Write& write : node->pending) {
      const auto fate = random_() % 4;
      if (fate == 0) continue;
      if (fate < 3 || write.bytes.size() < 2) {
        put_into(image->medium, write);
        continue;
      }
      // Torn: some bytes of it, or some of its sectors.
      const bool by_sector = random_() % 2 == 0;
      const std::size_t most = by_sector ? kSector : 1 + random_() % write.bytes.size();
      for (std::size_t at = 0; at < write.bytes.size(); at += most) {
        if (random_() % 2 == 0) continue;
        const auto from = write.bytes.begin() + static_cast<std::ptrdiff_t>(at);
        const std::size_t count = std::min(most, write.bytes.size() - at);
        put_into(image->medium,
                 {write.offset + at, {from, from + static_cast<std::ptrdiff_t>(count)}});
      }
    }
    image->cached = image->medium;
    after[name] = image;
  }
  nodes_ = std::move(after);
  left_ = UINT64_MAX;
  broken_ = false;
}

void SimDisk::end_process() {
  for (auto& [name, node] : nodes_) {
    auto same = std::make_shared<Node>(*node);
    node->gone = true;
    node = std::move(same);
  }
}

std::vector<std::string> SimDisk::names() const {
  std::vector<std::string> names;
  for (const auto& [name, node] : nodes_) names.push_back(name);
  return names;
}

std::vector<std::uint8_t>& SimDisk::content(const std::string& path) {
  node(path)->edited = true;
  return node(path)->cached;
}

}  // namespace bushd::sim
