// SPDX-License-Identifier: MIT
#include <filesystem>

#include "commands/commands.h"
#include "readers/file_bytes.h"

namespace rill::cooker {

void apply_recipe(const std::string& path, CLI::App& command) {
    const nlohmann::json json = nlohmann::json::parse(read_file(path), nullptr, false);
    if (!json.is_object()) throw InputError(path + ": not a JSON object");
    for (const auto& [key, value] : json.items()) {
        CLI::Option* option = command.get_option_no_throw("--" + key);
        if (!option || key == "recipe" || key == "output" || key == "help" || key == "quiet")
            throw UsageError(path + ": '" + key + "' is no setting of a recipe");
        if (!value.is_string() && !value.is_number()) throw UsageError(path + ": '" + key + "' must be a text or a number");
        if (option->count() > 0) continue;
        option->add_result(value.is_string() ? value.get<std::string>() : value.dump());
        try {
            option->run_callback();
        } catch (const CLI::ParseError& error) {
            throw UsageError(path + ": " + error.what());
        }
    }
}

}  // namespace rill::cooker
