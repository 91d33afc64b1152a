// SPDX-License-Identifier: MIT
// The `rill` tool. Exit codes: 0 done, 1 bad usage, 2 bad input or asset, 3 done but a stated target was missed,
// 128 + n ended by signal n.
#include <signal.h>

#include <cstdio>
#include <new>

#include "commands/commands.h"
#include "common/interrupt.h"

namespace {

/// The first signal ends the work in good order, the second at once. What was ignored on entry (nohup) stays so.
void listen_for_interrupts() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction before, action {};
        if (sigaction(signal, nullptr, &before) != 0 || before.sa_handler == SIG_IGN) continue;
        action.sa_handler = [](int number) { rill::cooker::interrupting_signal = number; };
        action.sa_flags = int(SA_RESETHAND) | SA_RESTART;
        sigaction(signal, &action, nullptr);
    }
}

}  // namespace

int main(int argc, char** argv) {
    using namespace rill::cooker;
    CLI::App app("Fluid mesh sequences as small streamable assets", "rill");
    app.set_version_flag("--version", "rill " RILL_VERSION);
    app.require_subcommand(1);
    listen_for_interrupts();
    Run run;
    add_cook(app, run);
    add_link(app, run);
    add_info(app, run);
    add_verify(app, run);
    add_export(app, run);
    add_compare(app, run);
    add_bench(app, run);
    try {
        app.parse(argc, argv);
        const int code = run();
        if (std::fflush(stdout) != 0 || std::ferror(stdout)) throw InputError("standard output: cannot be written");
        return code;
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? exit_done : exit_usage;
    } catch (const UsageError& error) {
        std::fprintf(stderr, "rill: %s\n", error.what());
        return exit_usage;
    } catch (const InputError& error) {
        std::fprintf(stderr, "rill: %s\n", error.what());
        return exit_input;
    } catch (const Interrupted&) {
        std::fprintf(stderr, "rill: interrupted\n");
        return 128 + interrupting_signal;
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "rill: out of memory\n");
        return exit_input;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rill: %s\n", error.what());
        return exit_input;
    }
}
