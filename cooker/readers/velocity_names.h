// SPDX-License-Identifier: MIT
// What velocity is called in the tools people use.
#pragma once
#include <array>
#include <cctype>
#include <string>

namespace rill::cooker {

/// Base names, likeliest first; compared without case and without a leading `_` (glTF) or `.` (Alembic).
inline constexpr std::array<const char*, 5> velocity_names = {"velocity", "v", "vel", "velocities", "flip_velocity"};

inline std::string plain_name(const std::string& name) {
    std::string plain = name.substr(!name.empty() && (name[0] == '_' || name[0] == '.') ? 1 : 0);
    for (char& c : plain) c = char(std::tolower(static_cast<unsigned char>(c)));
    return plain;
}
/// How well an attribute's name fits: 0 best, −1 not velocity. `asked`: --velocity NAME, or empty.
inline int velocity_rank(const std::string& name, const std::string& asked) {
    const std::string plain = plain_name(name);
    if (!asked.empty()) return name == asked ? 0 : plain == plain_name(asked) ? 1 : -1;
    for (size_t i = 0; i < velocity_names.size(); ++i)
        if (plain == velocity_names[i]) return int(i);
    return -1;
}

}  // namespace rill::cooker
