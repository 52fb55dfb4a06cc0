#include "daemon/bench.h"

#include <stdexcept>

namespace bushd::test {
namespace {

config::Config load(const std::string& toml) {
  auto parsed = config::parse(toml, "/nonexistent/bushd.toml");
  if (!parsed) throw std::runtime_error(parsed.error().text());
  return std::move(*parsed);
}

}  // namespace

Bench::Bench(const std::string& toml)
    : config(load(toml)), installation(config, 1), client(std::make_shared<Client>()) {}
Bench::~Bench() = default;

Bench::Client::Client() : Session(api::Transport::kLcm, "test", true) {}
Bench::Client::~Client() = default;
void Bench::Client::answer(std::int64_t number, const api::Reply& reply) {
  answers.emplace_back(number, reply);
}

std::string Bench::refusal() const {
  return std::get<api::Refused>(client->answers.back().second).reason;
}
api::Completed Bench::completed() const {
  return std::get<api::Completed>(client->answers.back().second);
}
MotorId Bench::motor(const std::string& name) const {
  return installation.find(name).value();
}

void Bench::publish(McuId, const api::StateSnapshot& state) {
  states.push_back(state);
}
void Bench::publish(McuId, const api::Description& description) {
  descriptions.push_back(description);
}
void Bench::publish(BusId, const api::HealthSnapshot& snapshot) {
  health.push_back(snapshot);
}
void Bench::move_log(const std::string& line) {
  lines.push_back(line);
}
void Bench::log(daemon::LogLevel level, daemon::LogSubject, const std::string& text) {
  if (level != daemon::LogLevel::kInfo) warnings.push_back(text);
}
void Bench::read_tables(std::uint64_t ticket, const std::vector<std::string>& names) {
  to_read.emplace_back(ticket, names);
}
void Bench::keep_tables(std::uint64_t ticket, const std::vector<std::string>& names) {
  to_keep.emplace_back(ticket, names);
}

}  // namespace bushd::test
