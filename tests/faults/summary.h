// What a run came to, for people and for programs.
#pragma once

#include <string>

#include "world.h"

namespace bushfaults {

std::string summary_text(const World& world, double real_s);
std::string summary_json(const World& world);
// What happened before a violation, and how to see it again.
std::string story(const World& world, const Options& options);

}  // namespace bushfaults
