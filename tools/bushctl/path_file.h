// Paths from files and words: the requests that bring their points, one after the other.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/request.h"
#include "base/result.h"
#include "move_arguments.h"

namespace bushctl {

struct PathFile {
  std::vector<bushd::api::MovePath> parts{};  // at least one; the last one begins it
  std::string file{};
  std::vector<int> lines{};  // in the file, of each point

  // What the daemon says of a point, by where that is in the file.
  std::string located(const std::string& reason) const;
};

// Reads a file's text: a header of motors' names, and rows of positions in their units.
bushd::Result<PathFile> parse_path(std::string_view text, const std::string& file,
                                   const std::string& corners, const std::string& speed,
                                   const std::string& feed = "");

// "theta --to 400" with "--speed-at 100:2.5 --speed-at=300:5" among its words: 2.5 units/s from
// position 100 on, 5 from 300 on, and until 100 as fast as `speed` allows. Nothing: no such words.
bushd::Result<std::vector<bushd::api::MovePath>> parse_speed_profile(
    const std::vector<std::string>& words, Numbers numbers, const std::string& speed);

}  // namespace bushctl
