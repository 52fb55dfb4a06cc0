// Where the project's sources are, for tests that read tables, documents or vectors. A macro in
// every test's command line would keep a compiler cache from knowing them again in another
// checkout.
#pragma once

#include <string>

namespace bushd::test {

// source_path("tables/own.toml")
std::string source_path(const std::string& below);

}  // namespace bushd::test
