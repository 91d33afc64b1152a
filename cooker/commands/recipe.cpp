// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include "commands/commands.h"
#include "readers/file_bytes.h"

namespace rill::cooker {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

enum class Kind { text, number, path, truth };
struct Key {
    const char *name, *option;
    Kind kind;
};
constexpr Key keys[] = {
    {"input", "INPUT", Kind::path}, {"output", "--output", Kind::path}, {"error", "--error", Kind::text}, {"bitrate", "--bitrate", Kind::number},
    {"frames", "--frames", Kind::text}, {"fps", "--fps", Kind::number}, {"window", "--window", Kind::number},
    {"layers", "--layers", Kind::number}, {"slip", "--slip", Kind::truth}, {"jobs", "--jobs", Kind::number}, {"velocity", "--velocity", Kind::text},
    {"velocity-unit", "--velocity-unit", Kind::text}, {"up", "--up", Kind::text}, {"handedness", "--handedness", Kind::text},
    {"scale", "--scale", Kind::number},
};
constexpr const char* target_names[] = {"bytes_per_frame", "mean_percent", "p99_percent", "max_percent", "normal_degrees"};

/// Every key once: a second one would silently win.
json parse_once(const std::string& path) {
    std::set<std::string> seen;
    const auto watch = [&](int depth, json::parse_event_t event, const json& value) {
        if (event == json::parse_event_t::key && depth == 1 && !seen.insert(value.get<std::string>()).second)
            throw UsageError(path + ": '" + value.get<std::string>() + "' stands there twice");
        return true;
    };
    try {
        return json::parse(read_file(path), watch);
    } catch (const json::parse_error& error) {
        const std::string text = error.what();
        throw InputError(path + ": not JSON: " + text.substr(std::min(text.size(), text.find("] ") + 2)));
    }
}

void set(CLI::Option& option, const std::string& value, const std::string& path) {
    if (option.count() > 0) return;  // the command line goes before
    option.add_result(value);
    try {
        option.run_callback();
    } catch (const CLI::ParseError& error) {
        throw UsageError(path + ": " + error.what());
    }
}

std::map<std::string, double> targets_of(const json& given, const std::string& path) {
    std::map<std::string, double> targets;
    if (!given.is_object()) throw UsageError(path + ": 'targets' must be an object");
    for (const auto& [name, most] : given.items()) {
        if (std::find(std::begin(target_names), std::end(target_names), name) == std::end(target_names))
            throw UsageError(path + ": '" + name + "' is no target; there are bytes_per_frame, mean_percent, p99_percent, max_percent, normal_degrees");
        if (!most.is_number() || !(most.get<double>() > 0)) throw UsageError(path + ": target '" + name + "' must be a number above 0");
        targets[name] = most;
    }
    return targets;
}

}  // namespace

std::map<std::string, double> apply_recipe(const std::string& path, CLI::App& command) {
    const json recipe = parse_once(path);
    if (!recipe.is_object()) throw InputError(path + ": not a JSON object");
    if (recipe.contains("error") && recipe.contains("bitrate")) throw UsageError(path + ": 'bitrate' stands in place of 'error': one of them");
    const bool aimed = command.count("--error") + command.count("--bitrate") > 0;  // either goes before both
    std::map<std::string, double> targets;
    for (const auto& [name, value] : recipe.items()) {
        if (name == "version") {
            if (value != 1) throw UsageError(path + ": version " + value.dump() + " is not known; this tool reads 1");
            continue;
        }
        if (name == "targets") {
            targets = targets_of(value, path);
            continue;
        }
        const Key* key = std::find_if(std::begin(keys), std::end(keys), [&, &name = name](const Key& k) { return name == k.name; });
        if (key == std::end(keys)) {
            std::string known;
            for (const Key& k : keys) known += std::string(" ") + k.name;
            throw UsageError(path + ": '" + name + "' is no setting of a recipe; there are version targets" + known);
        }
        const bool fits = key->kind == Kind::number ? value.is_number() : key->kind == Kind::truth ? value.is_boolean() : value.is_string();
        if (!fits) throw UsageError(path + ": '" + name + "' must be " + (key->kind == Kind::number ? "a number" : key->kind == Kind::truth ? "true or false" : "a text"));
        if (aimed && (name == "error" || name == "bitrate")) continue;
        std::string text = value.is_string() ? value.get<std::string>() : value.dump();
        if (key->kind == Kind::path) text = (fs::path(path).parent_path() / text).string();  // as it is when absolute
        CLI::Option* option = command.get_option_no_throw(key->option);
        set(*option, text, path);
    }
    return targets;
}

int judge_targets(const std::map<std::string, double>& targets, const std::string& asset, const json& report) {
    int code = exit_done;
    for (const auto& [name, most] : targets) {
        const double frames = report.at("source").at("frames");
        double value = HUGE_VAL;  // an infinite error is null
        if (name == "bytes_per_frame") value = double(fs::file_size(asset)) / frames;
        else if (report.at("measured").at(name).is_number()) value = report["measured"][name];
        if (value <= most) continue;
        std::fprintf(stderr, "rill: %s: target missed: %s is %.4g, above the recipe's %.4g\n", asset.c_str(), name.c_str(), value, most);
        code = exit_target_missed;
    }
    return code;
}

}  // namespace rill::cooker
