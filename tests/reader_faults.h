// SPDX-License-Identifier: MIT
// Bad input for readers: one line that names file and cause, whatever the bytes.
#pragma once
#include <doctest/doctest.h>

#include "frames/open_sequence.h"
#include "sequence_files.h"

/// Opens and reads every frame; the text of the InputError, or "" when all is well.
inline std::string warning(const std::string& input, rill::cooker::ReadOptions options = {}) {
    std::string said;
    options.warn = [&](const std::string& message) { said += message + "\n"; };
    rill::cooker::open_sequence(input, options);
    return said;
}
inline std::string fault(const std::string& input, const rill::cooker::ReadOptions& options = {}) {
    using namespace rill::cooker;
    try {
        const auto reader = open_sequence(input, options);
        for (size_t i = 0; i < reader->info().numbers.size(); ++i) reader->read(i);
        return "";
    } catch (const InputError& error) {
        const std::string text = error.what();
        CHECK(text.find('\n') == std::string::npos);
        return text;
    }
}
#define CHECK_FAULT(expression, ...)                                  \
    do {                                                              \
        const std::string text = expression;                          \
        CAPTURE(text);                                                \
        for (const std::string& part : std::vector<std::string>{__VA_ARGS__}) CHECK_MESSAGE(text.find(part) != std::string::npos, part); \
    } while (false)

/// Every cut and every flipped byte of a good file is read, or refused in one line naming `place`. Says how
/// many were refused. `input`: what is opened; `file`: what is damaged; `stride`: of the bytes tried.
inline size_t damage_everywhere(const std::string& input, const std::filesystem::path& file, const std::string& place,
                                size_t stride = 1, const rill::cooker::ReadOptions& options = {}) {
    const std::string good = get_file(file);
    size_t refused = 0;
    const auto attempt = [&](const std::string& bytes, size_t at, const char* how) {
        put_file(file, bytes);
        const std::string text = fault(input, options);
        CAPTURE(at);
        CAPTURE(how);
        CAPTURE(text);
        if (text.empty()) return;
        ++refused;
        CHECK(text.find(place) != std::string::npos);
    };
    for (size_t at = 0; at < good.size(); at += stride) {
        attempt(good.substr(0, at), at, "cut");
        for (const int flip : {0x01, 0x80, 0xff}) {
            std::string bytes = good;
            bytes[at] = char(bytes[at] ^ flip);
            attempt(bytes, at, "flipped");
        }
    }
    put_file(file, good);
    return refused;
}
