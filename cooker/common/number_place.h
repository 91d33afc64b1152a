// SPDX-License-Identifier: MIT
// `%04d` in a file pattern: the place of a frame number.
#pragma once
#include <cstdlib>
#include <optional>
#include <string>

namespace rill::cooker {

struct NumberPlace {
    size_t begin = 0, end = 0;  ///< of the text `%04d`
    int width = 0;              ///< least digits
    bool zeros = false;         ///< filled up with zeros rather than blanks
};
inline std::optional<NumberPlace> find_number_place(const std::string& pattern, size_t from = 0) {
    for (size_t at = from; (at = pattern.find('%', at)) != std::string::npos; ++at) {
        size_t end = at + 1;
        while (end < pattern.size() && pattern[end] >= '0' && pattern[end] <= '9') ++end;
        if (end < pattern.size() && pattern[end] == 'd' && end - at <= 3)
            return NumberPlace{at, end + 1, std::atoi(pattern.c_str() + at + 1), pattern[at + 1] == '0'};
    }
    return std::nullopt;
}

}  // namespace rill::cooker
