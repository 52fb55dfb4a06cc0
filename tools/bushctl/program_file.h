// The files of a program of an MCU, as a request.
#pragma once

#include <string>

#include "api/request.h"
#include "base/result.h"

namespace bushctl {

// `file` is TOML; files of points that it names are read beside it, each once. Errors: a file that
// cannot be read, what is wrong with the text, with file and line, and texts that are too long for
// one message.
bushd::Result<bushd::api::PutProgram> read_program(const std::string& name,
                                                   const std::string& file);

}  // namespace bushctl
