#include "daemon/shell/worker.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

namespace bushd::daemon {

Result<void> Worker::start() {
  fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK | EFD_SEMAPHORE);
  if (fd_ < 0) return fail(std::string("eventfd: ") + std::strerror(errno));
  thread_ = std::thread([this] { run(); });
  return {};
}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (fd_ >= 0) ::close(fd_);
}

void Worker::post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
    ++waiting_;
  }
  wake_.notify_one();
}

std::size_t Worker::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

void Worker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    Completion completion = job();
    lock.lock();
    completions_.push_back(std::move(completion));
    const std::uint64_t one = 1;
    static_cast<void>(::write(fd_, &one, sizeof one));
  }
}

void Worker::handle() {
  std::uint64_t count = 0;  // one, and the descriptor stays readable while there are more
  if (::read(fd_, &count, sizeof count) != sizeof count) return;
  Completion completion;
  {
    const std::lock_guard lock(mutex_);
    completion = std::move(completions_.front());
    completions_.pop_front();
    --waiting_;
  }
  completion();
}

}  // namespace bushd::daemon
