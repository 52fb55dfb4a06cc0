// bushctl doctor.
#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "doctor/diagnosis.h"
#include "doctor/observe.h"

namespace bushctl {

void add_doctor_command(CommandLine& commands) {
  struct Options {
    std::string config;
    double watch_s = 2;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  commands.add("doctor", "Look for what goes wrong in labs, and say the remedies")
      .footer(
          "Changes nothing, and works without a daemon. As root it also sees which programs of "
          "other users have a port open.\n"
          "Exit codes: 0 no errors (warnings perhaps), 1 an error was found.")
      .file("--config", &options->config,
            "Configuration to examine (default: that of the daemon that runs, else that of the "
            "service)")
      .number<double>("--watch-s", &options->watch_s, 0.0, 3600.0,
                      "How long errors on the buses are counted")
      .flag("--json", &options->json, "Print JSON")
      .run([&commands, options] {
        auto client = commands.connection().options();
        client.interrupt_fd = signal_descriptor();
        const auto findings = doctor::diagnose(doctor::observe({.config_path = options->config,
                                                                .client = std::move(client),
                                                                .watch_s = options->watch_s}));
        print_lines(options->json ? std::vector{doctor::json(findings)} : doctor::lines(findings));
        return doctor::any_error(findings) ? kFailed : kDone;
      });
}

}  // namespace bushctl
