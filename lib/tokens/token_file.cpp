#include "tokens/token_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "base/nearest_name.h"

namespace bushd::tokens {
namespace {

constexpr mode_t kMode = 0660;
constexpr const char* kHeader =
    "# Tokens of bushd-web, by their SHA-256: 'bushctl web-token' makes, lists and revokes them.\n"
    "# SHA256 NAME EXPIRES_UNIX_S MADE_UNIX_S MADE_BY\n";

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  explicit operator bool() const { return fd_ >= 0; }
  int get() const { return fd_; }

 private:
  int fd_;
};

std::string why(int error, const std::string& folder) {
  switch (error) {
    case EACCES:
    case EPERM:
      return fmt::format(
          "this user has no right to the folder of tokens, {}: it is for the group {}. Run 'sudo "
          "usermod -aG {} USER', then log in again",
          folder, kGroup, kGroup);
    case ENOENT:
    case ENOTDIR:
      return fmt::format(
          "there is no folder {}: the package bushd-web makes it. Install that, or name another "
          "file with --file ($BUSHD_WEB_TOKENS)",
          folder);
    case ELOOP:
      return "it is a link, and tokens are not read or written through one. Remove it";
    default:
      return fmt::format("{}. Is the folder {} writable, and the disk not full?",
                         std::strerror(error), folder);
  }
}

// The folder of a file of tokens. All that happens in it is by its descriptor, so that nobody puts
// another one in its place meanwhile.
struct Place {
  std::string path;
  std::string folder;
  std::string name;
  Descriptor fd;

  std::string hidden(const char* end) const { return "." + name + end; }
  tl::unexpected<Error> failed(int error) const {
    return fail(Error{.message = why(error, folder), .file = path});
  }
};

Result<Place> open_place(const std::string& path) {
  const std::filesystem::path whole(path);
  const std::string folder = whole.has_parent_path() ? whole.parent_path().string() : ".";
  Place place{.path = path,
              .folder = folder,
              .name = whole.filename().string(),
              .fd = Descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC))};
  if (!place.fd) return place.failed(errno);
  if (place.name.empty() || place.name == "." || place.name == "..") {
    return fail(Error{.message = "is a folder; name the file of tokens in it", .file = path});
  }
  return place;
}

// Nothing if it is not there.
Result<std::optional<std::string>> text_in(const Place& place) {
  // A pipe in its place would be waited for.
  const Descriptor file(::openat(place.fd.get(), place.name.c_str(),
                                 O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file && errno == ENOENT) return std::nullopt;
  struct stat status{};
  if (!file || ::fstat(file.get(), &status) != 0) return place.failed(errno);
  if (!S_ISREG(status.st_mode)) {
    return fail(Error{.message = "is no regular file. Remove it", .file = place.path});
  }
  std::string text;
  std::array<char, 16 * 1024> piece;
  // One more piece than is allowed: parse() says that it is too large.
  while (text.size() <= kMaxFileBytes) {
    const ssize_t n = ::read(file.get(), piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return place.failed(errno);
    if (n == 0) break;
    text.append(piece.data(), static_cast<std::size_t>(n));
  }
  return text;
}

// Only one process at a time changes the file. The lock ends with the descriptor, also when the
// process dies.
Result<Descriptor> lock(const Place& place) {
  Descriptor file(::openat(place.fd.get(), place.hidden(".lock").c_str(),
                           O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, kMode));
  if (!file) return place.failed(errno);
  // The next member of the group has to open it too, whatever the umask of this one. It is this
  // only where it is not so already.
  struct stat status{};
  const bool narrow = ::fstat(file.get(), &status) == 0 && (status.st_mode & kMode) != kMode;
  if (narrow && status.st_uid == ::geteuid() && ::fchmod(file.get(), kMode) != 0) {
    return place.failed(errno);
  }
  while (::flock(file.get(), LOCK_EX) != 0) {
    if (errno != EINTR) return place.failed(errno);
  }
  return file;
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// Precondition: the lock is held, so nobody else uses that file.
Result<void> replace(const Place& place, std::string_view text) {
  const std::string fresh = place.hidden(".new");
  const int folder = place.fd.get();
  // What was left by one that died.
  ::unlinkat(folder, fresh.c_str(), 0);
  const Descriptor file(
      ::openat(folder, fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kMode));
  struct stat of_folder{};
  if (!file || ::fstat(folder, &of_folder) != 0) return place.failed(errno);
  // Who is no member of that group keeps the file for the group that it has.
  (void)!::fchown(file.get(), static_cast<uid_t>(-1), of_folder.st_gid);
  const bool written = ::fchmod(file.get(), kMode) == 0 && write_all(file.get(), text) &&
                       ::fsync(file.get()) == 0 &&
                       ::renameat(folder, fresh.c_str(), folder, place.name.c_str()) == 0;
  if (!written) {
    const auto error = place.failed(errno);
    ::unlinkat(folder, fresh.c_str(), 0);
    return error;
  }
  if (::fsync(folder) != 0) return place.failed(errno);
  return {};
}

std::string without_line(std::string_view text, int number) {
  std::string out;
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    const std::size_t length = end == std::string_view::npos ? text.size() : end + 1;
    if (line != number) out += text.substr(0, length);
    text.remove_prefix(length);
  }
  return out;
}

// The file as it was read, and the text that is to take its place.
struct Content {
  std::string text;
  std::vector<Token> tokens;
};

Result<std::string> with(const Content& old, const Token& token) {
  const auto same = std::ranges::find(old.tokens, token.name, &Token::name);
  const bool is_there = same != old.tokens.end();
  if (is_there && !same->expired(token.made_s)) {
    return fail(
        fmt::format("there is a token \"{0}\" already. Give another name, or remove that one with "
                    "'bushctl web-token --revoke {0}'",
                    token.name));
  }
  if (!is_there && old.tokens.size() >= kMaxTokens) {
    return fail(
        fmt::format("has {} tokens already, the most that it may have. Remove one with 'bushctl "
                    "web-token --revoke NAME'; 'bushctl web-token --list' shows those that have "
                    "expired",
                    kMaxTokens));
  }
  std::string text = is_there ? without_line(old.text, same->line) : old.text;
  if (!text.empty() && text.back() != '\n') text += '\n';
  return text + text_of({token});
}

Result<std::string> without(const Content& old, const std::string& name) {
  const auto found = std::ranges::find(old.tokens, name, &Token::name);
  if (found != old.tokens.end()) return without_line(old.text, found->line);
  std::vector<std::string> names;
  names.reserve(old.tokens.size());
  for (const Token& token : old.tokens) names.push_back(token.name);
  return fail(fmt::format("there is no token \"{}\"{}. 'bushctl web-token --list' lists them", name,
                          did_you_mean(name, names)));
}

template <class Changed>
Result<void> change(const std::string& path, const Changed& changed) {
  const auto place = open_place(path);
  if (!place) return fail(place.error());
  const auto locked = lock(*place);
  if (!locked) return fail(locked.error());
  auto text = text_in(*place);
  if (!text) return fail(text.error());
  std::string old = text->has_value() ? std::move(**text) : kHeader;
  auto tokens = parse(old, path);
  if (!tokens) return fail(tokens.error());
  const auto fresh = changed(Content{std::move(old), std::move(*tokens)});
  if (!fresh) return fail(Error{.message = fresh.error().message, .file = path});
  // Whatever was made of it, bushd-web can read it.
  if (const auto read_again = parse(*fresh, path); !read_again) return fail(read_again.error());
  return replace(*place, *fresh);
}

}  // namespace

Result<std::vector<Token>> read(const std::string& path) {
  const auto place = open_place(path);
  if (!place) return fail(place.error());
  const auto text = text_in(*place);
  if (!text) return fail(text.error());
  if (!*text) return std::vector<Token>{};
  return parse(**text, path);
}

Result<void> add(const std::string& path, const Token& token) {
  return change(path, [&](const Content& old) { return with(old, token); });
}

Result<void> revoke(const std::string& path, const std::string& name) {
  return change(path, [&](const Content& old) { return without(old, name); });
}

}  // namespace bushd::tokens
