#include "program_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "programs/program.h"
#include "tables/text_file.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::fail;
using bushd::Result;

constexpr bushd::tables::TextLimit kLimit = {
    .bytes = api::PutProgram::kMostBytes, .told = "a program is one message", .pipes_too = true};

}  // namespace

Result<api::PutProgram> read_program(const std::string& name, const std::string& file) {
  auto text = bushd::tables::read_text(file, kLimit);
  if (!text) return fail(text.error());
  api::PutProgram request{.program = name, .text = std::move(*text)};
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  std::size_t bytes = request.text.size();
  const auto read_points = [&](const std::string& named) -> Result<std::string> {
    const auto known = std::ranges::find(request.points, named, &api::PutProgram::Points::file);
    if (known != request.points.end()) return known->text;
    auto points = bushd::tables::read_text(folder / named, kLimit);
    if (!points) return fail(points.error());
    bytes += points->size();
    request.points.push_back({named, *points});
    return points;
  };
  const auto program = bushd::programs::parse(request.text, file, read_points);
  if (!program) return fail(program.error());
  if (bytes <= api::PutProgram::kMostBytes) return request;
  return fail(bushd::Error{
      .message = fmt::format("{} bytes, with its files of points; allowed: {}. Write fewer digits "
                             "or fewer points, or repeat what repeats",
                             bytes, api::PutProgram::kMostBytes),
      .file = file});
}

}  // namespace bushctl
