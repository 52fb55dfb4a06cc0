#include "sim/qemu/qemu_mcu.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace bushd::sim {
namespace {

// As firmware/ports/lm3s6965/journal.h has it.
constexpr std::uint32_t kJournal = 0x3F800;
constexpr std::uint32_t kBlank = 0xFFFFFFFF;
constexpr std::uint32_t kKindAddress = 4;
constexpr std::uint32_t kKindBootNumber = 5;

// RESC
constexpr std::uint32_t kExternal = 1u << 0;
constexpr std::uint32_t kPowerOn = 1u << 1;
constexpr std::uint32_t kWatchdog = 1u << 3;

// The longest that the image takes from a frame to knowing when it will answer.
constexpr TimeNs kDecidesNs = 20'000'000;

std::uint32_t record_of(std::uint32_t kind, std::uint32_t value) {
  const std::uint32_t check = ~(value ^ value >> 8 ^ kind) & 0xFF;
  return value | kind << 16 | check << 24;
}

// In the child, between fork and exec.
[[noreturn]] void become_qemu(const char* image, int socket, int complaints, const char* plugin,
                              pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  ::dup2(complaints, STDERR_FILENO);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  if (::dup2(socket, STDIN_FILENO) < 0) ::_exit(1);
  ::execlp("qemu-system-arm", "qemu-system-arm", "-M", "lm3s6965evb", "-nodefaults", "-nic", "none",
           "-display", "none", "-monitor", "none", "-icount", "shift=4,sleep=off,align=off",
           "-chardev", "null,id=line", "-serial", "chardev:line", "-plugin", plugin, "-kernel",
           image, static_cast<char*>(nullptr));
  ::perror("qemu-system-arm");
  ::_exit(127);
}

const char* meaning_of(std::uint32_t violation) {
  switch (violation) {
    case LOCKSTEP_WRITES_FOREIGN:
      return "writes what is others'";
    case LOCKSTEP_WRITES_GAP:
      return "writes between objects";
    case LOCKSTEP_WRITES_NOWHERE:
      return "writes where there is no memory";
    case LOCKSTEP_READS_GAP:
      return "reads between objects";
    case LOCKSTEP_READS_NOWHERE:
      return "reads where there is no memory";
    default:
      return "stores into flash that is not for writing";
  }
}

}  // namespace

QemuMcu::QemuMcu(const QemuOptions& options, std::size_t index, Driver& driver, EdgeSink* sink)
    : options_(options), index_(index), driver_(driver), sink_(sink) {
  std::uint32_t at = kJournal;
  for (std::uint32_t kind = 0; kind < 4; ++kind, at += 4) {
    flash_[at] = record_of(kind, static_cast<std::uint16_t>(options.unique_id >> 16 * kind));
  }
  flash_[at] = record_of(kKindAddress, options.address);
  for (int boot = options.boots - options.recorded_boots + 1; boot <= options.boots; ++boot) {
    flash_[at += 4] = record_of(kKindBootNumber, static_cast<std::uint16_t>(boot));
  }
  if (!options.memory_owners.empty()) {
    map_ = map_of<QemuMemoryMap>(options.image, options.memory_owners);
  }
  next_reset_ = kExternal;
  start(kPowerOn);
}

QemuMcu::~QemuMcu() {
  end();
}

void QemuMcu::start(std::uint32_t reset_cause) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "a socket for QEMU");
  }
  const std::string plugin = std::string(BUSHD_QEMU_MACHINE) + ",fd=0" + (map_ ? ",watch=on" : "");
  complaints_ = ::memfd_create("complaints", MFD_CLOEXEC);
  if (complaints_ < 0) throw std::system_error(errno, std::generic_category(), "memfd_create");
  const pid_t parent = ::getpid();
  process_ = ::fork();
  if (process_ == 0) {
    become_qemu(options_.image.c_str(), ends[1], complaints_, plugin.c_str(), parent);
  }
  ::close(ends[1]);
  socket_ = ends[0];
  if (process_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  orders_.clear();
  for (const auto& [address, word] : flash_) order(LOCKSTEP_FLASH, word, address);
  order(LOCKSTEP_RESET_CAUSE, reset_cause);
  order(LOCKSTEP_KEPT_RAM, std::exchange(kept_ram_, 0));
  if (map_) order_watch();
  set_inputs(inputs_);
}

void QemuMcu::order_watch() {
  for (const auto& code : map_->codes()) {
    order(LOCKSTEP_WATCH_CODE, code.size, code.address, code.unit);
  }
  for (const auto& object : map_->objects()) {
    order(LOCKSTEP_WATCH_OBJECT, object.size, object.address,
          static_cast<TimeNs>(object.writers.to_ullong()));
  }
  order(LOCKSTEP_WATCH_FROM, 0, map_->main_at());
}

void QemuMcu::violated(const lockstep_message& event) const {
  std::string text = options_.image + ": " + map_->place_of(event.pc);
  if (event.caller != 0) text += " called by " + map_->place_of(event.caller);
  throw std::runtime_error(text + " " + meaning_of(event.value) + ": " +
                           map_->thing_at(event.address));
}

// QEMU has ended of itself.
void QemuMcu::has_ended() const {
  siginfo_t how{};
  ::waitid(P_PID, static_cast<id_t>(process_), &how, WEXITED | WNOWAIT);
  std::array<char, 1000> said;
  const ssize_t size = std::max<ssize_t>(0, ::pread(complaints_, said.data(), said.size(), 0));
  throw std::runtime_error("QEMU has ended with " + std::to_string(how.si_status) + ": " +
                           std::string(said.data(), static_cast<std::size_t>(size)));
}

void QemuMcu::end() {
  for (int* const file : {&socket_, &complaints_}) {
    if (*file >= 0) ::close(*file);
    *file = -1;
  }
  if (process_ <= 0) return;
  ::kill(process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
}

void QemuMcu::order(lockstep_command_kind kind, std::uint32_t value, std::uint32_t address,
                    TimeNs time_ns) {
  orders_.push_back({.time_ns = time_ns,
                     .kind = static_cast<std::uint32_t>(kind),
                     .value = value,
                     .address = address,
                     .pc = 0,
                     .caller = 0,
                     .unused = 0});
}

void QemuMcu::advance(TimeNs now_ns) {
  const TimeNs from_ns = std::exchange(now_ns_, now_ns);
  if (now_ns <= boot_ns_ || now_ns == from_ns) return;
  // A watchdog takes some time to bite.
  while (!run()) start(kWatchdog);
}

TimeNs QemuMcu::advance_until_it_speaks(TimeNs until_ns) {
  until_it_speaks_ = true;
  advance(until_ns);
  until_it_speaks_ = false;
  return now_ns_;
}

void QemuMcu::send_orders() {
  const auto* out = reinterpret_cast<const char*>(orders_.data());
  std::size_t left = orders_.size() * sizeof orders_[0];
  while (left > 0) {
    const ssize_t sent = ::send(socket_, out, left, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) has_ended();
    out += sent;
    left -= static_cast<std::size_t>(sent);
  }
  orders_.clear();
}

// Up to now_ns_; false if it was reset on the way.
bool QemuMcu::run() {
  order(LOCKSTEP_RUN, until_it_speaks_, 0, now_ns_ - boot_ns_);
  send_orders();
  std::array<lockstep_message, 256> events;
  std::size_t have = 0;  // bytes
  for (;;) {
    auto* const in = reinterpret_cast<char*>(events.data());
    const ssize_t got = ::recv(socket_, in + have, sizeof events - have, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) has_ended();
    have += static_cast<std::size_t>(got);
    const std::size_t count = have / sizeof events[0];
    for (std::size_t i = 0; i < count; ++i) {
      take(events[i]);
      if (events[i].kind == LOCKSTEP_STOPPED) return true;
      if (events[i].kind == LOCKSTEP_WATCHDOG) return false;
    }
    const std::size_t rest = have % sizeof events[0];
    std::copy_n(in + have - rest, rest, in);
    have = rest;
  }
}

void QemuMcu::take(const lockstep_message& event) {
  // It stops behind the instruction that has begun before the time given.
  const TimeNs time_ns = std::min(boot_ns_ + event.time_ns, now_ns_);
  switch (event.kind) {
    case LOCKSTEP_STOPPED:
      line_timer_ = event.value != 0;
      now_ns_ = time_ns;
      break;
    case LOCKSTEP_STEP: {
      const unsigned others = levels_of(Signal::kStep) & ~(1u << event.address);
      drive(time_ns, Signal::kStep, others | event.value << event.address);
      break;
    }
    case LOCKSTEP_DIRECTIONS:
      drive(time_ns, Signal::kDir, event.value);
      break;
    case LOCKSTEP_ENABLE:
      drive(time_ns, Signal::kEnable, event.value);
      break;
    case LOCKSTEP_COMMON_DIR:
      drive(time_ns, Signal::kCommonDir, event.value);
      break;
    case LOCKSTEP_COMPARE:
      drive(time_ns, Signal::kPositionCompare, event.value);
      break;
    case LOCKSTEP_CONVERTS:
      order(LOCKSTEP_CURRENT, on_conversion ? on_conversion(time_ns) : current_);
      send_orders();
      break;
    case LOCKSTEP_DRIVER_ENABLE:
      driver_enable_ = event.value != 0;
      bytes_cut_ += !driver_enable_ && event.address != 0;
      break;
    case LOCKSTEP_SENT: {
      const auto byte = static_cast<std::uint8_t>(event.value);
      if (driver_enable_) {
        driver_.transmit(index_, time_ns, &byte, 1);
      } else {
        ++bytes_cut_;
      }
      break;
    }
    case LOCKSTEP_WATCHDOG:
      fall(time_ns);
      boot_ns_ = time_ns;
      kept_ram_ = event.value;
      break;
    case LOCKSTEP_VIOLATION:
      violated(event);
    case LOCKSTEP_OVERRUN:
      ++overruns_;
      break;
    case LOCKSTEP_STORED:
      if (event.value == kBlank) {
        flash_.erase(event.address);
      } else {
        flash_[event.address] = event.value;
        ++flash_writes_;
      }
      break;
    default:
      break;
  }
}

void QemuMcu::drive(TimeNs time_ns, Signal signal, unsigned to) {
  const unsigned changed = std::exchange(levels_of(signal), to) ^ to;
  if (sink_ == nullptr) return;
  for (std::uint8_t i = 0; changed >> i != 0; ++i) {
    if ((changed >> i & 1) != 0) sink_->edge({time_ns, index_, signal, i, (to >> i & 1) != 0});
  }
}

// It learns of it when it gets there: nobody else needs to wait.
void QemuMcu::receive(std::uint8_t byte, TimeNs now_ns) {
  if (now_ns < boot_ns_) return;
  order(LOCKSTEP_BYTE, byte, 0, now_ns - boot_ns_);
  if (byte == 0) delimiter_ns_ = now_ns;
}

bool QemuMcu::may_speak() const {
  return running() && (line_timer_ || driver_enable_ || now_ns_ - delimiter_ns_ < kDecidesNs);
}

// Switches that close to ground.
void QemuMcu::set_inputs(bushd_inputs inputs) {
  inputs_ = inputs;
  order(LOCKSTEP_INPUTS, static_cast<std::uint16_t>(~inputs.motors),
        static_cast<std::uint8_t>(~inputs.system));
}

// All that it drove.
void QemuMcu::fall(TimeNs now_ns) {
  end();
  for (const Signal signal : {Signal::kStep, Signal::kDir, Signal::kEnable, Signal::kCommonDir,
                              Signal::kPositionCompare}) {
    drive(now_ns, signal, 0);
  }
  driver_enable_ = line_timer_ = false;
}

void QemuMcu::reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t) {
  advance(now_ns);
  fall(now_ns);
  boot_ns_ = boot_ns;
  start(std::exchange(next_reset_, kExternal));
}

void QemuMcu::power_comes_back_next() {
  next_reset_ = kPowerOn;
}

void QemuMcu::flip_flash_bit(std::uint32_t address, int bit) {
  flash_[address] ^= 1u << bit;
}

// The newest record of this kind, in the page of the newest boot number.
std::uint16_t QemuMcu::kept(std::uint32_t kind) const {
  std::array<std::uint16_t, 2> boots{};
  std::array<std::uint16_t, 2> found{};
  std::array<bool, 2> has{};
  for (auto at = flash_.lower_bound(kJournal); at != flash_.end(); ++at) {
    const auto& [address, word] = *at;
    const std::size_t page = (address - kJournal) / 1024;
    const std::uint32_t of = word >> 16 & 0xFF;
    const auto value = static_cast<std::uint16_t>(word);
    if (of == kKindBootNumber) boots[page] = value, has[page] = true;
    if (of == kind) found[page] = value;
  }
  const auto ahead = static_cast<std::int16_t>(boots[1] - boots[0]);
  return found[has[1] && (!has[0] || ahead > 0) ? 1 : 0];
}

std::uint8_t QemuMcu::address() const {
  return static_cast<std::uint8_t>(kept(kKindAddress));
}

std::uint16_t QemuMcu::boot_number() const {
  return kept(kKindBootNumber);
}

}  // namespace bushd::sim
