// SPDX-License-Identifier: MIT
// One file per subcommand: options → settings → a call into rill::cooker → text and exit code.
#pragma once
#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cook/verdict.h"
#include "readers/reader.h"

namespace rill::cooker {

enum ExitCode { exit_done = 0, exit_usage = 1, exit_input = 2, exit_target_missed = 3 };

/// Set by the subcommand that was named; returns the exit code, or throws UsageError or InputError.
using Run = std::function<int()>;
void add_cook(CLI::App& app, Run& run);
void add_link(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run);
void add_verify(CLI::App& app, Run& run);
void add_export(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run);
void add_bench(CLI::App& app, Run& run);

/// `A:B[:S]`, or one number; inclusive, source numbers. Throws UsageError.
struct FrameRange {
    int first = 0, last = 0, step = 0;  ///< step 0: no range was given
};
FrameRange parse_frames(const std::string& text);

/// How a sequence is to be read, shared by the commands that read one.
struct InputOptions {
    std::string path, velocity_unit = "second", up, handedness;
    ReadOptions read;
    CLI::Option* add_to(CLI::App& command);  ///< returns INPUT, required
    ReadOptions checked() const;  ///< with warnings to stderr. Throws UsageError
};

/// Progress of `total` frames on stderr: one line with rate and time left on a terminal, a plain line every
/// quarter otherwise; the clock starts anew with every stage. Any thread, one at a time. Throws Interrupted.
class Progress {
public:
    Progress(std::string what, bool quiet);
    ~Progress();
    void operator()(const std::string& stage, double done, double total);

private:
    std::string what_;
    bool quiet_, terminal_, open_line_ = false;
    int last_quarter_ = 0;
    std::string last_stage_;
    std::chrono::steady_clock::time_point start_, stage_end_, last_shown_;
};

/// Size and error of a finished asset, and the exit code that follows.
int tell_target(const std::string& asset, const Verdict& verdict, bool quiet);
/// A recipe (RECIPES.md) holds the settings of one `rill cook`; what stands on the command line goes before it. Paths are
/// relative to the recipe. Returns its further targets. Throws InputError, UsageError.
std::map<std::string, double> apply_recipe(const std::string& path, CLI::App& command);
/// The finished asset against those targets: each that is missed is told; the exit code.
int judge_targets(const std::map<std::string, double>& targets, const std::string& asset, const nlohmann::json& report);

/// Written with two spaces of indent and sorted keys; "-" is standard output.
void write_json(const std::string& path, const nlohmann::json& json);
/// "12.3 kB", "4.56 MB".
std::string readable_bytes(double bytes);

}  // namespace rill::cooker
