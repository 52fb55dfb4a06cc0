#include "kept.h"

#include <algorithm>
#include <utility>

namespace bushfaults {
namespace {

namespace state = bushd::state;
using bushd::daemon::Core;

constexpr std::uint32_t kKeptStream = 405;  // of randomness
// The times of a good disk.
constexpr bushd::sim::TimeNs kFastestNs = 50'000;
constexpr bushd::sim::TimeNs kSlowestNs = 20'000'000;

}  // namespace

Kept::Kept(const bushd::config::Config& config, std::uint64_t seed)
    : config_(config), random_(seed, kKeptStream), disk_(seed) {}

bushd::Result<void> Kept::use(TimeNs now_ns, Core& core) {
  now_ns_ = now_ns;
  heal(now_ns);
  std::vector<std::string> motors;
  for (const bushd::config::Motor& motor : config_.motors) motors.push_back(motor.name);
  auto store = state::Store::open(disk_, {.folder = "/state",
                                          .motors = std::move(motors),
                                          .unguarded = !config_.state.required,
                                          .utime_us = now_ns / 1000,
                                          .random = random_.below(UINT64_MAX)});
  if (!store) return bushd::fail(store.error());
  store_.emplace(std::move(*store));
  core.kept().use(store_->kept(), *this, config_.state.required);
  return {};
}

void Kept::end_process() {
  for (Jobs* jobs : {&marks_, &writes_}) {
    if (!jobs->empty() && random_.one_in(2)) jobs->front().work();
    jobs->clear();
  }
  disk_.end_process();
  store_.reset();
}

void Kept::cut_power() {
  end_process();
  disk_.boot();
  if (broken_until_ns_ > now_ns_) disk_.set_broken(true);
}

void Kept::be_slow(TimeNs each_ns, TimeNs until_ns) {
  slow_ns_ = each_ns;
  slow_until_ns_ = std::max(slow_until_ns_, until_ns);
}

void Kept::be_broken(TimeNs until_ns) {
  broken_until_ns_ = std::max(broken_until_ns_, until_ns);
  disk_.set_broken(true);
}

void Kept::add(Jobs& jobs, decltype(Job::work) work) {
  const TimeNs from_ns = jobs.empty() ? now_ns_ : jobs.back().due_ns;
  const TimeNs takes_ns = now_ns_ < slow_until_ns_ ? random_.magnitude(slow_ns_ / 10 + 1, slow_ns_)
                                                   : random_.magnitude(kFastestNs, kSlowestNs);
  jobs.push_back({from_ns + takes_ns, std::move(work)});
}

void Kept::mark(std::vector<state::Mark> marks) {
  add(marks_, [this, marks = std::move(marks)] {
    return [this, done = store_->mark(marks)](Core& core) {
      core.kept().marked(now_ns_ / 1000, done);
    };
  });
}

void Kept::write(state::Batch batch) {
  add(writes_, [this, batch = std::move(batch)] {
    return [this, done = store_->write(batch)](Core& core) {
      core.kept().written(now_ns_ / 1000, done);
    };
  });
}

void Kept::history(std::string motor, int most, Told told) {
  add(writes_, [this, motor = std::move(motor), most, told = std::move(told)] {
    return [told, found = store_->history(motor, most)](Core&) { told(found); };
  });
}

void Kept::run(TimeNs now_ns, Jobs& jobs, Core& core) {
  while (!jobs.empty() && jobs.front().due_ns <= now_ns && has_power()) {
    const Job job = std::move(jobs.front());
    jobs.pop_front();
    const auto tell = job.work();
    if (has_power()) tell(core);
  }
}

void Kept::heal(TimeNs now_ns) {
  if (broken_until_ns_ == 0 || broken_until_ns_ > now_ns) return;
  broken_until_ns_ = 0;
  disk_.set_broken(false);
}

void Kept::run(TimeNs now_ns, Core& core) {
  now_ns_ = now_ns;
  heal(now_ns);
  run(now_ns, marks_, core);
  run(now_ns, writes_, core);
}

Kept::TimeNs Kept::next_ns() const {
  TimeNs next_ns = broken_until_ns_ != 0 ? broken_until_ns_ : bushd::sim::kNever;
  for (const Jobs* jobs : {&marks_, &writes_}) {
    if (!jobs->empty()) next_ns = std::min(next_ns, jobs->front().due_ns);
  }
  return next_ns;
}

}  // namespace bushfaults
