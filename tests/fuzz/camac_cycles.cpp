// camac_cycles SEED CYCLES: the fuzz target camac_modules with programmes made up, until so many
// cycles have been made. SEED may be "fresh". Without instruments it makes some millions a second.
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "fuzz/fuzz.h"

namespace {

constexpr std::size_t kOperations = 600;  // of a programme
constexpr std::size_t kOperationBytes = 4;
// Kinds of operations in camac_modules.cpp; those below kFirstCycle make no cycle.
constexpr unsigned kKinds = 8;
constexpr unsigned kFirstCycle = 3;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 1;
  const std::string seed_text = argv[1];
  const std::uint64_t seed = seed_text == "fresh" ? std::random_device()() : std::stoull(seed_text);
  const std::uint64_t wanted = std::stoull(argv[2]);
  std::printf("camac_cycles %llu %llu\n", static_cast<unsigned long long>(seed),
              static_cast<unsigned long long>(wanted));
  std::fflush(stdout);
  std::mt19937_64 random(seed);
  std::vector<std::uint8_t> programme(kOperations * kOperationBytes);
  for (std::uint64_t made = 0; made < wanted;) {
    for (std::size_t at = 0; at < programme.size(); at += kOperationBytes) {
      const std::uint64_t number = random();
      for (std::size_t i = 0; i < kOperationBytes; ++i) {
        programme[at + i] = static_cast<std::uint8_t>(number >> (8 * i));
      }
      if (programme[at] % kKinds >= kFirstCycle) ++made;
    }
    LLVMFuzzerTestOneInput(programme.data(), programme.size());
  }
  return 0;
}
