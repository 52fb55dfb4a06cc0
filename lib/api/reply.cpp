#include "api/reply.h"

namespace bushd::api {
namespace {

std::size_t memory_of(const std::string& text) {
  return sizeof(std::string) + text.capacity();
}

std::size_t memory_of(const TableRef& table) {
  return sizeof table + table.name.capacity() + table.hash.capacity();
}

std::size_t memory_of(std::monostate) {
  return 0;
}

std::size_t memory_of(const std::vector<MotorResult>& motors) {
  std::size_t bytes = 0;
  for (const MotorResult& motor : motors) {
    bytes += sizeof motor + memory_of(motor.motor) + memory_of(motor.unit) +
             memory_of(motor.table) + memory_of(motor.who);
  }
  return bytes;
}

std::size_t memory_of(const MovePlan& plan) {
  std::size_t bytes =
      sizeof plan + memory_of(plan.limited_by) + plan.points_us.size() * sizeof(std::int64_t);
  for (const MovePlan::Motor& motor : plan.motors) bytes += sizeof motor + memory_of(motor.motor);
  return bytes;
}

std::size_t memory_of(const TableList& list) {
  std::size_t bytes = 0;
  for (const TableEntry& entry : list.entries) {
    bytes += sizeof entry + memory_of(entry.name) + memory_of(entry.fault) + memory_of(entry.table);
  }
  return bytes;
}

std::size_t memory_of(const MotionHistory& history) {
  std::size_t bytes = 0;
  for (const PastMotion& motion : history.motions) {
    bytes += sizeof motion + memory_of(motion.what) + memory_of(motion.who) +
             memory_of(motion.outcome) + memory_of(motion.reason) + memory_of(motion.from_text) +
             memory_of(motion.to_text);
  }
  return bytes;
}

std::size_t memory_of(const Configuration& configuration) {
  std::size_t bytes = memory_of(configuration.path) + memory_of(configuration.sha256);
  for (const MotorSetting& setting : configuration.settings) {
    bytes += memory_of(setting.motor) + memory_of(setting.key) + memory_of(setting.value) +
             memory_of(setting.in_file);
  }
  return bytes;
}

std::size_t memory_of(const CamacResult& result) {
  return sizeof result + result.block.responses.capacity() * sizeof(camac::Response);
}

std::size_t memory_of(const ProgramList& list) {
  std::size_t bytes = sizeof list + list.programs.capacity() * sizeof(ProgramEntry);
  for (const ProgramEntry& entry : list.programs) {
    bytes += memory_of(entry.mcu) + memory_of(entry.program) + memory_of(entry.checksum) +
             memory_of(entry.stage) + memory_of(entry.reason) +
             entry.motors.capacity() * sizeof(ProgramEntry::Motor);
    for (const ProgramEntry::Motor& motor : entry.motors) bytes += memory_of(motor.motor);
  }
  return bytes;
}

std::size_t memory_of(const TableFile& file) {
  const words::TableContent& content = file.content;
  std::size_t codes = content.accel.capacity();
  if (content.decel) codes += content.decel->capacity();
  return sizeof file + memory_of(content.name) + memory_of(content.description) +
         memory_of(file.hash) + codes * sizeof(std::uint16_t);
}

}  // namespace

Detail::Detail() = default;
Detail::Detail(const Detail&) = default;
Detail::Detail(Detail&&) noexcept = default;
Detail& Detail::operator=(const Detail&) = default;
Detail& Detail::operator=(Detail&&) noexcept = default;
Detail::~Detail() = default;

Reply::Reply() = default;
Reply::Reply(const Reply&) = default;
Reply::Reply(Reply&&) noexcept = default;
Reply& Reply::operator=(const Reply&) = default;
Reply& Reply::operator=(Reply&&) noexcept = default;
Reply::~Reply() = default;

std::size_t memory_of(const Reply& reply) {
  std::size_t bytes = sizeof reply;
  if (const auto* refused = std::get_if<Refused>(&reply)) bytes += memory_of(refused->reason);
  if (const auto* result = std::get_if<Completed>(&reply)) {
    bytes += memory_of(result->reason) +
             std::visit([](const auto& detail) { return memory_of(detail); }, result->detail);
  }
  return bytes;
}

Completed done(std::string reason) {
  return {.outcome = Outcome::kDone, .reason = std::move(reason), .detail = {}};
}

std::string reason_of(const Reply& reply) {
  if (const auto* refused = std::get_if<Refused>(&reply)) return refused->reason;
  const auto* completed = std::get_if<Completed>(&reply);
  return completed == nullptr ? "" : completed->reason;
}

}  // namespace bushd::api
