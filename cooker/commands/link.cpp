// SPDX-License-Identifier: MIT
#include "commands/commands.h"
#include "cook/parts_to_asset.h"

namespace rill::cooker {
namespace {
struct LinkOptions {
    std::vector<std::string> parts;
    std::string output, report;
    bool quiet = false;
};
}  // namespace

void add_link(CLI::App& app, Run& run) {
    auto options = std::make_shared<LinkOptions>();
    CLI::App* command = app.add_subcommand("link", "Join the parts that rill cook --segment made into an asset");
    command->add_option("PARTS", options->parts, "All parts of one cook, in any order")->required();
    command->add_option("-o,--output", options->output, "The asset, .rill")->required();
    command->add_option("--report", options->report, "Write the report as JSON; - is standard output");
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options] {
        run = [options] {
            const Linked linked = link_asset(options->parts, options->output);
            if (!options->report.empty()) write_json(options->report, linked.report);
            return tell_target(options->output, linked, options->quiet);
        };
    });
}

}  // namespace rill::cooker
