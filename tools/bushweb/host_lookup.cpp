#include "host_lookup.h"

#include <netdb.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace bushweb {
namespace {

bushd::Result<std::string> address_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    return bushd::fail(host + ": " + ::gai_strerror(error));
  }
  std::array<char, NI_MAXHOST> text{};
  const int error = ::getnameinfo(found->ai_addr, found->ai_addrlen, text.data(), text.size(),
                                  nullptr, 0, NI_NUMERICHOST);
  ::freeaddrinfo(found);
  if (error != 0) return bushd::fail(host + ": " + ::gai_strerror(error));
  return std::string(text.data());
}

}  // namespace

// Threads that still look keep it.
struct HostLookup::Answers {
  ~Answers() { ::close(fd); }
  int fd = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::mutex mutex{};
  std::vector<std::pair<Done, bushd::Result<std::string>>> waiting{};
};

HostLookup::HostLookup(Poller& poller) : poller_(poller), answers_(std::make_shared<Answers>()) {
  poller_.add(answers_->fd, [this] { handle(); });
}

HostLookup::~HostLookup() {
  poller_.remove(answers_->fd);
}

void HostLookup::start(const std::string& host, Done done) {
  std::thread([answers = answers_, host, done = std::move(done)]() mutable {
    auto address = address_of(host);
    const std::scoped_lock lock(answers->mutex);
    answers->waiting.emplace_back(std::move(done), std::move(address));
    ::eventfd_write(answers->fd, 1);
  }).detach();
}

void HostLookup::handle() const {
  eventfd_t count = 0;
  ::eventfd_read(answers_->fd, &count);
  std::vector<std::pair<Done, bushd::Result<std::string>>> waiting;
  {
    const std::scoped_lock lock(answers_->mutex);
    waiting.swap(answers_->waiting);
  }
  for (auto& [done, address] : waiting) done(std::move(address));
}

}  // namespace bushweb
