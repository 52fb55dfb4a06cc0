// Every request in every state of a motor, mostly with a stop behind it, in the same instant or
// later: the pins make no step that nobody has asked for, and none after a stop is done; what is
// told of positions and rest is what they do; each request has one result (watched_lab.h).
//
// BUSHD_MATRIX_SEED repeats what has shown something; "fresh": one that nobody has tried before.
// BUSHD_MATRIX_SHARE: of the requests of each state one in so many.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "daemon/matrix/requests.h"
#include "daemon/matrix/states.h"
#include "daemon/matrix/watched_lab.h"

namespace bushd::test::matrix {
namespace {

std::uint32_t seed_of_run() {
  static const std::uint32_t kSeed = [] {
    const char* given = std::getenv("BUSHD_MATRIX_SEED");
    if (given == nullptr) return std::uint32_t{1985};
    return given == std::string("fresh") ? std::random_device{}()
                                         : static_cast<std::uint32_t>(std::stoul(given));
  }();
  return kSeed;
}

int share() {
  const char* given = std::getenv("BUSHD_MATRIX_SHARE");
  return given == nullptr ? 1 : std::stoi(given);
}

void stop_behind(WatchedLab& lab) {
  const int stop = lab.below(5);
  if (stop == 0) return;
  if (stop == 1) lab.run(lab.below(400) * 1e-3);
  if (stop == 2) lab.run(lab.below(20) * 1e-3);
  // Else in the same instant.
  if (stop == 4) {
    lab.ask(api::EmergencyStop{}, "stopper");
  } else {
    lab.ask(api::Stop{}, "stopper");
  }
}

class Matrix : public testing::TestWithParam<State> {};
INSTANTIATE_TEST_SUITE_P(State, Matrix, testing::ValuesIn(states()), [](const auto& tested) {
  std::string name = tested.param.name;
  std::erase_if(name, [](unsigned char c) { return c == ','; });
  std::ranges::replace(name, ' ', '_');
  return name;
});

TEST_P(Matrix, EveryRequestIsAccountedFor) {
  const State& state = GetParam();
  const std::uint32_t seed = seed_of_run();
  std::string mixture = state.name;
  mixture += std::to_string(seed);
  std::seed_seq mixed(mixture.begin(), mixture.end());
  std::mt19937 random(mixed);
  const char* manners[] = {"fine", "coarse", "fine_table"};
  const std::string manner = manners[random() % 3];
  SCOPED_TRACE("BUSHD_MATRIX_SEED=" + std::to_string(seed) + ", moves: " + manner);
  WatchedLab lab(manner, static_cast<std::uint32_t>(random()));
  const bool kept = random() % 2 == 0 || std::string(state.name) == "waits for the disk";
  if (kept) {
    lab.keep_positions();
    lab.connect();
    lab.bring_to_rest();
  }
  int rows = 0;
  int rows_in_motion = 0;
  for (const Row& row : requests()) {
    if (random() % static_cast<unsigned>(share()) != 0) continue;
    SCOPED_TRACE(std::string(row.name) + " while: " + state.name);
    const std::int64_t before = lab.steps_of(state.motor);
    state.reach(lab);
    ++rows;
    if (lab.steps_of(state.motor) != before) ++rows_in_motion;
    lab.ask(row.of(state.motor, state.other, random));
    stop_behind(lab);
    lab.run(0.8 + lab.below(1200) * 1e-3);
    lab.bring_to_rest();
    if (HasFailure()) return;
  }
  if (state.moves && share() == 1) {
    EXPECT_GT(rows_in_motion, rows / 2) << "of " << rows << " rows it has moved in few";
  }
}

template <class... Asked>
std::vector<std::string_view> names_of(const std::variant<Asked...>* /*requests*/) {
  return {Asked::kName...};
}

TEST(MatrixOfRequests, HasARowOfEachType) {
  std::mt19937 random(1);
  std::set<std::size_t> types;
  for (const Row& row : requests()) types.insert(row.of("a", "b", random).index());
  const auto names = names_of(static_cast<const api::Request::variant*>(nullptr));
  for (std::size_t type = 0; type < names.size(); ++type) {
    EXPECT_TRUE(types.contains(type)) << names[type] << " says more than names: give it a row";
  }
}

}  // namespace
}  // namespace bushd::test::matrix
