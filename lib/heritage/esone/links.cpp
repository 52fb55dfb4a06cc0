#include "heritage/esone/links.h"

#include <chrono>

#include "heritage/esone/calls.h"

namespace bushd::esone {

Links::~Links() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (!thread_.joinable()) return;
  // A procedure may end the program: Fortran's STOP does.
  thread_.get_id() == std::this_thread::get_id() ? thread_.detach() : thread_.join();
}

void Links::link(std::int32_t handle, Procedure procedure) {
  const std::lock_guard lock(mutex_);
  links_[handle] = {.procedure = procedure};
  if (!thread_.joinable()) thread_ = std::thread([this] { watch(); });
  changed_.notify_all();
}

bool Links::arm(std::int32_t handle) {
  const std::lock_guard lock(mutex_);
  const auto link = links_.find(handle);
  if (link == links_.end()) return false;
  link->second.armed = true;
  changed_.notify_all();
  return true;
}

bool Links::unlink(std::int32_t handle) {
  std::unique_lock lock(mutex_);
  const bool was_linked = links_.erase(handle) > 0;
  if (thread_.get_id() != std::this_thread::get_id()) {
    changed_.wait(lock, [&] { return served_ != handle; });
  }
  return was_linked;
}

std::vector<std::int32_t> Links::armed() const {
  std::vector<std::int32_t> handles;
  for (const auto& [handle, link] : links_) {
    if (link.armed) handles.push_back(handle);
  }
  return handles;
}

void Links::watch() {
  std::unique_lock lock(mutex_);
  while (!ends_) {
    const auto handles = armed();
    for (const std::int32_t handle : handles) {
      lock.unlock();
      const bool raised = is_raised_(handle);
      lock.lock();
      if (ends_) return;
      if (raised) serve(handle, lock);
    }
    if (handles.empty()) {
      changed_.wait(lock, [this] { return ends_ || !armed().empty(); });
    } else {
      changed_.wait_for(lock, std::chrono::milliseconds(Calls::kPollMs), [this] { return ends_; });
    }
  }
}

void Links::serve(std::int32_t handle, std::unique_lock<std::mutex>& lock) {
  const auto link = links_.find(handle);
  if (link == links_.end() || !link->second.armed) return;  // meanwhile
  link->second.armed = false;
  served_ = handle;
  const Procedure procedure = link->second.procedure;
  lock.unlock();
  procedure();
  lock.lock();
  served_ = 0;
  changed_.notify_all();
}

}  // namespace bushd::esone
