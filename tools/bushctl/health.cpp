// The buses' health, once or again and again.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <optional>

#include "commands.h"
#include "health_view.h"
#include "screen.h"

namespace bushctl {
namespace {

using bushd::lcm::Health;

void print(const Health& health, bool as_json) {
  if (as_json) {
    fmt::print("{}\n", health_json(health));
  } else {
    for (const std::string& line : health_table(health)) fmt::print("{}\n", line);
  }
  std::fflush(stdout);
}

}  // namespace

int show_health(bushd::lcm::Client& client, const HealthOptions& options) {
  auto health = client.health(options.timeout);
  if (!health) return failure(client, health.error());
  if (!options.watch) {
    print(*health, options.json);
    return kDone;
  }
  std::optional<Screen> screen;
  if (!options.json && isatty(STDOUT_FILENO) != 0) screen.emplace("'bushctl health' shows all");
  for (unsigned shown = 0;;) {
    if (health && screen) screen->show(health_table(*health));
    if (health && !screen) print(*health, options.json);
    if (health && options.count && ++shown >= *options.count) return kDone;
    if (!health && client.interrupted()) return kDone;
    if (!health && !screen) return failure(client, health.error());
    if (!health) screen->notice("no health from bushd; what is shown is old");
    health = client.health(options.timeout);
  }
}

}  // namespace bushctl
